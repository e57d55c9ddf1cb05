#include "terrain/simplify/constraints/constrained_mesh.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <unordered_set>

#include "terrain/base/keyed_hash.h"
#include "terrain/mesh/exact_line.h"
#include "terrain/mesh/manifold.h"
#include "terrain/simplify/constraints/cell_cover.h"
#include "terrain/simplify/constraints/constraint_heights.h"
#include "terrain/simplify/constraints/voids.h"

namespace tind {

namespace {

using Index = std::uint32_t;

class ConstrainedMesher {
 public:
  ConstrainedMesher(const HeightGrid& grid, const ConstraintNetwork& net, Constraints& out)
      : grid_(grid), net_(net), out_(out), cols_(grid.cols()), rows_(grid.rows()), cells_(grid) {}

  Result<void> run() {
    const auto made = make_mesh();
    if (made) keep_parts();
    return made;
  }

 private:
  const HeightGrid& grid_;  // as it was given
  const ConstraintNetwork& net_;
  Constraints& out_;
  const int cols_, rows_;
  CellCover cells_;

  Index post(int c, int r) const {
    return Index(std::size_t(r) * std::size_t(cols_) + std::size_t(c));
  }

  Result<void> make_mesh() {
    Tin& mesh = out_.mesh;
    for (int r = 0; r < rows_; ++r)
      for (int c = 0; c < cols_; ++c)
        mesh.vertices.push_back({double(c), -double(r), double(out_.dem.grid.at(c, r))});
    if (const auto ok = triangulate_near_lines(); !ok) return ok;
    for (int r = 0; r + 1 < rows_; ++r)
      for (int c = 0; c + 1 < cols_; ++c)
        if (!cells_.marked(c, r)) add_cell(c, r);
    if (mesh.triangles.empty()) {
      if (std::ranges::all_of(grid_.values(), [](float z) { return std::isnan(z); }))
        return std::unexpected(no_triangle(grid_));
      return fail(Errc::bad_data, "nothing of the DEM is left inside the boundary");
    }
    const std::size_t before = mesh.vertices.size();
    make_manifold(mesh);
    out_.hold.resize(mesh.vertices.size(), Constraints::stays);
    if (mesh.vertices.size() > before) hold_copies(before);
    return {};
  }

  /// Where fans meet in one vertex, that is two now: neither may move.
  void hold_copies(std::size_t before) {
    std::map<std::pair<double, double>, int> copied;
    for (std::size_t v = before; v < out_.mesh.vertices.size(); ++v)
      copied[{out_.mesh.vertices[v].x, out_.mesh.vertices[v].y}] = 1;
    for (std::size_t v = 0; v < before; ++v)
      if (copied.contains({out_.mesh.vertices[v].x, out_.mesh.vertices[v].y}))
        out_.hold[v] = Constraints::stays;
  }

  void add_cell(int c, int r) {
    const auto is = [&](int dc, int dr) { return !out_.dem.grid.is_void(c + dc, r + dr); };
    const Index nw = post(c, r), ne = post(c + 1, r), sw = post(c, r + 1), se = post(c + 1, r + 1);
    auto& out = out_.mesh.triangles;
    if (is(0, 0) && is(0, 1) && is(1, 0)) out.push_back({nw, sw, ne});
    if (is(1, 1) && is(1, 0) && is(0, 1)) out.push_back({se, ne, sw});
    if (!is(1, 0) && is(0, 0) && is(0, 1) && is(1, 1)) out.push_back({nw, sw, se});
    if (!is(0, 1) && is(0, 0) && is(1, 0) && is(1, 1)) out.push_back({nw, se, ne});
  }

  /// The triangulation of the marked cells; points are given to it with their vertex of the mesh.
  Result<void> triangulate_near_lines() {
    Tin& mesh = out_.mesh;
    out_.hold.assign(mesh.vertices.size(), Constraints::loose);
    const auto [line_vertex, chains] = enter_lines();
    const std::vector<std::uint8_t> left_out = posts_too_near();
    for (Index v = 0; v < left_out.size(); ++v)
      if (left_out[v]) out_.beside.push_back(v);
    std::vector<Vec3> points;
    std::vector<Index> vertex, place(mesh.vertices.size(), PolygonSet::kNone);
    const auto enter = [&](Index v) {
      if (place[v] != PolygonSet::kNone) return;
      place[v] = Index(points.size());
      points.push_back(mesh.vertices[v]);
      vertex.push_back(v);
    };
    for (int r = 0; r < rows_; ++r)
      for (int c = 0; c < cols_; ++c)
        if (cells_.valid(c, r) && cells_.at_marked(c, r) && !left_out[post(c, r)])
          enter(post(c, r));
    std::vector<std::array<Index, 2>> edges;
    for (const std::vector<Index>& chain : chains) {
      for (const Index v : chain) enter(v);
      for (std::size_t k = 1; k < chain.size(); ++k)
        edges.push_back({place[chain[k - 1]], place[chain[k]]});
    }
    cells_.for_each_rim([&](const auto& p, const auto& q) {
      enter(post(p[0], p[1])), enter(post(q[0], q[1]));
      edges.push_back({place[post(p[0], p[1])], place[post(q[0], q[1])]});
    });
    const auto triangles = triangulate(points, edges);
    if (!triangles) return std::unexpected(triangles.error());
    for (std::size_t i = vertex.size(); i < points.size(); ++i) {
      vertex.push_back(Index(mesh.vertices.size()));
      mesh.vertices.push_back(
          {points[i].x, points[i].y, height_between_posts(grid_, points[i].x, points[i].y)});
      out_.hold.push_back(Constraints::stays);
    }
    for (const Triangle& t : *triangles) {
      const Triangle v = {vertex[t[0]], vertex[t[1]], vertex[t[2]]};
      if (belongs(v)) mesh.triangles.push_back(v);
    }
    return {};
  }

  /// Gives the network its vertices in the mesh (posts are their own) and marks the cells around.
  std::pair<std::vector<Index>, std::vector<std::vector<Index>>> enter_lines() {
    Tin& mesh = out_.mesh;
    const auto vertex_of = [&](const Vec3& p, Constraints::Hold hold) {
      const bool is_post =
          p.x == std::floor(p.x) && p.y == std::floor(p.y) && cells_.valid(int(p.x), int(-p.y));
      if (!is_post) mesh.vertices.push_back(p), out_.hold.push_back(hold);
      const Index v = is_post ? post(int(p.x), int(-p.y)) : Index(mesh.vertices.size() - 1);
      if (is_post) {
        if (!std::isnan(mesh.vertices[v].z)) mesh.vertices[v].z = p.z;
        out_.hold[v] = hold;
      }
      return v;
    };
    std::vector<Index> of(net_.points.size(), PolygonSet::kNone);
    std::vector<std::vector<Index>> chains;
    for (const NetworkPart& part : net_.parts) {
      for (const Index p : {part.a, part.b})
        if (of[p] == PolygonSet::kNone) of[p] = vertex_of(net_.points[p], Constraints::stays);
      std::vector<Index> chain = {of[part.a]};
      for (const Vec3& p : part.inner)
        if (!std::isnan(p.z)) chain.push_back(vertex_of(p, Constraints::slides));
      chain.push_back(of[part.b]);
      for (std::size_t k = 1; k < chain.size(); ++k)
        cells_.mark_along(mesh.vertices[chain[k - 1]], mesh.vertices[chain[k]], 1);
      if (part.line) {
        LinePart kept{of[part.a], of[part.b], out_.inner.size(), 0};
        out_.inner.insert(out_.inner.end(), chain.begin() + 1, chain.end() - 1);
        kept.last = out_.inner.size();
        out_.parts.push_back(kept);
      }
      chains.push_back(std::move(chain));
    }
    return {std::move(of), std::move(chains)};
  }

  /// Posts within the tolerance of a line but not on it: as vertices they would make needles.
  std::vector<std::uint8_t> posts_too_near() const {
    std::vector<std::uint8_t> left_out(grid_.size(), 0);
    for (const NetworkPart& part : net_.parts) {
      const Vec3 &a = net_.points[part.a], &b = net_.points[part.b];
      const double l = std::sqrt(squared_xy(a, b));
      const bool wide = std::abs(b.x - a.x) >= std::abs(b.y - a.y);
      const double lo = wide ? std::min(a.x, b.x) : std::min(a.y, b.y);
      const double hi = wide ? std::max(a.x, b.x) : std::max(a.y, b.y);
      for (double k = std::ceil(lo - kLineTolerance); k <= hi + kLineTolerance; ++k) {
        const double t =
            std::clamp(wide ? (k - a.x) / (b.x - a.x) : (k - a.y) / (b.y - a.y), 0.0, 1.0);
        const double other = std::nearbyint(wide ? a.y + t * (b.y - a.y) : a.x + t * (b.x - a.x));
        const Vec3 p = wide ? Vec3{k, other, 0} : Vec3{other, k, 0};
        const int c = int(p.x), r = int(-p.y);
        if (c <= 0 || r <= 0 || c >= cols_ - 1 || r >= rows_ - 1) continue;  // sides stay whole
        if ((p.x == a.x && p.y == a.y) || (p.x == b.x && p.y == b.y) || on_segment(a, b, p))
          continue;
        const bool beside = between(a, b, p) && std::abs(orient2d(a, b, p)) / l <= kLineTolerance;
        const double near2 = std::min(squared_xy(a, p), squared_xy(b, p));
        left_out[post(c, r)] |= beside || near2 <= kLineTolerance * kLineTolerance;
      }
    }
    return left_out;
  }

  /// Of the DEM, and inside the boundary?
  bool belongs(const Triangle& t) const {
    const auto& v = out_.mesh.vertices;
    const Vec3 m = (v[t[0]] + v[t[1]] + v[t[2]]) * (1.0 / 3);
    if (!cells_.covers(m)) return false;
    return net_.boundary.size() == 0 || net_.boundary.holding(m.x, m.y) != PolygonSet::kNone;
  }

  // --- what holds ------------------------------------------------------------------------------

  /// Puts aside the parts that no triangle has as its edge.
  void keep_parts() {
    Tin& mesh = out_.mesh;
    std::unordered_set<std::uint64_t, KeyedHash> edges;
    const auto key = [](Index a, Index b) {
      return std::uint64_t(std::min(a, b)) << 32 | std::max(a, b);
    };
    for (const Triangle& t : mesh.triangles)
      for (int k = 0; k < 3; ++k) {
        const Index a = t[std::size_t(k)], b = t[std::size_t(k + 1) % 3];
        if (out_.hold[a] != Constraints::loose && out_.hold[b] != Constraints::loose)
          edges.insert(key(a, b));
      }
    std::vector<LinePart> kept;
    for (const LinePart& part : out_.parts) {
      const Index next = part.first < part.last ? out_.inner[part.first] : part.b;
      if (!edges.contains(key(part.a, next))) {
        out_.elsewhere.push_back(part);
        continue;
      }
      kept.push_back(part);
    }
    out_.parts = std::move(kept);
    out_.report.outside += out_.elsewhere.size();
    out_.report.parts = out_.parts.size();
  }
};

}  // namespace

Result<void> make_constrained_mesh(const HeightGrid& grid, const ConstraintNetwork& net,
                                   Constraints& out) {
  return ConstrainedMesher(grid, net, out).run();
}

}  // namespace tind
