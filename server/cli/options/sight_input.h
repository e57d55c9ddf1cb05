#pragma once
// What lines of sight and viewsheds are told alike: refraction, and how good the heights are.

#include <optional>

#include "server/cli/program/command_line.h"
#include "terrain/analysis/sight_ray.h"
#include "terrain/base/result.h"
#include "terrain/raster/dem_source.h"

namespace tind::cli {

struct SightInput {
  double refraction = 0.13;
  std::optional<double> uncertainty_m;
  bool stated = false;
};

/// --refraction, --uncertainty, --stated-accuracy.
void add_sight_options(Command, SightInput&);

/// `seen_m`: how far what is asked may be from the DEM (AskedDem::error_m()); the DEM's own
/// uncertainty comes on top. Fails (invalid_argument) for --stated-accuracy of a DEM of which none
/// is stated.
Result<double> uncertainty_of(const SightInput&, const DemInfo&, double seen_m);

}  // namespace tind::cli
