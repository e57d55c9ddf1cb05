#pragma once
// What stores keep of each finished tile, and its bytes: in the ledger of a folder and in archives
// alike. docs/formats.md has them.

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "terrain/geo/tiling_scheme.h"
#include "terrain/store/tile_store.h"

namespace tind {

/// A finished tile.
struct LedgerEntry {
  TileId id;
  TileFacts facts;
  std::uint64_t hash_low = 0, hash_high = 0;  // of the tile, as it is stored

  /// Takes size and hash.
  void take(std::string_view stored);
  /// Are these the bytes?
  bool vouches_for(std::string_view stored) const;
};

inline constexpr std::size_t kLedgerPlace = 64;  // bytes of an entry

/// `seed`: stands for what the entry belongs to.
std::string encode_place(const LedgerEntry&, std::uint64_t seed);
/// Nothing unless the bytes are those of an entry of this tile with this seed.
std::optional<LedgerEntry> decode_place(std::string_view bytes, TileId, std::uint64_t seed);

}  // namespace tind
