#pragma once
// A patch of a bucket: a rectangle that is meshed by itself, with borders that neighbours share.
//
// Like a tile (tile/border.h) it has a grid of its own, in which orientation is exact, and borders
// that are functions of the line, the surface and the plan alone. What is measured are the vertices
// as FlightGear reads them: on one lattice of the whole globe, with triangles straight in space.

#include <cstdint>
#include <stop_token>
#include <string>
#include <vector>

#include "terrain/base/result.h"
#include "terrain/flightgear/bucket_plan.h"
#include "terrain/geo/coordinates.h"
#include "terrain/mesh/tin.h"
#include "terrain/raster/land_cover.h"

namespace tind::flightgear {

/// Metres. Vertices lie on multiples of it in ECEF, so that a vertex of two buckets is the same
/// whatever their centres: from a centre on the lattice, 24 bits reach 32 km.
inline constexpr double kLatticeStep = 1.0 / 512;
inline constexpr double kFarthest_m = 32768;

struct Patch {
  GeoRect rect;
  /// x = u, y = v in the grid of the rectangle; z metres as the surface has them.
  Tin mesh;
  std::vector<Vec3> ecef;              // of the vertices, above the sea, on the lattice
  std::vector<Vec3> normals;           // of the surface, unit, ECEF
  std::vector<std::string> materials;  // of the triangles
  double max_error_m = 0;   // no valid post that it covers is farther from it, vertically
  double edge_error_m = 0;  // its border, of that of the DEM with its voids filled
  std::uint64_t posts = 0;  // valid ones in the closed rectangle
  double void_share = 0;    // of its area: no height is known there; to a thousandth
};

/// REQUIRES: a rectangle of `patch_rects`.
Result<Patch> make_patch(const BucketPlan&, const GeoRect&, std::stop_token = {},
                         const LandCover* cover = nullptr);

/// The patches of a bucket, from the south, each row from the west. Those of the next row of
/// buckets, be they narrower, have the same corners on the line between.
std::vector<GeoRect> patch_rects(const BucketPlan&, BucketId);

}  // namespace tind::flightgear
