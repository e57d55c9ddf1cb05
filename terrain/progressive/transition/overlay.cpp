// The fine mesh takes in the coarse one: first its vertices, then its edges, each edge walked from
// end to end, with a vertex wherever it crosses an edge of the fine mesh. A crossing splits the
// crossed edge, and the split itself makes the piece of the walked edge that leads there. An edge
// that only splits have made lies inside one fine triangle and carries nothing: it is flipped out
// of the way where its two triangles allow it, or crossings would breed crossings.
//
// Places are doubles. The orientation of every triangle that a split makes is checked (with the
// rounding taken off), so what comes out is valid; where a crossing lies within kNear of a vertex
// the walked edge goes through that vertex.

#include "terrain/progressive/transition/overlay.h"

#include <algorithm>
#include <cmath>

#include "terrain/mesh/triangle_locator.h"

namespace tind {

namespace {

using Index = HalfedgeMesh::Index;
constexpr Index kNone = HalfedgeMesh::kNone;
constexpr double kNear = 1e-7;  // of the lattice's unit

std::string place(const Vec3& p) {
  return "(" + std::to_string(p.x) + ", " + std::to_string(p.y) + ")";
}

double plan_distance(const Vec3& a, const Vec3& b) { return std::hypot(a.x - b.x, a.y - b.y); }

/// The height of a triangle's plane over p.
double plane_at(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& p) {
  const double area = orient2d(a, b, c);
  const double wb = orient2d(a, p, c) / area, wc = orient2d(a, b, p) / area;
  return a.z + wb * (b.z - a.z) + wc * (c.z - a.z);
}

class Overlayer {
 public:
  Overlayer(const Tin& coarse, Overlay& out, const std::stop_token& stop)
      : coarse_(coarse), out_(out), m_(out.mesh), stop_(stop) {
    for (Index h = 0; h < m_.halfedge_slots(); ++h)
      if (m_.origin(h) < m_.dest(h) || m_.twin(h) == kNone) fine_edges_.push_back(ends_of(h));
    std::ranges::sort(fine_edges_);
    fine_edge_.assign(m_.vertex_slots(), kNone);
  }

  /// `order` 0..3: which edge comes first, and from which of its ends it is walked.
  Result<void> run(const HalfedgeMesh& coarse_mesh, int order) {
    for (const Vec3& p : coarse_.vertices) {
      const Result<Index> v = add_vertex(p);
      if (!v) return std::unexpected(v.error());
      out_.corner.push_back(*v);
      out_.line[*v] = Overlay::kCorner;
    }
    for (Index v = 0; v < m_.vertex_slots(); ++v)
      if (m_.alive_vertex(v) && m_.on_border(v) && out_.line[v] != Overlay::kCorner)
        out_.line[v] = Overlay::kSide;
    const Index slots = Index(coarse_mesh.halfedge_slots());
    for (Index i = 0; i < slots; ++i) {
      const Index h = order & 2 ? slots - 1 - i : i, twin = coarse_mesh.twin(h);
      if (twin == kNone || twin < h) continue;
      Index a = out_.corner[coarse_mesh.origin(h)], b = out_.corner[coarse_mesh.dest(h)];
      if (order & 1) std::swap(a, b);
      line_ = Index(out_.edge.size());
      out_.edge.push_back({a, b});
      if (const Result<void> ok = add_edge(a, b); !ok) return ok;
    }
    return {};
  }

 private:
  const Tin& coarse_;
  Overlay& out_;
  HalfedgeMesh& m_;
  const std::stop_token& stop_;
  Index line_ = 0;
  Index last_ = 0;                                // the triangle where the last point was
  std::vector<std::array<Index, 2>> fine_edges_;  // sorted; each the lower end first
  std::vector<Index> fine_edge_;                  // by slot: which one it was put on, or kNone

  std::array<Index, 2> ends_of(Index h) const {
    return {std::min(m_.origin(h), m_.dest(h)), std::max(m_.origin(h), m_.dest(h))};
  }
  /// The edge of the fine mesh of which h is a piece; kNone where it is none.
  Index fine_edge(Index h) const {
    const auto [a, b] = ends_of(h);
    if (b < out_.fine_vertices) {
      const auto found = std::ranges::lower_bound(fine_edges_, std::array{a, b});
      const bool there = found != fine_edges_.end() && *found == std::array{a, b};
      return there ? Index(found - fine_edges_.begin()) : kNone;
    }
    const Index e = fine_edge_[b];  // b is none of the fine mesh's own
    if (e == kNone) return kNone;
    return fine_edge_[a] == e || fine_edges_[e][0] == a || fine_edges_[e][1] == a ? e : kNone;
  }

  std::unexpected<Error> stuck(const Vec3& p) const {
    return fail(Errc::bad_data, "the two meshes cannot be laid over each other at " + place(p));
  }

  bool ccw(Index t) const {
    return surely_ccw(m_.position(m_.origin(3 * t)), m_.position(m_.origin(3 * t + 1)),
                      m_.position(m_.origin(3 * t + 2)));
  }
  bool star_is_ccw(Index v) const {
    bool ok = true;
    m_.for_each_out(v, [&](Index h) { ok = ok && ccw(HalfedgeMesh::triangle(h)); });
    return ok;
  }
  double side_of(Index h, const Vec3& p) const {
    return orient2d(m_.position(m_.origin(h)), m_.position(m_.dest(h)), p);
  }
  bool holds(Index t, const Vec3& p) const {
    return side_of(3 * t, p) >= 0 && side_of(3 * t + 1, p) >= 0 && side_of(3 * t + 2, p) >= 0;
  }

  /// A triangle that holds p: a walk towards it, and where that goes round, all of them.
  Index locate(const Vec3& p) {
    Index t = last_;
    for (std::size_t step = 0; step < m_.triangle_slots(); ++step) {
      Index out = kNone;
      for (Index k = 0; k < 3 && out == kNone; ++k) {
        const Index h = 3 * t + (k + Index(step)) % 3;
        if (m_.twin(h) != kNone && side_of(h, p) < 0) out = h;
      }
      if (out == kNone) break;
      t = HalfedgeMesh::triangle(m_.twin(out));
    }
    if (!holds(t, p))
      for (Index i = 0; i < m_.triangle_slots(); ++i)
        if (holds(i, p)) return last_ = i;
    return last_ = t;
  }

  Index split(Index h, const Vec3& p) {
    fine_edge_.push_back(fine_edge(h));
    return m_.split_edge(h, p);
  }
  Result<Index> added(Index v, Index line) {
    out_.line.push_back(line);
    if (!star_is_ccw(v)) return stuck(m_.position(v));
    return v;
  }
  Vec3 on_edge(Index h, Vec3 p) const {
    const Vec3 &a = m_.position(m_.origin(h)), &b = m_.position(m_.dest(h));
    p.z = a.z + plan_distance(a, p) / plan_distance(a, b) * (b.z - a.z);
    return p;
  }

  /// The vertex at p, there already or new.
  Result<Index> add_vertex(const Vec3& p) {
    const Index t = locate(p);
    Index nearest = 3 * t;
    double least = HUGE_VAL;
    for (Index h = 3 * t; h < 3 * t + 3; ++h) {
      const Vec3& a = m_.position(m_.origin(h));
      if (a.x == p.x && a.y == p.y) return m_.origin(h);
      const double off = side_of(h, p) / plan_distance(a, m_.position(m_.dest(h)));
      if (off < -kNear) return stuck(p);
      if (off < least) least = off, nearest = h;
    }
    if (least <= kNear) return added(split(nearest, on_edge(nearest, p)), Overlay::kInside);
    Vec3 inside = p;
    inside.z = plane_at(m_.position(m_.origin(3 * t)), m_.position(m_.origin(3 * t + 1)),
                        m_.position(m_.origin(3 * t + 2)), p);
    m_.split_triangle(t, inside);
    fine_edge_.push_back(kNone);
    return added(Index(m_.vertex_slots() - 1), Overlay::kInside);
  }

  /// Walks from a to b.
  Result<void> add_edge(Index a, Index b) {
    const Vec3 p = m_.position(a), q = m_.position(b);
    for (Index at = a; at != b;) {
      if (stop_.stop_requested()) return fail(Errc::cancelled, "stopped");
      const Result<Index> next = step(at, b, p, q);
      if (!next) return std::unexpected(next.error());
      if (*next == at) continue;
      at = *next;
      if (at != b) out_.line[at] = line_;
    }
    return {};
  }

  /// A vertex that the walked edge may go through: not one of another coarse edge.
  bool free(Index v) const { return out_.line[v] == Overlay::kInside; }

  /// Whether the two vertices lie on one coarse edge.
  bool on_one_line(Index v, Index w) const {
    const auto reaches = [&](Index a, Index b) {
      const Index line = out_.line[a];
      return line < Overlay::kSide &&
             (out_.line[b] == line || b == out_.edge[line][0] || b == out_.edge[line][1]);
    };
    return reaches(v, w) || reaches(w, v);
  }

  bool carries_nothing(Index h) const {
    return fine_edge(h) == kNone && !on_one_line(m_.origin(h), m_.dest(h));
  }
  /// Flips h where both ends are further than `off` from the new edge. Of vertices on one line no
  /// rounding makes a triangle when that is kNear.
  bool flips(Index h, double off) {
    const Vec3 &a = m_.position(m_.origin(h)), &b = m_.position(m_.dest(h));
    const Vec3 &c = m_.position(m_.apex(h)), &d = m_.position(m_.apex(m_.twin(h)));
    const double least = off * plan_distance(c, d);
    if (!surely_ccw(d, c, a) || !surely_ccw(c, d, b)) return false;
    if (orient2d(d, c, a) < least || orient2d(c, d, b) < least) return false;
    m_.flip(h);
    return true;
  }

  /// The next vertex on the way from `at` to b; `at` itself when an edge was flipped out of the
  /// way.
  Result<Index> step(Index at, Index b, const Vec3& p, const Vec3& q) {
    const double length = plan_distance(p, q);
    const auto off = [&](Index v) { return orient2d(p, q, m_.position(v)) / length; };
    const auto ahead = [&](Index v) {
      const Vec3 d = m_.position(v) - m_.position(at);
      return d.x * (q.x - p.x) + d.y * (q.y - p.y) > 0;
    };
    Index through = kNone, cross = kNone;
    m_.for_each_out(at, [&](Index h) {
      const Index r = m_.dest(h), l = m_.apex(h);
      if (r == b || l == b) through = b;
      if (through == b) return;
      if (free(r) && ahead(r) && std::abs(off(r)) <= kNear) through = r;
      if (free(l) && ahead(l) && std::abs(off(l)) <= kNear) through = l;
      if (off(r) < 0 && off(l) > 0 && (ahead(r) || ahead(l))) cross = HalfedgeMesh::next(h);
    });
    if (through != kNone) return through;
    if (cross == kNone || m_.twin(cross) == kNone) return stuck(m_.position(at));
    if (carries_nothing(cross) && flips(cross, kNear)) return at;
    const Index r = m_.origin(cross), l = m_.dest(cross);
    const double s = off(r) / (off(r) - off(l));
    Vec3 where = m_.position(r) + (m_.position(l) - m_.position(r)) * s;
    if (plan_distance(where, m_.position(at)) <= kNear && !on_one_line(r, l)) {
      // The crossed edge goes through this very vertex: so it does from now on.
      if (!flips(cross, 0)) return stuck(m_.position(at));
      return at;
    }
    if (free(r) && plan_distance(where, m_.position(r)) <= kNear) return r;
    if (free(l) && plan_distance(where, m_.position(l)) <= kNear) return l;
    return added(split(cross, where), line_);
  }
};

/// The surface over p where rounding puts it into no triangle: the plane of the one that holds it
/// best.
double height_on(const Tin& mesh, const Vec3& p) {
  double best = -HUGE_VAL, z = 0;
  for (const Triangle& t : mesh.triangles) {
    const Vec3 &a = mesh.vertices[t[0]], &b = mesh.vertices[t[1]], &c = mesh.vertices[t[2]];
    if (p.x < std::min({a.x, b.x, c.x}) - 1 || p.x > std::max({a.x, b.x, c.x}) + 1) continue;
    const double inside =
        std::min({orient2d(a, b, p), orient2d(b, c, p), orient2d(c, a, p)}) / orient2d(a, b, c);
    if (inside > best) best = inside, z = plane_at(a, b, c, p);
    if (inside >= 0) break;
  }
  return z;
}

/// One side of the rectangle as a line: (x or y, height), from its lower end on.
using SideLine = std::vector<std::array<double, 2>>;

double height_along(const SideLine& line, double t) {
  const auto next = std::lower_bound(line.begin(), line.end(), std::array{t, -HUGE_VAL});
  if (next == line.end()) return line.back()[1];
  if ((*next)[0] == t || next == line.begin()) return (*next)[1];
  const auto& [t0, z0] = *(next - 1);
  const auto& [t1, z1] = *next;
  return z0 + (t - t0) / (t1 - t0) * (z1 - z0);
}

struct Bounds {
  double low_x = HUGE_VAL, high_x = -HUGE_VAL, low_y = HUGE_VAL, high_y = -HUGE_VAL;
  explicit Bounds(const Tin& t) {
    for (const Vec3& v : t.vertices) {
      low_x = std::min(low_x, v.x), high_x = std::max(high_x, v.x);
      low_y = std::min(low_y, v.y), high_y = std::max(high_y, v.y);
    }
  }
  bool on(int side, const Vec3& v) const {  // west, east, south, north
    return side == 0   ? v.x == low_x
           : side == 1 ? v.x == high_x
           : side == 2 ? v.y == low_y
                       : v.y == high_y;
  }
  static double along(int side, const Vec3& v) { return side < 2 ? v.y : v.x; }
  SideLine line(int side, const Tin& tin) const {
    SideLine out;
    for (const Vec3& v : tin.vertices)
      if (on(side, v)) out.push_back({along(side, v), v.z});
    std::sort(out.begin(), out.end());
    return out;
  }
  friend bool operator==(const Bounds&, const Bounds&) = default;
};

/// Heights on the sides, from the lines of the sides alone.
void settle_sides(const Tin& fine, const Tin& coarse, const Bounds& bounds, Overlay& o) {
  for (int side = 0; side < 4; ++side) {
    const SideLine fine_line = bounds.line(side, fine), coarse_line = bounds.line(side, coarse);
    for (Index v = 0; v < o.mesh.vertex_slots(); ++v) {
      Vec3& p = o.mesh.position(v);
      if (!bounds.on(side, p)) continue;
      p.z = height_along(fine_line, Bounds::along(side, p));
      o.coarse_z[v] = height_along(coarse_line, Bounds::along(side, p));
    }
  }
}

}  // namespace

Result<Overlay> overlay(const Tin& fine, const Tin& coarse, const std::stop_token& stop) {
  const Bounds bounds(fine);
  if (fine.triangles.empty() || coarse.triangles.empty() || bounds != Bounds(coarse))
    return fail(Errc::bad_data, "the two meshes do not cover the same rectangle");
  const auto mesh = HalfedgeMesh::from_tin(fine);
  if (!mesh) return fail("the fine mesh", mesh.error());
  const auto coarse_mesh = HalfedgeMesh::from_tin(coarse);
  if (!coarse_mesh) return fail("the coarse mesh", coarse_mesh.error());
  Overlay out;
  Result<void> done;
  // A crossing that doubles cannot tell from its neighbour depends on which edges came before.
  for (int order = 0; order < 4 && (order == 0 || (!done && !stop.stop_requested())); ++order) {
    out = {};
    out.mesh = *mesh;
    out.fine_vertices = fine.vertices.size();
    out.line.assign(out.fine_vertices, Overlay::kInside);
    done = Overlayer(coarse, out, stop).run(*coarse_mesh, order);
  }
  if (!done) return std::unexpected(done.error());
  const TriangleLocator coarse_surface(coarse);
  for (Index v = 0; v < out.mesh.vertex_slots(); ++v) {
    const Vec3& p = out.mesh.position(v);
    const auto z = coarse_surface.height_at({p.x, p.y});
    out.coarse_z.push_back(z ? *z : height_on(coarse, p));
  }
  for (std::size_t j = 0; j < coarse.vertices.size(); ++j)
    out.coarse_z[out.corner[j]] = coarse.vertices[j].z;
  settle_sides(fine, coarse, bounds, out);
  return out;
}

}  // namespace tind
