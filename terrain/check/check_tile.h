#pragma once
// The rules that one decoded tile must keep by itself: edges, mesh, culling, normals, stated error.
// Own formulae throughout (the ellipsoid too): nothing here is what make_tile uses.

#include <optional>
#include <string>

#include "terrain/check/check_decode.h"
#include "terrain/check/check_findings.h"
#include "terrain/geo/tiling_scheme.h"
#include "terrain/mesh/side.h"

namespace tind {

/// What the metadata extension says of the error.
struct StatedError {
  std::optional<double> max_error_m;
  std::optional<double> edge_error_m;
  std::optional<double> geometric_error_m;  // what some clients display by
  bool exact = false;
  std::optional<double> residual_m;  // the share of it that is the residual index's, at most
  Side side = Side::both;
};

/// `error_factor`: the budget of level z is error_factor times what clients assume of it.
StatedError check_tile(const CheckedTile&, TileId, double error_factor, Findings&);

/// What a client assumes the error of a level to be, metres (the checker's own figure).
double assumed_level_error(int level);

}  // namespace tind
