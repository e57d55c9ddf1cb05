#pragma once
// How good the heights of a surface are said to be by who made them: what every answer about its
// heights repeats beside tind's own error. It changes no tile.

#include <vector>

#include "proto/tile/layer_json.h"
#include "terrain/surface/surface.h"

namespace tind {

/// Of the layers that say it, the lowest first, by their names; of one DEM without a name.
std::vector<proto::StatedAccuracy> stated_accuracy(const Surface&);

}  // namespace tind
