#pragma once
// What a tile set says it holds (layer.json) and what it does hold, for the checker.

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "terrain/base/result.h"
#include "terrain/check/check_findings.h"
#include "terrain/geo/tiling_scheme.h"
#include "terrain/store/folder/tile_ledger.h"
#include "terrain/store/tile_location.h"

namespace tind {

/// Every tile, by level, sorted by (x, y); TMS rows. Of a directory: each z/x/y.terrain below it.
/// Of a URL, which cannot be listed: what layer.json calls available.
struct TileListing {
  TileLocation location;
  std::vector<std::vector<TileId>> levels;
  std::vector<std::string> extensions;       // as layer.json names them
  std::shared_ptr<const TileLedger> ledger;  // of a directory, where there is one

  /// Place in its level, or -1.
  std::int64_t find(TileId) const;
};

/// Lists the tiles of levels first..last and checks layer.json, and one against the other. Fails
/// only when the directory cannot be read, or layer.json cannot be had from a URL, or when a URL
/// lists more tiles than can be looked at.
Result<TileListing> check_files(const TileLocation&, int first_level, int last_level, Findings&);

/// A tile's bytes, unpacked; false, and a finding, when they cannot be had.
bool read_tile_file(const TileListing&, TileId, std::vector<std::uint8_t>& bytes, Findings&);

}  // namespace tind
