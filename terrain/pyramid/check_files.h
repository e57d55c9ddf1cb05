#pragma once
// What a directory says it holds (layer.json) and what it does hold, for the checker.

#include <cstdint>
#include <string>
#include <vector>

#include "terrain/base/result.h"
#include "terrain/geo/tiling_scheme.h"
#include "terrain/pyramid/check_findings.h"

namespace tind {

/// Every z/x/y.terrain below a directory, by level, sorted by (x, y); TMS rows.
struct TileListing {
  std::string directory;
  std::vector<std::vector<TileId>> levels;
  std::vector<std::string> extensions;  // as layer.json names them

  /// Place in its level, or -1.
  std::int64_t find(TileId) const;
  std::string path(TileId id) const { return directory + "/" + id.text() + ".terrain"; }
};

/// Lists the tiles and checks layer.json, and one against the other. Fails only when the directory
/// cannot be read.
Result<TileListing> check_files(const std::string& directory, Findings&);

/// A tile's bytes, unpacked; false, and a finding, when they cannot be had.
bool read_tile_file(const std::string& path, const std::string& where,
                    std::vector<std::uint8_t>& bytes, Findings&);

}  // namespace tind
