#pragma once
// Questions of a TIN itself, where the answer is exact without posts: over each triangle the ground
// is a plane, so a line over it turns at edges alone, and a volume under it has a closed form.

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <stop_token>
#include <string>
#include <variant>
#include <vector>

#include "terrain/analysis/profile.h"
#include "terrain/analysis/volume.h"
#include "terrain/base/result.h"
#include "terrain/geo/coordinates.h"
#include "terrain/mesh/tin.h"
#include "terrain/raster/dem_source.h"

namespace tind {

/// Where the posts of `frame` are says where the TIN is; they have no heights. A column and a row
/// are about a metre.
struct TinGround {
  Tin tin;  // x = column, y = -row, metres up; terrain, as as_terrain() makes it
  std::shared_ptr<const DemSource> frame;
};

/// `tin`: in its CRS (x east, y north); `unit_m`: metres per unit of x, y and z. `name`, `crs`,
/// `datum` and `options`: as dem_of() takes them (raster/held_posts.h), and fails as that does.
/// (invalid_argument) where `options` bring heights to another datum: that is done at posts.
Result<TinGround> tin_ground(Tin tin, const Vec3& unit_m, const std::string& name,
                             const std::string& crs, const VerticalDatum& datum,
                             const DemOptions& options);

/// The TIN's own height at each place; outside where no triangle is. Fails (invalid_argument)
/// without a CRS. O(triangles + places).
Result<std::vector<HeightAt>> heights_at(const TinGround&, std::span<const Geographic> places);

/// As sampled_profile() and exact_profile() have it: the exact one has a point wherever the line
/// crosses an edge, and is straight between them.
Result<Profile> sampled_profile(const TinGround&, const GeodesicPath&,
                                std::vector<double> distances);
Result<Profile> exact_profile(const TinGround&, const GeodesicPath&, const std::stop_token& = {});

/// Cut and fill of all of the TIN, against a height or a plane (x = column, y = row of `frame`), by
/// the integral over each triangle; in the plane of its projection. `uncertainty_m`: of each
/// height. Fails (invalid_argument) for three points on one line; (unsupported) for degrees, in
/// which a triangle is no plane figure of the ground.
Result<Volume> volume(const TinGround&, const std::variant<LevelReference, PlaneReference>&,
                      double uncertainty_m = 0);

}  // namespace tind
