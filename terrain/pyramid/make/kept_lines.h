#pragma once
// Makes lines edges of a tile's mesh before it is fitted. Only tile_frame.h includes this.

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <deque>
#include <map>
#include <utility>

#include "terrain/mesh/halfedge_mesh.h"
#include "terrain/simplify/insertion/delaunay_insertion.h"
#include "terrain/simplify/insertion/line_points.h"
#include "terrain/surface/post_warp.h"

namespace tind {

/// Vertices and lines on the integer grid: all tests are exact. A line that is no edge yet is made
/// one by flipping the edges that it crosses [Sloan: A fast algorithm for generating constrained
/// Delaunay triangulations, Computers & Structures 47(3), 1993]; where it meets a vertex it goes
/// through it, where it crosses a line that is kept both get a vertex.
template <class Insertion>
class KeptLines {
 public:
  using Index = HalfedgeMesh::Index;
  static constexpr Index kNone = HalfedgeMesh::kNone;

  /// None is owned. `insertion` works on `mesh` and keeps `kept`.
  KeptLines(HalfedgeMesh& mesh, Insertion& insertion, LinePoints& kept)
      : mesh_(mesh), insertion_(insertion), kept_(kept) {
    for (Index v = 0; v < mesh_.vertex_slots(); ++v) at_[place(mesh_.position(v))] = v;
  }

  /// The vertex at a place of the grid, made if need be; one that is there gets p's height unless
  /// it is on the border.
  Index vertex(const Vec3& p) {
    if (const auto there = at_.find(place(p)); there != at_.end()) {
      if (!mesh_.on_border(there->second)) mesh_.position(there->second).z = p.z;
      return there->second;
    }
    if (!insertion_.insert_point(p) && !split_line(p)) return kNone;
    const Index v = Index(mesh_.vertex_slots() - 1);
    at_[place(p)] = v;
    return v;
  }

  /// Makes the way from a to b edges that stay; false where there is no room for them.
  bool join(Index a, Index b, int depth = 0) {
    if (a == kNone || b == kNone || depth > kDeepest) return false;
    if (a == b) return true;
    if (mesh_.find_edge(a, b) != kNone) {
      kept_.add_edge(a, b);
      return true;
    }
    std::deque<Pair> crossed;
    const Index through = walk(a, b, crossed);
    if (through != kNone) return join(a, through, depth + 1) && join(through, b, depth + 1);
    if (crossed.empty()) return false;
    for (const auto& [p, q] : crossed)
      if (kept_.keeps(p, q)) return cross(a, b, p, q, depth);
    if (!flip_away(a, b, crossed)) return false;
    kept_.add_edge(a, b);
    return true;
  }

 private:
  using Pair = std::pair<Index, Index>;
  static constexpr int kDeepest = 24;

  HalfedgeMesh& mesh_;
  Insertion& insertion_;
  LinePoints& kept_;
  std::map<std::pair<int, int>, Index> at_;

  static std::pair<int, int> place(const Vec3& p) { return {int(p.x), int(p.y)}; }
  double side(Index a, Index b, Index c) const {
    return orient2d(mesh_.position(a), mesh_.position(b), mesh_.position(c));
  }

  /// A place on a line that is kept: the line then goes through it.
  bool split_line(const Vec3& p) {
    const Index h = line_through(p);
    if (h == kNone) return false;
    const Index a = mesh_.origin(h), b = mesh_.dest(h);
    const Index v = mesh_.split_edge(h, p);
    kept_.split_edge(a, b, v);
    insertion_.legalise(v);
    return true;
  }

  /// The kept edge that p lies inside of, seen from the triangle that was made first: an edge of
  /// whichever triangle holds p.
  Index line_through(const Vec3& p) const {
    const auto found = insertion_.locate(p);
    if (found.triangle == kNone) return line_among(0, Index(mesh_.halfedge_slots()), p);
    const Index h = line_among(3 * found.triangle, 3 * found.triangle + 3, p);
    return h == kNone ? kNone : std::min(h, mesh_.twin(h));
  }

  Index line_among(Index first, Index end, const Vec3& p) const {
    for (Index h = first; h < end; ++h) {
      if (!mesh_.alive_triangle(h / 3) || mesh_.twin(h) == kNone) continue;
      const Index a = mesh_.origin(h), b = mesh_.dest(h);
      const Vec3 &pa = mesh_.position(a), &pb = mesh_.position(b);
      const bool beside = (p.x - pa.x) * (p.x - pb.x) + (p.y - pa.y) * (p.y - pb.y) < 0;
      if (beside && kept_.keeps(a, b) && orient2d(pa, pb, p) == 0) return h;
    }
    return kNone;
  }

  /// The edges that the segment from a to b crosses; or the first vertex that lies on it.
  Index walk(Index a, Index b, std::deque<Pair>& crossed) const {
    Index at = kNone, through = kNone;
    mesh_.for_each_out(a, [&](Index h) {
      if (at != kNone || through != kNone) return;
      const Index p = mesh_.dest(h), q = mesh_.apex(h);
      const double right = side(a, p, b), left = side(a, q, b);
      const auto ahead = [&](Index v) {
        const Vec3 d = mesh_.position(v) - mesh_.position(a),
                   e = mesh_.position(b) - mesh_.position(a);
        return d.x * e.x + d.y * e.y > 0;
      };
      if (right == 0 && ahead(p)) through = p;
      if (left == 0 && ahead(q)) through = q;
      if (right > 0 && left < 0) at = HalfedgeMesh::next(h);
    });
    if (through != kNone) return through;
    while (at != kNone) {
      crossed.push_back({mesh_.origin(at), mesh_.dest(at)});
      const Index beyond = mesh_.twin(at);
      if (beyond == kNone) {
        crossed.clear();
        return kNone;
      }
      const Index far = mesh_.apex(beyond);
      if (far == b) return kNone;
      const double left = side(a, b, far);
      if (left == 0) return far;
      at = left > 0 ? HalfedgeMesh::next(beyond) : HalfedgeMesh::prev(beyond);
    }
    return kNone;
  }

  bool flip_away(Index a, Index b, std::deque<Pair>& crossed) {
    std::size_t tries = 20 * crossed.size() * crossed.size() + 200;
    while (!crossed.empty()) {
      if (tries-- == 0) return false;
      const auto [p, q] = crossed.front();
      crossed.pop_front();
      const Index h = mesh_.find_edge(p, q);
      if (h == kNone) return false;
      const Index u = mesh_.origin(h), w = mesh_.dest(h);
      const Index c = mesh_.apex(h), d = mesh_.apex(mesh_.twin(h));
      if (!(side(u, d, c) > 0 && side(d, w, c) > 0)) {
        crossed.push_back({p, q});
        continue;
      }
      mesh_.flip(h);
      if (c == a || c == b || d == a || d == b) continue;
      if (side(a, b, c) * side(a, b, d) < 0) crossed.push_back({c, d});
    }
    return mesh_.find_edge(a, b) != kNone;
  }

  /// Both lines go through the place of the grid that is nearest to where they cross.
  bool cross(Index a, Index b, Index p, Index q, int depth) {
    const Vec3 from = mesh_.position(p), to = mesh_.position(q);
    const double sp = side(a, b, p), sq = side(a, b, q), t = sp / (sp - sq);
    // Never on the border, which neighbours share.
    const auto inside = [](double v) { return std::clamp(std::round(v), 1.0, kTileExtent - 1); };
    const Vec3 at{inside(from.x + t * (to.x - from.x)), inside(from.y + t * (to.y - from.y)),
                  t < 0.5 ? from.z : to.z};
    kept_.remove_edge(p, q);
    const Index x = vertex(at);
    const bool other = join(p, x, depth + 1) && join(x, q, depth + 1);
    return join(a, x, depth + 1) && join(x, b, depth + 1) && other;
  }
};

}  // namespace tind
