// Repair goes in rounds. CGAL's triangulation takes the segments as constraints and finds every
// crossing; those are brought to the lattice, points within the tolerance of each other become one,
// and a segment with a point within the tolerance is led through it (the apex of one of its two
// triangles: in a constrained Delaunay triangulation it is the one that sees the segment under the
// largest angle). Each of these moves lines by a hair and may make new crossings; so the next round
// looks again, until one finds nothing to do (iterated snap rounding, [Halperin02]).

#include "terrain/mesh/constrained_delaunay.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <numeric>
#include <random>
#include <unordered_map>
#include <vector>

#if TIND_WITH_CGAL
#include <CGAL/Constrained_Delaunay_triangulation_2.h>
#include <CGAL/Constrained_triangulation_plus_2.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Spatial_sort_traits_adapter_2.h>
#include <CGAL/Triangulation_vertex_base_with_info_2.h>
#include <CGAL/hilbert_sort.h>

#include "terrain/base/caught.h"
#include "terrain/base/keyed_hash.h"
#endif

namespace tind {

#if TIND_WITH_CGAL

namespace {

using Index = std::uint32_t;
constexpr Index kNew = ~Index(0);  // a vertex that CGAL made: a crossing
constexpr int kRounds = 40;

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
/// An index that is kNew until somebody says otherwise.
struct VertexIndex {
  Index value = kNew;
};
using VertexBase = CGAL::Triangulation_vertex_base_with_info_2<VertexIndex, Kernel>;
using FaceBase = CGAL::Constrained_triangulation_face_base_2<Kernel>;
using Store = CGAL::Triangulation_data_structure_2<VertexBase, FaceBase>;
using Delaunay =
    CGAL::Constrained_Delaunay_triangulation_2<Kernel, Store, CGAL::Exact_predicates_tag>;
/// Remembers for each constraint the vertices along it.
using Hierarchy = CGAL::Constrained_triangulation_plus_2<Delaunay>;

/// Where the point of an index is, as CGAL's sort asks for it (a property map).
struct Place {
  using value_type = Kernel::Point_2;
  using reference = value_type;
  using key_type = Index;
  using category = boost::readable_property_map_tag;
  const std::vector<Vec3>* points;
  friend value_type get(const Place& place, Index i) {
    return {(*place.points)[i].x, (*place.points)[i].y};
  }
};

/// All points, in an order in which each insertion turns over few triangles, whatever they lie on
/// (lines side by side, circles): which come first is by chance, the same at every call, and then
/// those of each round, twice as many as in the one before, follow a Hilbert curve, so that each is
/// close to the one before (a biased randomized insertion order, [Amenta03]).
std::vector<Index> insertion_order(const std::vector<Vec3>& points) {
  constexpr std::size_t kFirst = 64;
  std::vector<Index> order(points.size());
  std::iota(order.begin(), order.end(), Index(0));
  std::mt19937_64 random;
  for (std::size_t i = order.size(); i > 1; --i) std::swap(order[i - 1], order[random() % i]);
  const CGAL::Spatial_sort_traits_adapter_2<Kernel, Place> traits(Place{&points});
  for (std::size_t first = 0, last = kFirst; first < order.size(); first = last, last *= 2) {
    last = std::min(last, order.size());
    CGAL::hilbert_sort(order.begin() + std::ptrdiff_t(first), order.begin() + std::ptrdiff_t(last),
                       traits);
  }
  return order;
}

/// Calls f(i) for i in 0..n-1: every 2^k-th first, then those halfway between, and so on. Segments
/// side by side (a zigzag) would each cross all edges that the rest will, in the half that they
/// leave open; those halfway between two others have only what is between them.
template <class F>
void coarse_to_fine(std::size_t n, F&& f) {
  if (n == 0) return;
  std::size_t step = std::bit_ceil(n);
  f(std::size_t(0));
  for (; step > 1; step /= 2)
    for (std::size_t i = step / 2; i < n; i += step) f(i);
}

std::uint64_t pair_key(Index a, Index b) {
  return std::uint64_t(std::min(a, b)) << 32 | std::max(a, b);
}

double squared(const Vec3& a, const Vec3& b) {
  return (a.x - b.x) * (a.x - b.x) + (a.y - b.y) * (a.y - b.y);
}

/// Finds an earlier point within the tolerance.
class PointIndex {
 public:
  explicit PointIndex(const std::vector<Vec3>& points) : points_(points) {}

  /// The lowest index within the tolerance of point i, or i itself, which is then entered.
  Index find_or_add(Index i) {
    const Vec3& p = points_[i];
    const std::int64_t cx = cell(p.x), cy = cell(p.y);
    Index best = i;
    for (std::int64_t x = cx - 1; x <= cx + 1; ++x) {
      for (std::int64_t y = cy - 1; y <= cy + 1; ++y) {
        const auto there = cells_.find(key(x, y));
        if (there == cells_.end()) continue;
        for (const Index j : there->second)
          if (j < best && squared(p, points_[j]) <= kLineTolerance * kLineTolerance) best = j;
      }
    }
    if (best == i) cells_[key(cx, cy)].push_back(i);
    return best;
  }

 private:
  const std::vector<Vec3>& points_;
  std::unordered_map<std::uint64_t, std::vector<Index>, KeyedHash> cells_;

  static std::int64_t cell(double v) { return std::int64_t(std::floor(v / kLineTolerance)); }
  static std::uint64_t key(std::int64_t x, std::int64_t y) {
    return std::uint64_t(x) * 0x9e3779b97f4a7c15u + std::uint64_t(y);
  }
};

class Repairer {
 public:
  explicit Repairer(LineNetwork& network) : net_(network), index_(net_.points) {}

  LineRepairs run() {
    join_near(0);
    int round = 0;
    while (round < kRounds && !settled()) ++round;
    if (round == kRounds) drop_crossing();
    return repairs_;
  }

 private:
  using Vertex = Hierarchy::Vertex_handle;

  /// One straight segment with all that lies on it.
  struct Chain {
    std::size_t first, last;  // in net_.segments: those that run from one end to the other
    std::vector<Index> points;
  };

  LineNetwork& net_;
  PointIndex index_;
  LineRepairs repairs_;
  std::vector<Chain> chains_;
  std::unordered_map<std::uint64_t, Index, KeyedHash>
      through_;  // segment -> point that it is led through

  /// Points from `first` on give way to earlier ones that are within the tolerance; segments
  /// follow. True when there was any.
  bool join_near(Index first) {
    std::vector<Index> now(net_.points.size());
    bool any = false;
    for (Index i = 0; i < now.size(); ++i) {
      now[i] = i < first ? i : index_.find_or_add(i);
      if (now[i] == i) continue;
      any = true;
      ++repairs_.joined;
      if (std::isnan(net_.points[now[i]].z)) net_.points[now[i]].z = net_.points[i].z;
    }
    for (LineSegment& s : net_.segments) s.a = now[s.a], s.b = now[s.b];
    tidy();
    return any;
  }

  /// Segments in order, none without length, each once for a source that runs along it an odd
  /// number of times, and twice for one that does so an even number of times: what is inside an
  /// outline that folds onto itself stays inside.
  void tidy() {
    std::vector<LineSegment>& all = net_.segments;
    for (LineSegment& s : all)
      if (s.a > s.b) std::swap(s.a, s.b);
    std::erase_if(all, [](const LineSegment& s) { return s.a == s.b; });
    std::sort(all.begin(), all.end());
    std::size_t kept = 0;
    for (std::size_t i = 0, j = 0; i < all.size(); i = j) {
      const LineSegment segment = all[i];
      while (j < all.size() && all[j] == segment) ++j;
      all[kept++] = segment;
      if ((j - i) % 2 == 0) all[kept++] = segment;
    }
    all.resize(kept);
  }

  /// One round. True when nothing was left to do.
  bool settled() {
    const Index before = Index(net_.points.size());
    triangulate_chains();
    split_segments();
    const bool bent = !through_.empty();
    repairs_.crossings += net_.points.size() - before;
    const bool joined = join_near(before);
    return !bent && !joined && net_.points.size() == before;
  }

  void triangulate_chains() {
    Hierarchy triangulation;
    std::vector<Vertex> vertex(net_.points.size());
    std::vector<bool> used(net_.points.size(), false);
    for (const LineSegment& s : net_.segments) used[s.a] = used[s.b] = true;
    Hierarchy::Face_handle near;
    for (const Index i : insertion_order(net_.points)) {
      if (!used[i]) continue;
      vertex[i] = triangulation.insert({net_.points[i].x, net_.points[i].y}, near);
      vertex[i]->info().value = i;
      near = vertex[i]->face();
    }
    find_chains();
    std::vector<Hierarchy::Constraint_id> ids(chains_.size());
    coarse_to_fine(chains_.size(), [&](std::size_t k) {
      const LineSegment& s = net_.segments[chains_[k].first];
      ids[k] = triangulation.insert_constraint(vertex[s.a], vertex[s.b]);
    });
    for (std::size_t k = 0; k < ids.size(); ++k) {
      for (auto v = triangulation.vertices_in_constraint_begin(ids[k]);
           v != triangulation.vertices_in_constraint_end(ids[k]); ++v)
        chains_[k].points.push_back(known(*v, chains_[k]));
    }
    find_near_points(triangulation);
  }

  /// Of the segments in order: those with the same ends are one chain.
  void find_chains() {
    const std::vector<LineSegment>& all = net_.segments;
    chains_.clear();
    for (std::size_t i = 0, j = 0; i < all.size(); i = j) {
      while (j < all.size() && all[j].a == all[i].a && all[j].b == all[i].b) ++j;
      chains_.push_back({i, j, {}});
    }
  }

  /// The index of a vertex; a new crossing becomes a point of the network.
  Index known(Vertex v, const Chain& chain) {
    if (v->info().value != kNew) return v->info().value;
    const LineSegment& s = net_.segments[chain.first];
    const Vec3 a = net_.points[s.a], b = net_.points[s.b];
    Vec3 p{snap_to_line_lattice(v->point().x()), snap_to_line_lattice(v->point().y()), 0};
    p.z = a.z + (b.z - a.z) * std::sqrt(squared(a, p) / squared(a, b));  // NaN without heights
    v->info().value = Index(net_.points.size());
    net_.points.push_back(p);
    return v->info().value;
  }

  void find_near_points(const Hierarchy& t) {
    through_.clear();
    if (t.dimension() < 2) return;  // all on one straight line: there is no beside
    for (auto e = t.finite_edges_begin(); e != t.finite_edges_end(); ++e) {
      if (!t.is_constrained(*e)) continue;
      const auto [face, i] = *e;
      const Index a = face->vertex(t.ccw(i))->info().value, b = face->vertex(t.cw(i))->info().value;
      double least = kLineTolerance;
      for (const Vertex& v : {face->vertex(i), t.mirror_vertex(face, i)}) {
        if (t.is_infinite(v)) continue;
        const double d = distance_beside(v->info().value, a, b);
        if (d > least) continue;
        least = d;
        through_[pair_key(a, b)] = v->info().value;
      }
    }
  }

  /// From point v to the segment a-b, where v lies beside it; infinite beyond its ends.
  double distance_beside(Index v, Index a, Index b) const {
    const Vec3 &p = net_.points[v], &q = net_.points[a], &r = net_.points[b];
    const double l2 = squared(q, r);
    const double along = (p.x - q.x) * (r.x - q.x) + (p.y - q.y) * (r.y - q.y);
    if (!(along > 0 && along < l2)) return std::numeric_limits<double>::infinity();
    return std::abs(orient2d(q, r, p)) / std::sqrt(l2);
  }

  void split_segments() {
    std::vector<LineSegment> now;
    now.reserve(net_.segments.size());
    for (const Chain& chain : chains_) {
      for (std::size_t k = 1; k < chain.points.size(); ++k) {
        const Index a = chain.points[k - 1], b = chain.points[k];
        const auto bend = through_.find(pair_key(a, b));
        repairs_.bent += bend != through_.end();
        for (std::size_t i = chain.first; i < chain.last; ++i) {
          const std::uint32_t source = net_.segments[i].source;
          if (bend == through_.end()) {
            now.push_back({a, b, source});
          } else {
            now.push_back({a, bend->second, source});
            now.push_back({bend->second, b, source});
          }
        }
      }
    }
    net_.segments = std::move(now);
  }

  /// The last resort: what still makes new points is left out.
  void drop_crossing() {
    for (int round = 0; round < kRounds; ++round) {
      const Index before = Index(net_.points.size());
      triangulate_chains();
      if (net_.points.size() == before) return;
      std::vector<LineSegment> now;
      for (const Chain& chain : chains_) {
        const bool crosses =
            std::ranges::any_of(chain.points, [&](Index i) { return i >= before; });
        repairs_.dropped += crosses ? chain.last - chain.first : 0;
        if (!crosses)
          now.insert(now.end(), net_.segments.begin() + std::ptrdiff_t(chain.first),
                     net_.segments.begin() + std::ptrdiff_t(chain.last));
      }
      net_.segments = std::move(now);
      net_.points.resize(before);
    }
  }
};

std::vector<Triangle> triangles_of(Delaunay& t, std::vector<Vec3>& points) {
  for (auto v = t.finite_vertices_begin(); v != t.finite_vertices_end(); ++v) {
    if (v->info().value != kNew) continue;
    v->info().value = Index(points.size());
    points.push_back({v->point().x(), v->point().y(), std::numeric_limits<double>::quiet_NaN()});
  }
  std::vector<Triangle> triangles;
  triangles.reserve(t.number_of_faces());
  for (auto f = t.finite_faces_begin(); f != t.finite_faces_end(); ++f) {
    triangles.push_back(
        {f->vertex(0)->info().value, f->vertex(1)->info().value, f->vertex(2)->info().value});
  }
  return triangles;
}

}  // namespace

bool has_constrained_delaunay() { return true; }

Result<LineRepairs> repair_lines(LineNetwork& network) {
  try {
    return Repairer(network).run();
  } catch (const std::exception& e) {
    return fail("repairing lines", caught(e));
  }
}

Result<std::vector<Triangle>> triangulate(std::vector<Vec3>& points,
                                          std::span<const std::array<std::uint32_t, 2>> edges) {
  try {
    Delaunay t;
    std::vector<Delaunay::Vertex_handle> vertex(points.size());
    Delaunay::Face_handle near;
    for (const Index i : insertion_order(points)) {
      vertex[i] = t.insert({points[i].x, points[i].y}, near);
      if (vertex[i]->info().value == kNew || vertex[i]->info().value > i)
        vertex[i]->info().value = i;  // of points at one place the first
      near = vertex[i]->face();
    }
    coarse_to_fine(edges.size(), [&](std::size_t i) {
      const auto& [a, b] = edges[i];
      if (vertex[a] != vertex[b]) t.insert_constraint(vertex[a], vertex[b]);
    });
    return triangles_of(t, points);
  } catch (const std::exception& e) {
    return fail("triangulating lines", caught(e));
  }
}

#else

namespace {

std::unexpected<Error> without() {
  return fail(Errc::unsupported,
              "this tind was built without lines (-DTIND_WITH_CGAL=OFF): build it with CGAL for "
              "--breaklines, --flatten and --boundary");
}

}  // namespace

bool has_constrained_delaunay() { return false; }
Result<LineRepairs> repair_lines(LineNetwork&) { return without(); }
Result<std::vector<Triangle>> triangulate(std::vector<Vec3>&,
                                          std::span<const std::array<std::uint32_t, 2>>) {
  return without();
}

#endif

}  // namespace tind
