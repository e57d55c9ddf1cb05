#include "terrain/tiles3d/tile3d.h"

#include <algorithm>

#include "terrain/tile/culling.h"
#include "terrain/tile/largest_error.h"

namespace tind::tiles3d {
namespace {

double nominal_error(const TileModel& tile) {
  const double assumed = tiling::level_error(tile.id.level);
  return std::max(tile.displayed_error_m, assumed);
}

/// The most that a tile of the next level is to be from its posts, and its border from the DEM's,
/// as a mesh that is straight in longitude and latitude. (plan/level_plan.cpp: a level's budget is
/// at most its nominal error, and below a tile that rests on the residual index others may, which
/// take all of it.)
double finer_fit(const TileModel& tile) {
  const double finer = nominal_error(tile) / 2;
  return tile.residual_m ? finer : std::min(finer, kLargestError_m);
}
/// What rounding to a compressed lattice adds to that, vertically, where the ground is no steeper
/// than two up for one aside. (Not compressed it is a hundred thousandth of the nominal error.)
double finer_rounding(const TileModel& tile, GlbCompression compression) {
  if (compression == GlbCompression::none) return 0;
  constexpr double kHalfDiagonal = 0.87;  // of a cube
  return 3 * kHalfDiagonal * glb_lattice(tile.id.level + 1, compression);
}
/// What drawing it straight through space adds to both: a quarter of its level's error over a
/// border (plan/level_plan.h, curvature_cells), half of it over the surface.
double finer_edge(const TileModel& tile, GlbCompression compression) {
  return finer_fit(tile) + nominal_error(tile) / 8 + finer_rounding(tile, compression);
}
double finer_surface(const TileModel& tile, GlbCompression compression) {
  return finer_fit(tile) + nominal_error(tile) / 4 + finer_rounding(tile, compression);
}

/// Of its border as it is drawn, vertically, from that of the DEM with its voids filled.
double edge_error(const TileModel& tile, GlbCompression compression) {
  return tile.certificate->edge_error_m + space_error(tile, compression).edge_m;
}

struct Span {
  double low = HUGE_VAL, high = -HUGE_VAL;
};

Span heights(const Tin& mesh) {
  Span span;
  for (const Vec3& v : mesh.vertices)
    span.low = std::min(span.low, v.z), span.high = std::max(span.high, v.z);
  return span;
}

/// The occlusion point of whatever lies between so far below and above the tile's vertices.
Vec3 occlusion_point(const TileModel& tile, double below, double above) {
  const GeoRect rect = tiling::rect(tile.id);
  std::vector<Vec3> places;
  places.reserve(2 * tile.mesh.vertices.size());
  for (const Vec3& v : tile.mesh.vertices) {
    const Geographic p = place_of(rect, v);
    places.push_back({p.lon, p.lat, v.z - below});
    places.push_back({p.lon, p.lat, v.z + above});
  }
  return culling_volumes(rect, places).horizon_occlusion;
}

}  // namespace

double wall_depth_m(const TileModel& tile, const TileModel* parent, GlbCompression compression) {
  if (!tile.certificate) return 5 * nominal_error(tile);
  const double coarser = parent && parent->certificate ? edge_error(*parent, compression) : 0;
  return edge_error(tile, compression) + std::max(coarser, finer_edge(tile, compression));
}

std::vector<std::uint8_t> content(const TileModel& tile, const TileModel* parent,
                                  GlbCompression compression, GlbDrape drape) {
  return encode_glb(tile, {.edges = true,
                           .skirt_m = wall_depth_m(tile, parent, compression),
                           .water = true,
                           .matt = true,
                           .compression = compression,
                           .drape = std::move(drape)});
}

proto::Tile3d facts(const TileModel& tile, const TileModel* parent, bool leaf,
                    GlbCompression compression, double higher) {
  const double own = tile.certificate ? tile.certificate->max_error_m : nominal_error(tile);
  const SpaceError space = space_error(tile, compression);
  const double walls = wall_depth_m(tile, parent, compression);
  // Posts lie within `own` of the mesh, vertices below within `finer` of the posts, walls hang from
  // those, and straight triangles sag.
  const double finer = leaf ? 0 : finer_fit(tile) + finer_rounding(tile, compression);
  const double reach = leaf ? 0 : own + finer;
  const double below = leaf ? walls : reach + std::max(walls, 2 * finer_edge(tile, compression));
  const double down = space.shift_m + below;
  const Span span = heights(tile.mesh);
  const CullingVolumes& volumes = tile.volumes;
  const double rounded = compression == GlbCompression::none ? 0 : space.moved_m;
  const Vec3 point = occlusion_point(tile, reach + rounded, reach + rounded + higher);
  proto::Tile3d says;
  says.min_height = span.low - down;
  says.max_height = span.high + reach + space.moved_m + higher;
  says.sphere = {volumes.sphere_center.x, volumes.sphere_center.y, volumes.sphere_center.z,
                 volumes.sphere_radius + down + space.shift_m};
  says.horizon_occlusion = {point.x, point.y, point.z};
  says.geometric_error = std::max(own + space.shift_m, leaf ? 0 : finer_surface(tile, compression));
  return says;
}

}  // namespace tind::tiles3d
