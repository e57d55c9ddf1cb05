#pragma once
// What tind keeps in an MBTiles database beside what the format wants: an entry for each tile, the
// hashes of the source's blocks, and the seal. docs/formats.md has the tables.

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace tind::mbtiles {

inline constexpr const char* kLayer = "tind:layer";    // in the metadata: the text of layer.json
inline constexpr const char* kRecord = "tind:record";  // of the build's record
inline constexpr const char* kSeal = "tind:seal";
inline constexpr const char* kEntries = "tind_entries";  // tables
inline constexpr const char* kBlocks = "tind_blocks";

struct Seal {
  std::uint64_t head = 0;  // of layer and record: the seed of the entries
  std::uint64_t tiles = 0;
  std::uint64_t entries = 0;  // hash of all of them, each seeded with that of those before
  std::uint64_t blocks = 0;   // hash; 0: none are kept
};
std::string encode(const Seal&);
std::optional<Seal> decode_seal(std::string_view text);

}  // namespace tind::mbtiles
