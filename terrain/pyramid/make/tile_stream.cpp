// The shared collapse engine takes the tile apart; the distance to the tile as it was is cost and
// certificate at once. Heights of merged vertices float, as `bounded` has them.

#include "terrain/pyramid/make/tile_stream.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "terrain/base/power_of_two.h"
#include "terrain/encode/quantized_mesh_tile.h"
#include "terrain/mesh/halfedge_mesh.h"
#include "terrain/mesh/manifold.h"
#include "terrain/progressive/stream/least_error.h"
#include "terrain/progressive/stream/mesh_deviation.h"
#include "terrain/progressive/stream/progressive_stream.h"
#include "terrain/progressive/stream/split_recorder.h"
#include "terrain/pyramid/plan/level_plan.h"
#include "terrain/simplify/collapse/collapse_method.h"
#include "terrain/surface/post_warp.h"

namespace tind {

namespace {

using Index = HalfedgeMesh::Index;

constexpr double kFinestStep = 1.0 / 1024 / 8;  // metres
constexpr double kRounding = 1e-9;              // of a measured distance, metres
constexpr const char* kLonLat =
    R"(GEOGCRS["WGS 84",DATUM["World Geodetic System 1984",ELLIPSOID["WGS 84",6378137,298.257223563]],)"
    R"(CS[ellipsoidal,2],AXIS["longitude",east],AXIS["latitude",north],ANGLEUNIT["degree",0.0174532925199433]])";

struct Tile {
  Tin mesh;  // x = u, y = v - 32767, z on the step
  double step = 1;
  double error_m = 0;  // of the tile, and of rounding to the step
};

/// The largest power of two of which every height is a multiple; if none is, a fine one.
double height_step(const Tin& mesh, double stated) {
  const double own = stated > 0 ? std::exp2(std::round(std::log2(stated))) : 1;
  for (double step = std::max(own, kFinestStep); step >= kFinestStep; step /= 2) {
    if (std::ranges::all_of(mesh.vertices,
                            [&](const Vec3& v) { return std::fmod(v.z, step) == 0; }))
      return step;
  }
  return std::max(kFinestStep, power_of_two_at_most(stated) / 8);
}

Result<Tile> read_tile(TileId id, std::span<const std::uint8_t> bytes) {
  auto decoded = decode_tile(id, bytes);
  if (!decoded) return std::unexpected(decoded.error());
  Tile tile;
  tile.mesh = std::move(decoded->mesh);
  drop_unused_vertices(tile.mesh);  // which tiles of others may have
  for (Vec3& v : tile.mesh.vertices) v.y -= kTileExtent;
  tile.step = height_step(tile.mesh, decoded->heights.step);
  if (decoded->certificate) tile.error_m = decoded->certificate->max_error_m;
  double rounding = 0;
  for (Vec3& v : tile.mesh.vertices) {
    const double z = std::nearbyint(v.z / tile.step) * tile.step;
    rounding = std::max(rounding, std::fabs(z - v.z));
    v.z = z;
  }
  tile.error_m += rounding;
  return tile;
}

/// Vertices that stay: the border, and the level's lattice against the earth's curvature.
std::vector<bool> pinned_vertices(const HalfedgeMesh& mesh, int level) {
  const int cells = curvature_cells(level);
  const auto on_lattice = [cells](double at) {
    const double i = std::round(at * cells / kTileExtent);
    return std::round(i * kTileExtent / cells) == at;
  };
  std::vector<bool> pinned(mesh.vertex_slots(), false);
  for (Index v = 0; v < pinned.size(); ++v) {
    const Vec3& p = mesh.position(v);
    pinned[v] = mesh.on_border(v) || (on_lattice(p.x) && on_lattice(p.y + kTileExtent));
  }
  return pinned;
}

/// Where to end: at one inner vertex for six of the border. What is coarser than that is all fans
/// of slivers, and no shorter to send.
std::size_t base_triangles(const HalfedgeMesh& mesh) {
  std::size_t border = 0;
  for (Index v = 0; v < mesh.vertex_slots(); ++v) border += mesh.on_border(v);
  if (border < 3) return mesh.triangle_count();  // closed: no tile of ours
  return border - 2 + 2 * (border / 6);
}

/// Merges at one end, at the height for which the star is least far from the tile.
class DeviationCost {
 public:
  static constexpr bool kOnlyGrows = true;

  DeviationCost(MeshDeviation& tile, std::vector<bool> pinned, double step)
      : tile_(tile), pinned_(std::move(pinned)), step_(step) {}

  Proposal propose(const HalfedgeMesh& m, Index h) {
    const Index a = m.origin(h), b = m.dest(h);
    if (pinned_[a] && pinned_[b]) return {};
    if (pinned_[a]) return at_end(m, h, a);
    if (pinned_[b]) return at_end(m, h, b);
    const Proposal p = at_end(m, h, a), q = at_end(m, h, b);
    return p.cost < q.cost ? p : q;
  }

  void merge(const HalfedgeMesh& m, Index h, const Vec3&) {
    if (pinned_[m.origin(h)]) pinned_[m.dest(h)] = true;
  }

 private:
  MeshDeviation& tile_;
  std::vector<bool> pinned_;
  double step_;
  LeastHeightError fit_;

  Proposal at_end(const HalfedgeMesh& m, Index h, Index end) {
    Vec3 at = m.position(end);
    if (!star_stays_ccw(m, h, at)) return {};
    fit_.clear();
    m.for_each_kept(h,
                    [&](Index e) { add_face(at, m.position(m.dest(e)), m.position(m.apex(e))); });
    if (!pinned_[end]) at.z = std::nearbyint(fit_.best(at.z).z / step_) * step_;
    return {float(fit_.error_at(at.z)), at};
  }

  /// The far side p q stays as it is, and the other side is the next face's: a spoke on the border
  /// is the tile's own edge. (Without the crossings errors come out two to four times as large.)
  void add_face(const Vec3& at, const Vec3& p, const Vec3& q) {
    const double scale = 1 / orient2d(at, p, q);
    tile_.each_vertex(at, p, q, [&](const Vec3& v) {
      const double wp = orient2d(v, q, at) * scale, wq = orient2d(v, at, p) * scale;
      fit_.add(1 - wp - wq, v.z - (wp * p.z + wq * q.z));
    });
    tile_.each_crossing(
        at, p, [&](const Vec3& v, double share) { fit_.add(1 - share, v.z - share * p.z); });
  }
};

/// The tile's own error and the distance to the tile bound the distance to every post.
class DeviationMeasure {
 public:
  DeviationMeasure(MeshDeviation& tile, double tile_error_m)
      : tile_(tile), tile_error_m_(tile_error_m) {}

  bool other_way(const HalfedgeMesh& m, const Collapse& c) const {
    return other_way_from_above(m, c);
  }
  double fine(const HalfedgeMesh&) const { return tile_error_m_; }
  double after(const HalfedgeMesh& m, const Collapse& c) {
    double worst = 0;
    m.for_each_kept(c.edge, [&](Index e) {
      const Vec3 &p = m.position(m.dest(e)), &q = m.position(m.apex(e));
      worst = std::max(worst, tile_.of(c.kept_after, p, q));
    });
    return worst > 0 ? tile_error_m_ + worst + kRounding : tile_error_m_;
  }

 private:
  MeshDeviation& tile_;
  double tile_error_m_;
};

DemInfo frame_of(TileId id, const VerticalDatum& datum) {
  const GeoRect rect = tiling::rect(id);
  DemInfo info;
  info.cols = info.rows = kTileExtent + 1;
  info.post_to_crs = {rect.west, rect.width() / kTileExtent,  0, rect.north,
                      0,         -rect.height() / kTileExtent};
  info.datum = datum;
  info.crs_name = "WGS 84";
  info.crs_wkt = kLonLat;
  return info;
}

Result<proto::MeshStream> make(TileId id, std::span<const std::uint8_t> bytes,
                               const VerticalDatum& datum, std::stop_token stop) {
  const auto tile = read_tile(id, bytes);
  if (!tile) return std::unexpected(tile.error());
  auto mesh = HalfedgeMesh::from_tin(tile->mesh);
  if (!mesh) return std::unexpected(mesh.error());
  for (const Triangle& t : tile->mesh.triangles) {
    const auto& v = tile->mesh.vertices;
    if (orient2d(v[t[0]], v[t[1]], v[t[2]]) <= 0)
      return fail(Errc::bad_data, "a triangle is not counter-clockwise");
  }
  MeshDeviation deviation(tile->mesh);
  DeviationCost cost(deviation, pinned_vertices(*mesh, id.level), tile->step);
  DeviationMeasure measure(deviation, tile->error_m);
  NoFlip filter;
  const Lattice lattice{1, tile->step};
  SplitRecorder splits(measure, lattice, base_triangles(*mesh));
  const CollapseRun run =
      record_collapses(*mesh, cost, filter, splits, {.report = {}, .stop = std::move(stop)});
  if (run.cancelled) return fail(Errc::cancelled, "stopped");
  return to_stream(splits.mesh, lattice, frame_of(id, datum));
}

}  // namespace

Result<proto::MeshStream> tile_stream(TileId id, std::span<const std::uint8_t> tile,
                                      const VerticalDatum& datum, std::stop_token stop) {
  auto made = make(id, tile, datum, std::move(stop));
  if (!made) return fail("tile " + id.text(), made.error());
  return made;
}

}  // namespace tind
