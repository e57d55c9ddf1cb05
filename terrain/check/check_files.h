#pragma once
// What a tile set says it holds (layer.json) and what it does hold, for the checker.

#include <cstdint>
#include <string>
#include <vector>

#include "terrain/base/result.h"
#include "terrain/check/check_findings.h"
#include "terrain/geo/tiling_scheme.h"
#include "terrain/store/tile_store.h"

namespace tind {

/// Every tile, by level, sorted by (x, y); TMS rows: what lies in the store, or, where it cannot be
/// listed, what layer.json calls available.
struct TileListing {
  const TileStore& store;
  std::vector<std::vector<TileId>> levels;
  std::vector<std::string> extensions;  // as layer.json names them

  /// Place in its level, or -1.
  std::int64_t find(TileId) const;
};

/// Lists the tiles of levels first..last and checks layer.json, and one against the other. Fails
/// only when the store cannot be looked into, when all its tiles are of other levels
/// (out_of_range), or when it cannot be listed and layer.json cannot be had or names more tiles
/// than can be looked at. The store must outlive the listing.
Result<TileListing> check_files(const TileStore&, int first_level, int last_level, Findings&);

/// A tile's bytes, unpacked; false, and a finding, when they cannot be had.
bool read_tile_file(const TileListing&, TileId, std::vector<std::uint8_t>& bytes, Findings&);

}  // namespace tind
