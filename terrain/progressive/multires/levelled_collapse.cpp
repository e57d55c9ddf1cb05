// Each round: pick the threshold below which the cheapest share of the vertices lies, look again at
// those below it whose surroundings have changed (in parallel: this only reads), then walk them in
// the order of the grid and collapse each that has no neighbour collapsed in this round.
//
// A vertex's last known cost is a good guess of its cost now, and nearly always too low: so a
// vertex is looked at again only when that guess brings it below the threshold.

#include "terrain/progressive/multires/levelled_collapse.h"

#include <algorithm>
#include <limits>

#include "terrain/base/parallel.h"
#include "terrain/progressive/multires/post_error.h"
#include "terrain/simplify/collapse/collapse_engine.h"
#include "terrain/simplify/common/terrain_mesh.h"

namespace tind {

namespace {

using Index = HalfedgeMesh::Index;

constexpr int kMostDegree = 12;  // of a vertex that goes
constexpr float kTooDear = std::numeric_limits<float>::infinity();
/// Metres of error that a metre of the longest edge counts as: long edges lose ties, and flat land
/// does not end in needles.
constexpr double kLengthCost = 2e-4;

class Rounds {
 public:
  Rounds(TerrainMesh& terrain, const Terrain& dem, const LevelledOptions& options)
      : terrain_(terrain),
        mesh_(terrain.mesh),
        grid_(dem.grid),
        options_(options),
        builder_(mesh_, dem),
        vertices_(mesh_.vertex_slots()) {
    for (Index v = 0; v < mesh_.vertex_slots(); ++v)
      if (mesh_.alive_vertex(v) && terrain.kind[v] != VertexKind::fixed) alive_.push_back(v);
  }

  Result<MultiTriangulation> run(const Progress& progress) {
    const std::size_t start = mesh_.triangle_count();
    double share = options_.share;
    while (mesh_.triangle_count() > options_.base_triangles && !alive_.empty()) {
      if (progress.stopped()) return fail(Errc::cancelled, "refinement was stopped");
      progress.at(double(start - mesh_.triangle_count()) / double(start));
      if (round(share) > 0)
        share = options_.share;
      else if (share < 1)
        share = 1;
      else
        break;
    }
    return builder_.finish();
  }

 private:
  struct Vertex {
    float cost = 0;           // as last seen
    Index target = 0;         // the half-edge to collapse
    std::uint32_t round = 0;  // in which something next to it was collapsed
    bool fresh = false;       // cost and target are of the mesh as it is
  };

  double length(const Vec3& a, const Vec3& b) const {
    const double x = (a.x - b.x) * terrain_.metres_x, y = (a.y - b.y) * terrain_.metres_y;
    return std::sqrt(x * x + y * y);
  }

  bool may_collapse(Index h) const {
    const Merge rule = merge_rule(terrain_, h);
    return rule != Merge::never && rule != Merge::at_origin;
  }

  /// The cost of the star that collapsing h leaves; kTooDear beyond `best`, or where it would flip.
  double cost_of(Index v, Index h, double best) const {
    const Vec3& at = mesh_.position(mesh_.dest(h));
    double error = 0, longest = 0;
    const bool fits = mesh_.all_kept(v, h, [&](Index e) {
      const Vec3 &b = mesh_.position(mesh_.dest(e)), &c = mesh_.position(mesh_.apex(e));
      longest = std::max({longest, length(at, b), length(at, c)});
      if (!surely_ccw(at, b, c)) return false;
      const double limit = best - kLengthCost * longest;
      error = std::max(error, worst_post(grid_, at, b, c, limit));
      return error <= limit;
    });
    return fits ? error + kLengthCost * longest : kTooDear;
  }

  void look_at(Index v) {
    Vertex& vertex = vertices_[v];
    vertex.fresh = true;
    vertex.cost = kTooDear;
    if (mesh_.degree(v) > kMostDegree) return;
    double best = kTooDear;
    mesh_.for_each_out(v, [&](Index h) {
      if (!may_collapse(h)) return;
      const double cost = cost_of(v, h, best);
      if (cost >= best || !collapse_keeps_manifold(mesh_, h)) return;
      best = cost;
      vertex.target = h;
    });
    vertex.cost = float(best);
  }

  float threshold(double share) {
    costs_.clear();
    for (const Index v : alive_)
      if (vertices_[v].cost < kTooDear) costs_.push_back(vertices_[v].cost);
    if (costs_.empty()) return -1;
    const auto nth = costs_.begin() + std::ptrdiff_t(share * double(costs_.size() - 1));
    std::nth_element(costs_.begin(), nth, costs_.end());
    return *nth;
  }

  void look_again_below(float limit) {
    stale_.clear();
    for (const Index v : alive_)
      if (!vertices_[v].fresh && vertices_[v].cost <= limit) stale_.push_back(v);
    constexpr std::size_t kChunk = 4096;
    parallel_for((stale_.size() + kChunk - 1) / kChunk, options_.threads, [&](std::size_t i) {
      const std::size_t end = std::min(stale_.size(), (i + 1) * kChunk);
      for (std::size_t k = i * kChunk; k < end; ++k) look_at(stale_[k]);
    });
  }

  /// The number of collapses made.
  std::size_t round(double share) {
    ++round_;
    const bool first = round_ == 1;
    const float limit = first ? 0 : threshold(share);
    look_again_below(limit);
    const float now = first ? threshold(share) : limit;
    std::size_t collapses = 0, kept = 0;
    for (const Index v : alive_) {
      const bool goes = vertices_[v].cost <= now && vertices_[v].round != round_ &&
                        mesh_.triangle_count() > options_.base_triangles && collapse(v);
      collapses += goes;
      if (!goes) alive_[kept++] = v;
    }
    alive_.resize(kept);
    return collapses;
  }

  bool collapse(Index v) {
    const Vertex& vertex = vertices_[v];
    const Index h = vertex.target, into = mesh_.dest(h);
    // What lies beyond the star may have changed in this round: the topology, never the error.
    if (!vertex.fresh || !collapse_keeps_manifold(mesh_, h)) return false;
    const auto touch = [&](Index other) {
      vertices_[other].round = round_;
      vertices_[other].fresh = false;
      if (vertices_[other].cost == kTooDear) vertices_[other].cost = 0;  // may be possible now
    };
    mesh_.for_each_out(v, [&](Index e) { touch(mesh_.dest(e)), touch(mesh_.apex(e)); });
    if (!builder_.collapse(h, mesh_.position(into))) return false;
    terrain_.kind[into] = merged_kind(terrain_.kind[v], terrain_.kind[into]);
    return true;
  }

  TerrainMesh& terrain_;
  HalfedgeMesh& mesh_;
  const HeightGrid& grid_;
  const LevelledOptions& options_;
  MultiTriangulationBuilder builder_;
  std::vector<Vertex> vertices_;
  std::vector<Index> alive_, stale_;
  std::vector<float> costs_;
  std::uint32_t round_ = 0;
};

}  // namespace

Result<MultiTriangulation> levelled_terrain(const Terrain& dem, const LevelledOptions& options,
                                            const Progress& progress) {
  if (dem.grid.size() > MultiTriangulationBuilder::kMostNodes)
    return fail(Errc::out_of_range, "too many posts to refine at once: cut the DEM into parts");
  Result<TerrainMesh> terrain = terrain_mesh(dem);
  if (!terrain) return std::unexpected(terrain.error());
  return Rounds(*terrain, dem, options).run(progress);
}

}  // namespace tind
