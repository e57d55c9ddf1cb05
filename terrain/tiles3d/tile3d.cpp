#include "terrain/tiles3d/tile3d.h"

#include <algorithm>

#include "terrain/encode/glb_tile.h"
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
/// at most its nominal error.)
double finer_fit(const TileModel& tile) {
  return std::min(nominal_error(tile) / 2, kLargestError_m);
}
/// What drawing it straight through space adds to that: a quarter of its level's error over a
/// border (plan/level_plan.h, curvature_cells), half of it over the surface.
double finer_edge(const TileModel& tile) { return finer_fit(tile) + nominal_error(tile) / 8; }
double finer_surface(const TileModel& tile) { return finer_fit(tile) + nominal_error(tile) / 4; }

/// Of its border as it is drawn, vertically, from that of the DEM with its voids filled.
double edge_error(const TileModel& tile) {
  return tile.certificate->edge_error_m + space_error(tile).edge_m;
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

double wall_depth_m(const TileModel& tile, const TileModel* parent) {
  if (!tile.certificate) return 5 * nominal_error(tile);
  const double coarser = parent && parent->certificate ? edge_error(*parent) : 0;
  return edge_error(tile) + std::max(coarser, finer_edge(tile));
}

std::vector<std::uint8_t> content(const TileModel& tile, const TileModel* parent) {
  return encode_glb(
      tile, {.edges = true, .skirt_m = wall_depth_m(tile, parent), .water = true, .matt = true});
}

proto::Tile3d facts(const TileModel& tile, const TileModel* parent, bool leaf) {
  const double own = tile.certificate ? tile.certificate->max_error_m : nominal_error(tile);
  const SpaceError space = space_error(tile);
  const double walls = wall_depth_m(tile, parent);
  // Posts lie within `own` of the mesh, vertices below within `finer` of the posts, walls hang from
  // those, and straight triangles sag.
  const double finer = leaf ? 0 : finer_fit(tile);
  const double reach = leaf ? 0 : own + finer;
  const double down =
      space.shift_m + (leaf ? walls : reach + std::max(walls, 2 * finer_edge(tile)));
  const Span span = heights(tile.mesh);
  const CullingVolumes& volumes = tile.volumes;
  const Vec3 point = occlusion_point(tile, reach, reach);
  proto::Tile3d says;
  says.min_height = span.low - down;
  says.max_height = span.high + reach + space.moved_m;
  says.sphere = {volumes.sphere_center.x, volumes.sphere_center.y, volumes.sphere_center.z,
                 volumes.sphere_radius + down + space.shift_m};
  says.horizon_occlusion = {point.x, point.y, point.z};
  says.geometric_error = std::max(own + space.shift_m, leaf ? 0 : finer_surface(tile));
  return says;
}

}  // namespace tind::tiles3d
