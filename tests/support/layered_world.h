#pragma once
// Surfaces of several layers, and what holds of every folder of tiles that is made of one.

#include <cstddef>
#include <map>
#include <memory>
#include <string>

#include "terrain/raster/dem_source.h"
#include "terrain/surface/surface.h"
#include "tests/support/made_up_source.h"

namespace tind::test {

std::shared_ptr<const DemSource> made(HeightGrid grid, Geographic corner, double spacing,
                                      double turn = 0);

/// A coarse base, two finer ones of one rank that overlap, one of them turned and with voids, and a
/// small fine one over the rim of those. `lift`: of one post of that.
Surface three_ranks(double lift = 0);

/// All tiles below, by name.
std::map<std::string, std::string> tiles_in(const std::string& folder);

/// The checker finds nothing that must not be, over every post that decides.
void expect_no_violation(const std::string& folder, const Surface& surface);

/// No sample beside the posts of layers is farther from its tile than that states. How many there
/// are.
std::size_t expect_rims_held(const std::string& folder, const Surface& surface);

}  // namespace tind::test
