// From a tile's mesh to its bytes.

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "proto/quantized_mesh.h"
#include "terrain/geo/ellipsoid.h"
#include "terrain/pyramid/indexed_heights.h"
#include "terrain/pyramid/tile_job.h"
#include "terrain/tile/culling.h"
#include "terrain/tile/normals.h"
#include "terrain/tile/post_warp.h"
#include "terrain/tile/triangle_order.h"

namespace tind {

namespace {

Geographic place_of(const TileJob& job, const Vec3& v) {
  const auto mix = [](double a, double b, double t) {
    return t == 0 ? a : t == kTileExtent ? b : a + t / kTileExtent * (b - a);
  };
  return {mix(job.rect.west, job.rect.east, v.x), mix(job.rect.south, job.rect.north, v.y)};
}

/// H, or where the level rests on the index, what that knows of it. By level: a tile whose posts
/// were read after all has the normals of its neighbours at their edges.
Result<std::vector<double>> heights_for_normals(const TileJob& job,
                                                const std::vector<Geographic>& places) {
  std::vector<double> h(places.size());
  if (const ResidualIndex* index = job.plan.index(); index && index->serves(job.id.level)) {
    IndexedHeights indexed(*index, job.id.level);
    indexed.at(places, h);
    if (indexed.error()) return std::unexpected(*indexed.error());
  } else {
    job.field.at(places, h);
  }
  return h;
}

/// One normal per vertex, from heights that are the same for both tiles at an edge.
Result<std::vector<std::array<std::uint8_t, 2>>> normals_of(const TileJob& job, const Tin& mesh) {
  const double reach = job.level.normal_reach_deg;
  std::vector<Geographic> places;
  places.reserve(5 * mesh.vertices.size());
  for (const Vec3& v : mesh.vertices) {
    Geographic p = place_of(job, v);
    if (p.lon == 180) p.lon = -180;  // one place, one normal
    places.push_back(p);
    places.push_back({p.lon - reach, p.lat});
    places.push_back({p.lon + reach, p.lat});
    places.push_back({p.lon, std::max(-90.0, p.lat - reach)});
    places.push_back({p.lon, std::min(90.0, p.lat + reach)});
  }
  const auto heights = heights_for_normals(job, places);
  if (!heights) return std::unexpected(heights.error());
  auto slope = [](double before, double here, double after, double metres) {
    if (metres <= 0) return 0.0;
    if (!std::isnan(before) && !std::isnan(after)) return (after - before) / (2 * metres);
    if (!std::isnan(here) && !std::isnan(after)) return (after - here) / metres;
    if (!std::isnan(here) && !std::isnan(before)) return (here - before) / metres;
    return 0.0;
  };
  std::vector<std::array<std::uint8_t, 2>> normals;
  normals.reserve(mesh.vertices.size());
  for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
    const Geographic p = places[5 * i];
    const double* at = &(*heights)[5 * i];
    const Vec2 degree = wgs84::metres_per_degree(p.lat);
    const double east = slope(at[1], at[0], at[2], reach * std::max(degree.x, 1.0));
    const double north = slope(at[3], at[0], at[4], reach * degree.y);
    normals.push_back(oct_encode(ecef_normal(p, east, north)));
  }
  return normals;
}

double round_up(double x) { return std::ceil(x * 1e6) / 1e6; }

/// Upwards to four digits: of a bound that nobody calls exact, more are not worth their bytes.
double round_up_bound(double x) {
  if (!(x > 0)) return 0;
  const double unit = std::max(1e-6, std::pow(10, std::ceil(std::log10(x)) - 4));
  return std::ceil(std::ceil(x / unit) * unit * 1e6 - 1e-3) / 1e6;
}

nlohmann::ordered_json availability(const std::vector<std::vector<proto::TileRange>>& levels) {
  nlohmann::ordered_json json = nlohmann::ordered_json::array();
  for (const auto& ranges : levels) {
    json.push_back(nlohmann::ordered_json::array());
    for (const proto::TileRange& r : ranges)
      json.back().push_back(
          {{"startX", r.start_x}, {"startY", r.start_y}, {"endX", r.end_x}, {"endY", r.end_y}});
  }
  return json;
}

}  // namespace

Result<TileBytes> encode_tile(TileJob& job, const TileMesh& meshed) {
  const Stopwatch watch(job.cost.encoding);
  proto::QuantizedMesh q;
  const HeightLattice& lattice = meshed.lattice;
  std::vector<Vec3> places;
  places.reserve(meshed.mesh.vertices.size());
  for (const Vec3& v : meshed.mesh.vertices) {
    q.u.push_back(std::uint16_t(v.x));
    q.v.push_back(std::uint16_t(v.y));
    q.h.push_back(lattice.index(v.z));
    const Geographic p = place_of(job, v);
    places.push_back({p.lon, p.lat, v.z});
  }
  q.triangles = coherent_order(meshed.mesh);
  auto normals = normals_of(job, meshed.mesh);
  if (!normals) return std::unexpected(normals.error());
  q.oct_normals = std::move(*normals);
  q.min_height = float(lattice.min);
  q.max_height = float(lattice.max());
  const CullingVolumes volumes = culling_volumes(job.rect, places);
  q.center = {volumes.center.x, volumes.center.y, volumes.center.z};
  q.bounding_sphere = {volumes.sphere_center.x, volumes.sphere_center.y, volumes.sphere_center.z,
                       volumes.sphere_radius};
  q.horizon_occlusion = {volumes.horizon_occlusion.x, volumes.horizon_occlusion.y,
                         volumes.horizon_occlusion.z};
  TileBytes tile;
  tile.max_error_m = round_up(meshed.max_error);
  tile.exact =
      !job.lattice && job.source.info().rounding_m == 0 && job.source.is_plain_geographic();
  // A tile that could not be kept on one side says so: then it is like any other.
  if (meshed.wrong_side == 0) tile.side = job.plan.options().side;
  nlohmann::ordered_json metadata;
  metadata["geometricerror"] = tile.max_error_m;
  metadata["max_error_m"] = tile.max_error_m;
  metadata["error_kind"] = tile.exact ? "exact" : "bound";
  metadata["edge_error_m"] = tile.edge_error_m = round_up_bound(job.edge_error_m);
  if (job.plan.options().side != "both") metadata["side"] = tile.side;
  metadata["posts"] = job.posts.posts;
  if (job.lattice) metadata["residual_m"] = round_up(job.lattice->largest_residual());
  if (job.id.level % TilePlan::kAvailabilityLevels == 0)
    metadata["available"] = availability(job.plan.descendants(job.id));
  q.metadata = metadata.dump();
  proto::arrange(q);
  tile.bytes = proto::encode(q);
  return tile;
}

}  // namespace tind
