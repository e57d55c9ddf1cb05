#pragma once
// Does one place see another?

#include <optional>

#include "terrain/analysis/sight_ray.h"
#include "terrain/base/enum_names.h"
#include "terrain/base/result.h"
#include "terrain/geo/coordinates.h"
#include "terrain/raster/dem_source.h"

namespace tind {

template <>
struct EnumNames<Visibility> {
  static constexpr const char* kWhat = "visibility";
  static constexpr std::pair<Visibility, const char*> kAll[] = {{Visibility::hidden, "hidden"},
                                                                {Visibility::visible, "visible"},
                                                                {Visibility::depends, "depends"}};
};

/// One end of a line of sight.
struct SightEnd {
  Geographic place;
  double above_ground_m = 0;
};

struct LineOfSight {
  Visibility visibility = Visibility::depends;
  double length_m = 0;             // straight through the air
  double eye_m = 0, target_m = 0;  // heights above what the DEM's are above
  /// Where the ray comes nearest to the ground or deepest below it. Nothing where all below it is
  /// void.
  struct At {
    double share = 0;  // of the way
    Geographic place;
    double ground_m = 0, clearance_m = 0;  // clearance: of the ray, negative below the ground
  };
  std::optional<At> nearest;
  std::optional<double> first_hidden_share;  // where the ray first goes into the ground
  /// What is left of the nearest clearance after all errors, and what it may be with them.
  std::optional<double> surely_m, perhaps_m;  // of a question with uncertainty
  bool unknown = false;                       // there are voids below the ray, or it leaves the DEM
};

/// Over the bilinear surface, by one equation a cell (sight_ray.h): no sample can miss a ridge.
/// Without uncertainty the answer is visible or hidden, but where the ray is over voids; with it,
/// an answer that is not `depends` is that of every surface whose posts are within it of these.
///
/// Heights of the DEM are taken for heights above the ellipsoid; where they are above a geoid, the
/// earth is as much too small, which no line of sight shows. Symmetric in its ends.
///
/// Fails (invalid_argument) for an end without ground, ends farther apart than kLongestSight_m, a
/// DEM without CRS; with the source's errors.
Result<LineOfSight> line_of_sight(const DemSource&, const SightEnd& eye, const SightEnd& target,
                                  const SightRules&);

}  // namespace tind
