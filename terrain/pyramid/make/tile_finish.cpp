// From a tile's mesh to all that encodings need: order, normals, culling volumes, certificate.

#include <algorithm>
#include <cmath>

#include "terrain/geo/ellipsoid.h"
#include "terrain/pyramid/make/tile_job.h"
#include "terrain/pyramid/residual/indexed_heights.h"
#include "terrain/shapes/surface_shapes.h"
#include "terrain/tile/culling.h"
#include "terrain/tile/normals.h"
#include "terrain/tile/triangle_order.h"

namespace tind {

namespace {

/// H, or where tiles of the level rest on the index, what that knows of it. By place: a tile whose
/// posts were read after all, or which has few, has the normals of its neighbours at their edges.
Result<std::vector<double>> heights_for_normals(const TileJob& job,
                                                const std::vector<Geographic>& places) {
  std::vector<double> h(places.size());
  const ResidualIndex* index = job.plan.index();
  if (!index || job.id.level >= index->level()) {
    job.field.at(places, h);
    return h;
  }
  IndexedHeights indexed(*index, job.id.level);
  std::vector<std::size_t> at[2];  // [1]: those that the index knows
  for (std::size_t i = 0; i < places.size(); ++i) at[indexed.covers(places[i])].push_back(i);
  for (const bool known : {false, true}) {
    std::vector<Geographic> some;
    for (const std::size_t i : at[known]) some.push_back(places[i]);
    std::vector<double> heights(some.size());
    known ? indexed.at(some, heights) : job.field.at(some, heights);
    for (std::size_t n = 0; n < some.size(); ++n) h[at[known][n]] = heights[n];
  }
  if (indexed.error()) return std::unexpected(*indexed.error());
  return h;
}

/// One normal per vertex, from heights that are the same for both tiles at an edge.
Result<std::vector<std::array<std::uint8_t, 2>>> normals_of(const TileJob& job, const Tin& mesh) {
  const double reach = job.level.normal_reach_deg;
  std::vector<Geographic> places;
  places.reserve(5 * mesh.vertices.size());
  for (const Vec3& v : mesh.vertices) {
    Geographic p = place_of(job.rect, v);
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

/// Has the tile numbers for the heights of all its vertices? Where not, decoders would read others.
bool holds(const HeightLattice& lattice, const Tin& mesh) {
  return std::ranges::all_of(mesh.vertices, [&](const Vec3& v) {
    return v.z >= lattice.min - lattice.step / 2 && v.z <= lattice.max() + lattice.step / 2;
  });
}

/// Are the posts what they were measured as, to the last bit?
bool plain_and_alone(const TileJob& job) {
  if (job.surface.only()) return job.surface.is_plain_geographic();
  return job.alone() && job.surface.layers()[job.windows[0].layer].source->is_plain_geographic();
}

double round_up(double x) { return std::ceil(x * 1e6) / 1e6; }

/// Upwards to four digits: of a bound that nobody calls exact, more are not worth their bytes.
double round_up_bound(double x) {
  if (!(x > 0)) return 0;
  const double unit = std::max(1e-6, std::pow(10, std::ceil(std::log10(x)) - 4));
  return std::ceil(std::ceil(x / unit) * unit * 1e6 - 1e-3) / 1e6;
}

/// For clients that display by it (3d-tiles-renderer): what clients assume of the level, or the
/// budget where that is larger. Never the measured error: a child whose figure is not below its
/// parent's is refined again and again, and what is measured does not halve from level to level.
double displayed_error(const TileJob& job) {
  return tiling::level_error(job.id.level) * std::max(1.0, job.plan.options().error_factor);
}

/// The same mesh, its triangles in coherent order and its vertices as they are first used.
Tin in_order(const Tin& mesh) {
  constexpr std::uint32_t kUnused = ~std::uint32_t(0);
  Tin ordered;
  ordered.triangles = coherent_order(mesh);
  std::vector<std::uint32_t> name(mesh.vertices.size(), kUnused);
  for (Triangle& triangle : ordered.triangles)
    for (std::uint32_t& v : triangle) {
      if (name[v] == kUnused) {
        name[v] = std::uint32_t(ordered.vertices.size());
        ordered.vertices.push_back(mesh.vertices[v]);
      }
      v = name[v];
    }
  return ordered;
}

CullingVolumes volumes_of(const TileJob& job, const Tin& mesh) {
  std::vector<Vec3> places;
  places.reserve(mesh.vertices.size());
  for (const Vec3& v : mesh.vertices) {
    const Geographic p = place_of(job.rect, v);
    places.push_back({p.lon, p.lat, v.z});
  }
  return culling_volumes(job.rect, places);
}

}  // namespace

Result<TileModel> finish_tile(TileJob& job, const TileMesh& meshed) {
  const Stopwatch watch(job.cost.encoding);
  if (!holds(meshed.lattice, meshed.mesh))
    return fail(Errc::internal,
                "its heights are farther apart than it has numbers for: where some "
                "of the DEM's heights mean no data say --nodata VALUE");
  TileModel tile;
  tile.id = job.id;
  tile.mesh = in_order(meshed.mesh);
  tile.heights = meshed.lattice;
  auto normals = normals_of(job, tile.mesh);
  if (!normals) return std::unexpected(normals.error());
  tile.normals = std::move(*normals);
  tile.volumes = volumes_of(job, meshed.mesh);  // the sphere depends on the order
  TileCertificate says{
      .max_error_m = round_up(meshed.max_error),
      .edge_error_m = round_up_bound(job.edge_error_m),
      .exact = !job.lattice && job.surface.info().rounding_m == 0 && plain_and_alone(job)};
  // A tile that could not be kept on one side says so: then it is like any other.
  if (meshed.wrong_side == 0) says.side = job.plan.options().side;
  tile.certificate = says;
  tile.one_sided = job.plan.options().side != Side::both;
  tile.displayed_error_m = round_up(displayed_error(job));
  tile.posts = job.posts.posts;
  if (job.lattice) tile.residual_m = round_up(job.lattice->largest_residual());
  if (const SurfaceShapes* shapes = job.surface.shapes(); shapes && !shapes->water().empty()) {
    auto mask = water_mask(shapes->water(), job.rect);
    if (!mask) return std::unexpected(mask.error());
    tile.water_mask = std::move(*mask);
  }
  if (job.id.level % TilePlan::kAvailabilityLevels == 0)
    tile.descendants = job.plan.descendants(job.id);
  return tile;
}

}  // namespace tind
