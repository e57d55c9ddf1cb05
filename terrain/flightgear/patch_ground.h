#pragma once
// What the ground of a patch is made of, by its water and its land cover, and a mesh whose
// triangles follow that.

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "terrain/base/result.h"
#include "terrain/flightgear/bucket_plan.h"
#include "terrain/geo/coordinates.h"
#include "terrain/mesh/tin.h"
#include "terrain/raster/land_cover.h"

namespace tind::flightgear {

class PatchGround {
 public:
  /// Takes a water mask of the rectangle. Fails as that does. `cover` may be null.
  static Result<PatchGround> make(const BucketPlan&, const GeoRect&, const LandCover* cover);

  /// Which of materials() there is at places of the rectangle's grid: water where most of a cell of
  /// the mask is, else that of the class, else that of land.
  std::vector<std::uint32_t> at(std::span<const Vec3>) const;
  const std::vector<std::string>& materials() const { return materials_; }

  /// With land cover, cuts triangles in which there are several materials, until their sides, or
  /// the parts beside sides that may not be cut, are shorter than kGroundDetail_m. The mesh, in the
  /// grid of the rectangle, keeps its heights, and its border keeps its vertices. REQUIRES: a valid
  /// Tin.
  void cut(Tin&) const;

  /// Of each triangle, by four places in it: water where most of it is, else the class that most
  /// have, its middle's among equals.
  std::vector<std::uint32_t> of_triangles(const Tin&) const;

 private:
  PatchGround(const GeoRect& rect, const LandCover* cover);

  GeoRect rect_;
  std::vector<std::string> materials_;  // land, water, then those of the classes
  std::vector<std::uint8_t> mask_;      // empty: no water; else 1 or side x side, the north first
  const LandCover* cover_;              // null: nobody gave any

  int wet(const Vec3&) const;  // 0..255; REQUIRES: a mask
  std::vector<std::uint32_t> covers_at(std::span<const Vec3>) const;
};

/// How ragged materials are at their edges.
inline constexpr double kGroundDetail_m = 120;

}  // namespace tind::flightgear
