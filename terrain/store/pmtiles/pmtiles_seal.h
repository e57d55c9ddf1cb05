#pragma once
// What tind leaves behind the tiles of a PMTiles archive, where other readers do not look: an entry
// for each tile, the hashes of the source's blocks, and the seal, which stands for every byte.
// docs/formats.md has its bytes.

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "proto/tile/pmtiles.h"
#include "terrain/geo/tiling_scheme.h"

namespace tind::pmtiles {

inline constexpr const char* kLayer = "tind:layer";    // in the metadata: the text of layer.json
inline constexpr const char* kRecord = "tind:record";  // of the build's record
inline constexpr const char* kSealed = "tind:seal";    // there is one, of this version
inline constexpr int kVersion = 1;

/// The last bytes of the file.
struct Seal {
  std::uint64_t tiles = 0;
  std::uint64_t entries_at = 0;    // in the section of tiles; so many bytes of tiles there are
  std::uint64_t entries_hash = 0;  // of all of them, each seeded with that of those before
  std::uint64_t blocks_size = 0, blocks_hash = 0;
  std::uint64_t head_hash = 0;  // of header, root and metadata
  std::uint64_t leaves_hash = 0, leaf_entries = 0;

  /// Stands for the whole archive.
  std::uint64_t hash() const;
};
inline constexpr std::size_t kSealBytes = 88;

std::string encode(const Seal&);
std::optional<Seal> decode_seal(std::string_view bytes);

/// PMTiles counts rows from the north and has one tile at zoom 0: ours are one zoom deeper, in the
/// northern half of the square.
inline proto::PmtilesPlace place_of(TileId id) {
  return {id.level + 1, id.x, (1u << id.level) - 1 - id.y};
}
std::optional<TileId> tile_of(const proto::PmtilesPlace&);

}  // namespace tind::pmtiles
