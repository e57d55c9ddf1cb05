#include "terrain/simplify/coarse_constrained.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "terrain/mesh/constrained_delaunay.h"
#include "terrain/mesh/manifold.h"

namespace tind {

namespace {

using Index = std::uint32_t;
constexpr Index kNone = HalfedgeMesh::kNone;
using Pair = std::pair<Index, Index>;

Pair ordered(Index a, Index b) { return {std::min(a, b), std::max(a, b)}; }

class Starter {
 public:
  explicit Starter(const Constraints& constraints)
      : from_(constraints), place_(constraints.mesh.vertices.size(), kNone) {}

  Result<CoarseConstrained> run() {
    const auto& heights = from_.grid.values();
    const auto valid = std::ranges::find_if(heights, [](float z) { return !std::isnan(z); });
    if (valid == heights.end())
      return fail(Errc::bad_data, "the grid holds no valid height at all");
    any_height_ = *valid;
    enter_points();
    if (const auto ok = triangulate_points(); !ok) return std::unexpected(ok.error());
    return sew_lines();
  }

 private:
  const Constraints& from_;
  double any_height_ = 0;
  std::vector<Index> place_;  // of each vertex of the full mesh: its point
  Tin tin_;
  std::vector<std::array<Index, 2>> edges_;
  CoarseConstrained out_;

  Index enter(Index v) {
    if (place_[v] == kNone) {
      place_[v] = Index(tin_.vertices.size());
      Vec3 p = from_.mesh.vertices[v];
      if (std::isnan(p.z)) p.z = any_height_;  // in a void: nothing is asked of it
      tin_.vertices.push_back(p);
    }
    return place_[v];
  }

  void enter_points() {
    for (const auto* parts : {&from_.parts, &from_.elsewhere})
      for (const LinePart& part : *parts) edges_.push_back({enter(part.a), enter(part.b)});
    const int cols = from_.grid.cols(), rows = from_.grid.rows();
    for (const auto& [c, r] : {std::pair{0, rows - 1}, {cols - 1, rows - 1}, {cols - 1, 0}, {0, 0}})
      enter(Index(r) * Index(cols) + Index(c));
  }

  Result<void> triangulate_points() {
    auto triangles = triangulate(tin_.vertices, edges_);
    if (!triangles) return std::unexpected(triangles.error());
    for (Vec3& p : tin_.vertices)
      if (std::isnan(p.z)) p.z = any_height_;
    const auto& v = tin_.vertices;
    for (const Triangle& t : *triangles) {
      const Vec3 m = (v[t[0]] + v[t[1]] + v[t[2]]) * (1.0 / 3);
      if (from_.boundary.size() > 0 && from_.boundary.holding(m.x, m.y) == PolygonSet::kNone)
        continue;
      if (!surely_ccw(v[t[0]], v[t[1]], v[t[2]])) {
        return fail(Errc::bad_data,
                    "lines leave a triangle without room near column " + std::to_string(m.x) +
                        ", row " + std::to_string(-m.y) +
                        ": thin them out there, or choose a method that thins the full mesh");
      }
      tin_.triangles.push_back(t);
    }
    return {};
  }

  /// Where fans meet, points become several; each line goes with the triangles that have it.
  Result<CoarseConstrained> sew_lines() {
    const std::vector<Triangle> before = tin_.triangles;
    make_manifold(tin_);
    std::map<Pair, Pair> now;
    for (const auto& [a, b] : edges_) now[ordered(a, b)] = {kNone, kNone};
    for (std::size_t t = 0; t < before.size(); ++t) {
      for (std::size_t k = 0; k < 3; ++k) {
        const std::size_t l = (k + 1) % 3;
        Index a = before[t][k], b = before[t][l], u = tin_.triangles[t][k],
              w = tin_.triangles[t][l];
        if (a > b) std::swap(a, b), std::swap(u, w);
        if (const auto edge = now.find({a, b}); edge != now.end()) edge->second = {u, w};
      }
    }
    for (const LinePart& part : from_.parts) {
      const Index a = place_[part.a], b = place_[part.b];
      auto [u, w] = now.at(ordered(a, b));
      if (u == kNone) return fail(Errc::internal, "lines cross that were repaired");
      if (a > b) std::swap(u, w);
      std::vector<Vec3> inner;
      for (std::size_t i = part.first; i < part.last; ++i)
        inner.push_back(from_.mesh.vertices[from_.inner[i]]);
      out_.lines.add_line(u, w, std::move(inner));
    }
    for (const LinePart& part : from_.elsewhere) {
      const auto [u, w] = now.at(ordered(place_[part.a], place_[part.b]));
      if (u != kNone) out_.lines.add_edge(u, w);
    }
    out_.lines.index_points();
    auto mesh = HalfedgeMesh::from_tin(tin_);
    if (!mesh) return fail("the coarsest mesh with lines", mesh.error());
    out_.mesh = std::move(*mesh);
    leave_out_posts();
    return std::move(out_);
  }

  void leave_out_posts() {
    out_.posts = from_.grid;
    const auto leave_out = [&](Index v) {
      if (v < out_.posts.size()) out_.posts.values()[v] = HeightGrid::kVoid;
    };
    for (const LinePart& part : from_.parts) leave_out(part.a), leave_out(part.b);
    for (const Index v : from_.inner) leave_out(v);
    for (const Index v : from_.beside) leave_out(v);
  }
};

}  // namespace

Result<CoarseConstrained> coarse_constrained(const Constraints& constraints) {
  return Starter(constraints).run();
}

}  // namespace tind
