#include "terrain/simplify/insertion/coarse_constrained.h"

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

/// In a void nothing is asked of a height; it must only be one.
Result<double> any_height(const HeightGrid& grid) {
  const auto valid = std::ranges::find_if(grid.values(), [](float z) { return !std::isnan(z); });
  if (valid == grid.values().end())
    return fail(Errc::bad_data, "the grid holds no valid height at all");
  return *valid;
}

class Triangulator {
 public:
  Triangulator(const Constraints& constraints, double height_in_voids)
      : from_(constraints),
        height_in_voids_(height_in_voids),
        place_(constraints.mesh.vertices.size(), kNone) {}

  Result<TriangulatedLines> run(std::span<const LineChain> chains, std::span<const Vec3> points) {
    for (const LineChain& chain : chains)
      for (std::size_t k = 1; k < chain.size(); ++k)
        edges_.push_back({enter(chain[k - 1]), enter(chain[k])});
    const int cols = from_.dem.grid.cols(), rows = from_.dem.grid.rows();
    for (const auto& [c, r] : {std::pair{0, rows - 1}, {cols - 1, rows - 1}, {cols - 1, 0}, {0, 0}})
      enter(Index(r) * Index(cols) + Index(c));
    of_lines_ = entered_.size();
    entered_.insert(entered_.end(), points.begin(), points.end());
    for (bool thin = true; thin;) {
      const auto found = triangulate_entered();
      if (!found) return std::unexpected(found.error());
      thin = *found;
    }
    return sew();
  }

 private:
  const Constraints& from_;
  const double height_in_voids_;
  std::vector<Index> place_;  // of each vertex of the full mesh: its point
  std::vector<Vec3> entered_;
  std::size_t of_lines_ = 0;  // entered_ begins with so many that must stay
  std::vector<std::array<Index, 2>> edges_;
  Tin tin_;

  Index enter(Index v) {
    if (place_[v] == kNone) {
      place_[v] = Index(entered_.size());
      entered_.push_back(from_.mesh.vertices[v]);
    }
    return place_[v];
  }

  /// True when points had to go because of triangles that are too thin.
  Result<bool> triangulate_entered() {
    tin_ = {};
    tin_.vertices = entered_;
    auto triangles = triangulate(tin_.vertices, edges_);
    if (!triangles) return std::unexpected(triangles.error());
    for (Vec3& p : tin_.vertices)
      if (std::isnan(p.z)) p.z = height_in_voids_;
    std::vector<Index> thin;
    const auto& v = tin_.vertices;
    for (const Triangle& t : *triangles) {
      const Vec3 m = (v[t[0]] + v[t[1]] + v[t[2]]) * (1.0 / 3);
      if (from_.boundary.size() > 0 && from_.boundary.holding(m.x, m.y) == PolygonSet::kNone)
        continue;
      tin_.triangles.push_back(t);
      if (surely_ccw(v[t[0]], v[t[1]], v[t[2]])) continue;
      const Index last = std::max({t[0], t[1], t[2]});  // points come after lines
      if (last < of_lines_ || last >= entered_.size()) {
        return fail(Errc::bad_data,
                    "lines leave a triangle without room near column " + std::to_string(m.x) +
                        ", row " + std::to_string(-m.y) +
                        ": thin them out there, or choose a method that thins the full mesh");
      }
      thin.push_back(last);
    }
    std::sort(thin.begin(), thin.end());
    thin.erase(std::unique(thin.begin(), thin.end()), thin.end());
    for (auto k = thin.rbegin(); k != thin.rend(); ++k)
      entered_.erase(entered_.begin() + std::ptrdiff_t(*k));
    return !thin.empty();
  }

  /// Where fans meet, points become several; each line goes with the triangles that have it.
  TriangulatedLines sew() {
    const std::vector<Triangle> before = tin_.triangles;
    make_manifold(tin_);
    std::map<Pair, Pair> now;
    for (const auto& [a, b] : edges_) now[ordered(a, b)] = {kNone, kNone};
    for (std::size_t t = 0; t < before.size(); ++t) {
      for (std::size_t k = 0; k < 3; ++k) {
        const std::size_t l = (k + 1) % 3;
        Pair edge = {before[t][k], before[t][l]}, as = {tin_.triangles[t][k], tin_.triangles[t][l]};
        if (edge.first > edge.second)
          std::swap(edge.first, edge.second), std::swap(as.first, as.second);
        if (const auto there = now.find(edge); there != now.end()) there->second = as;
      }
    }
    TriangulatedLines out;
    for (const auto& [a, b] : edges_) {
      const auto [u, w] = now.at(ordered(a, b));
      out.edges.push_back(a < b ? std::array{u, w} : std::array{w, u});
    }
    out.tin = std::move(tin_);
    return out;
  }
};

HeightGrid posts_off_lines(const Constraints& constraints) {
  HeightGrid posts = constraints.dem.grid;
  const auto leave_out = [&](Index v) {
    if (v < posts.size()) posts.values()[v] = HeightGrid::kVoid;
  };
  for (const LinePart& part : constraints.parts) leave_out(part.a), leave_out(part.b);
  for (const Index v : constraints.inner) leave_out(v);
  for (const Index v : constraints.beside) leave_out(v);
  return posts;
}

}  // namespace

Result<TriangulatedLines> triangulate_lines(const Constraints& constraints,
                                            std::span<const LineChain> chains,
                                            std::span<const Vec3> points) {
  const auto height = any_height(constraints.dem.grid);
  if (!height) return std::unexpected(height.error());
  return Triangulator(constraints, *height).run(chains, points);
}

Result<CoarseConstrained> coarse_constrained(const Constraints& constraints) {
  std::vector<LineChain> ends;
  for (const auto* parts : {&constraints.parts, &constraints.elsewhere})
    for (const LinePart& part : *parts) ends.push_back({part.a, part.b});
  auto made = triangulate_lines(constraints, ends, {});
  if (!made) return std::unexpected(made.error());
  CoarseConstrained out;
  for (std::size_t k = 0; k < ends.size(); ++k) {
    const auto [a, b] = made->edges[k];
    const bool within = k < constraints.parts.size();
    if (within && a == kNone) return fail(Errc::internal, "lines cross that were repaired");
    if (!within) {
      if (a != kNone) out.lines.add_edge(a, b);
      continue;
    }
    const LinePart& part = constraints.parts[k];
    std::vector<Vec3> inner;
    for (std::size_t i = part.first; i < part.last; ++i)
      inner.push_back(constraints.mesh.vertices[constraints.inner[i]]);
    out.lines.add_line(a, b, inner);
  }
  out.lines.index_points();
  auto mesh = HalfedgeMesh::from_tin(made->tin);
  if (!mesh) return fail("the coarsest mesh with lines", mesh.error());
  out.mesh = std::move(*mesh);
  out.posts = posts_off_lines(constraints);
  return out;
}

}  // namespace tind
