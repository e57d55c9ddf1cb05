// The tree is complete: its triangles are halved by the median along one axis, level by level, so
// node i's children are 2 i + 1 and 2 i + 2 and nothing else is stored. The axis is the one along
// which the box holds most of its triangles side by side: halves along the longest side overlap
// where triangles are as long as that, as on terrain that is steeper than wide.
//
// A long triangle that runs across the axes fills next to nothing of its box, and where thousands
// of them share a corner, a point lies in the boxes of nearly all. The same triangles lie between
// two close planes along them: a node whose box is much wider than that has two such slabs, too.
// They only leave out what is farther away than the best, so no answer depends on them.
//
// In a mesh of which the corners were mixed up, triangles as large as all of it go every way, and
// a place lies in the boxes of a good part of them whatever the tree. There space is cut up in
// place of the triangles (triangle_cells.h), and each triangle has a slab of its own, its plane, so
// that to leave it out takes three products and nothing of the mesh.

#include "terrain/mesh/nearest.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <functional>
#include <utility>

namespace tind {

namespace {

constexpr std::size_t kLeaf = 4;

/// The nearest point of triangle abc (Ericson, Real-Time Collision Detection, 5.1.5).
NearestPoint nearest_on(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& p) {
  const Vec3 ab = b - a, ac = c - a, ap = p - a;
  auto at = [&](double u, double v, double w) {
    const Vec3 d = a * u + b * v + c * w - p;
    return NearestPoint{dot(d, d), 0, {u, v, w}};
  };
  const double d1 = dot(ab, ap), d2 = dot(ac, ap);
  if (d1 <= 0 && d2 <= 0) return at(1, 0, 0);
  const Vec3 bp = p - b;
  const double d3 = dot(ab, bp), d4 = dot(ac, bp);
  if (d3 >= 0 && d4 <= d3) return at(0, 1, 0);
  const double vc = d1 * d4 - d3 * d2;
  if (vc <= 0 && d1 >= 0 && d3 <= 0 && d1 > d3) return at(1 - d1 / (d1 - d3), d1 / (d1 - d3), 0);
  const Vec3 cp = p - c;
  const double d5 = dot(ab, cp), d6 = dot(ac, cp);
  if (d6 >= 0 && d5 <= d6) return at(0, 0, 1);
  const double vb = d5 * d2 - d1 * d6;
  if (vb <= 0 && d2 >= 0 && d6 <= 0 && d2 > d6) return at(1 - d2 / (d2 - d6), 0, d2 / (d2 - d6));
  const double va = d3 * d6 - d5 * d4, e = d4 - d3, f = d5 - d6;
  if (va <= 0 && e >= 0 && f >= 0 && e + f > 0) return at(0, 1 - e / (e + f), e / (e + f));
  const double sum = va + vb + vc;
  if (!(sum > 0)) return at(1, 0, 0);  // no area
  return at(1 - (vb + vc) / sum, vb / sum, vc / sum);
}

/// Of triangles whose corners are in the same places, in the same order, the first. Were all in the
/// tree, each search whose nearest is one of them would have to look at every other.
class DistinctTriangles {
 public:
  explicit DistinctTriangles(const Tin& tin) : tin_(tin), place_(tin.vertices.size()) {
    for (std::size_t v = 0; v < place_.size(); ++v) place_[v] = mixed(tin.vertices[v]);
  }

  std::vector<std::uint32_t> list() const {
    std::vector<std::pair<std::uint64_t, std::uint32_t>> order;
    order.reserve(tin_.triangles.size());
    for (std::uint32_t t = 0; t < tin_.triangles.size(); ++t) {
      const Triangle& c = tin_.triangles[t];
      order.emplace_back(place_[c[0]] + 3 * place_[c[1]] + 5 * place_[c[2]], t);
    }
    std::ranges::sort(order);
    std::vector<std::uint32_t> distinct;
    for (std::size_t i = 0, first = 0; i < order.size(); ++i) {
      if (order[i].first != order[first].first) first = i;
      if (i == first || corners(order[i].second) != corners(order[first].second))
        distinct.push_back(order[i].second);
    }
    std::ranges::sort(distinct);
    return distinct;
  }

 private:
  using Place = std::array<double, 3>;
  const Tin& tin_;
  std::vector<std::uint64_t> place_;

  static std::uint64_t mixed(const Vec3& p) {
    std::uint64_t h = 0;
    for (const double x : {p.x, p.y, p.z}) {
      h = (h ^ std::bit_cast<std::uint64_t>(x + 0.0)) * 0x9e3779b97f4a7c15u;  // -0 is 0
      h ^= h >> 32;
    }
    return h * 0xbf58476d1ce4e5b9u;
  }
  std::array<Place, 3> corners(std::uint32_t t) const {
    std::array<Place, 3> places;
    for (std::size_t k = 0; k < 3; ++k) {
      const Vec3& p = tin_.vertices[tin_.triangles[t][k]];
      places[k] = {p.x, p.y, p.z};
    }
    return places;
  }
};

/// Along the triangle's longest edge, of its length.
Vec3 longest_edge(const Vec3& a, const Vec3& b, const Vec3& c) {
  const Vec3 ab = b - a, bc = c - b, ca = a - c;
  const double x = dot(ab, ab), y = dot(bc, bc), z = dot(ca, ca);
  return x >= y && x >= z ? ab : y >= z ? bc : ca;
}

double sum_of(const Vec3& v) { return std::abs(v.x) + std::abs(v.y) + std::abs(v.z); }

/// What rounding may move a place by in the sums of a slab, and some more.
double rounding_at(const Vec3& p) { return 1e-14 * sum_of(p); }

/// Whether all between the planes is farther from p than by the root of `squared`.
template <class Slab>
bool is_beyond(const Slab& slab, const Vec3& p, double rounding, double squared) {
  const double outside = std::abs(dot(slab.direction, p) - slab.middle) - slab.half - rounding;
  return outside > 0 && outside * outside > squared;
}

double component(const Vec3& v, int axis) { return axis == 0 ? v.x : axis == 1 ? v.y : v.z; }

}  // namespace

NearestTriangle::NearestTriangle(const Tin& tin)
    : tin_(tin), order_(DistinctTriangles(tin).list()) {
  while ((kLeaf << levels_) < order_.size()) ++levels_;
  nodes_.resize((std::size_t(2) << levels_) - 1);
  std::vector<Vec3> centres;
  centres.reserve(tin.triangles.size());
  for (const Triangle& t : tin.triangles)
    centres.push_back((tin.vertices[t[0]] + tin.vertices[t[1]] + tin.vertices[t[2]]) * (1.0 / 3));
  build(0, 0, order_.size(), 0, centres);
  constexpr double kMany = 64;
  if (in_the_way() <= kMany) return;
  cells_.emplace(tin, order_);
  add_planes();
}

/// How many triangles a search for a place on the mesh looks at, at least: those in leaves around
/// it.
double NearestTriangle::in_the_way() const {
  constexpr std::size_t kPlaces = 64;
  double looked_at = 0;
  for (std::size_t k = 0; k < kPlaces; ++k) {
    const Triangle& t = tin_.triangles[order_[k * order_.size() / kPlaces]];
    const Vec3 p = (tin_.vertices[t[0]] + tin_.vertices[t[1]] + tin_.vertices[t[2]]) * (1.0 / 3);
    std::vector<std::size_t> open{0};
    while (!open.empty()) {
      const std::size_t node = open.back();
      open.pop_back();
      if (away(nodes_[node], p) > 0) continue;
      if (2 * node + 2 < nodes_.size())
        open.insert(open.end(), {2 * node + 1, 2 * node + 2});
      else
        looked_at += kLeaf;
    }
  }
  return looked_at / kPlaces;
}

void NearestTriangle::add_planes() {
  planes_.reserve(order_.size());
  for (const std::uint32_t i : order_) {
    const Triangle& t = tin_.triangles[i];
    const Vec3 &a = tin_.vertices[t[0]], ab = tin_.vertices[t[1]] - a, ac = tin_.vertices[t[2]] - a,
               n = cross(ab, ac);
    // Any direction will do that its corners are measured along.
    const Vec3 d = length(n) > 0 ? n * (1 / length(n)) : Vec3{0, 0, 1};
    const double along_b = dot(d, ab), along_c = dot(d, ac);
    const double low = std::min({0.0, along_b, along_c}), high = std::max({0.0, along_b, along_c});
    planes_.push_back({d, dot(d, a) + (low + high) / 2,
                       (high - low) / 2 + rounding_at(a) + rounding_at(ab) + rounding_at(ac)});
  }
}

void NearestTriangle::build(std::size_t node, std::size_t begin, std::size_t end, int level,
                            std::vector<Vec3>& centres) {
  const auto lower = [](const Vec3& p, const Vec3& q) {
    return Vec3{std::min(p.x, q.x), std::min(p.y, q.y), std::min(p.z, q.z)};
  };
  const auto upper = [](const Vec3& p, const Vec3& q) {
    return Vec3{std::max(p.x, q.x), std::max(p.y, q.y), std::max(p.z, q.z)};
  };
  Box box{{1e300, 1e300, 1e300}, {-1e300, -1e300, -1e300}};
  Vec3 extent;  // of all triangles, one after the other
  for (std::size_t i = begin; i < end; ++i) {
    const Triangle& t = tin_.triangles[order_[i]];
    const Vec3 &a = tin_.vertices[t[0]], &b = tin_.vertices[t[1]], &c = tin_.vertices[t[2]];
    const Vec3 low = lower(a, lower(b, c)), high = upper(a, upper(b, c));
    box.low = lower(box.low, low), box.high = upper(box.high, high);
    extent = extent + (high - low);
  }
  if (box.low.x <= box.high.x) add_slabs(box, begin, end);
  nodes_[node] = box;
  if (level == levels_) return;
  const Vec3 size = box.high - box.low;
  const auto side_by_side = [](double whole, double parts) {
    return whole > 0 ? whole / std::max(parts, 1e-9 * whole) : 0;
  };
  const double x = side_by_side(size.x, extent.x), y = side_by_side(size.y, extent.y);
  const double z = side_by_side(size.z, extent.z);
  const int axis = x >= y && x >= z ? 0 : y >= z ? 1 : 2;
  const std::size_t middle = begin + (end - begin) / 2;
  std::nth_element(order_.begin() + std::ptrdiff_t(begin), order_.begin() + std::ptrdiff_t(middle),
                   order_.begin() + std::ptrdiff_t(end), [&](std::uint32_t s, std::uint32_t t) {
                     const double a = component(centres[s], axis), b = component(centres[t], axis);
                     return a != b ? a < b : s < t;
                   });
  build(2 * node + 1, begin, middle, level + 1, centres);
  build(2 * node + 2, middle, end, level + 1, centres);
}

/// Of the directions across the triangles' longest edges, the two in which the box is most wider
/// than they are; none where that saves less than half of both.
void NearestTriangle::add_slabs(Box& box, std::size_t begin, std::size_t end) {
  const Vec3 size = box.high - box.low, middle = (box.low + box.high) * 0.5;
  const auto corner = [&](std::size_t i, int k) -> const Vec3& {
    return tin_.vertices[tin_.triangles[order_[i]][k]];
  };
  Vec3 along;
  for (std::size_t i = begin; i < end; ++i) {
    const Vec3 edge = longest_edge(corner(i, 0), corner(i, 1), corner(i, 2));
    along = dot(along, edge) < 0 ? along - edge : along + edge;
  }
  struct Candidate {
    double saved;
    Slab slab;
  };
  std::array<Candidate, 3> all{};
  for (int axis = 0; axis < 3; ++axis) {
    const Vec3 across = cross(along, {double(axis == 0), double(axis == 1), double(axis == 2)});
    if (!(length(across) > 0)) continue;
    const Vec3 d = across * (1 / length(across));
    double low = HUGE_VAL, high = -HUGE_VAL;
    for (std::size_t i = begin; i < end; ++i)
      for (int k = 0; k < 3; ++k) {
        const double t = dot(d, corner(i, k) - middle);
        low = std::min(low, t), high = std::max(high, t);
      }
    const double wide = std::abs(d.x) * size.x + std::abs(d.y) * size.y + std::abs(d.z) * size.z;
    all[std::size_t(axis)] = {wide - (high - low),
                              {d, dot(d, middle) + (low + high) / 2,
                               (high - low) / 2 + rounding_at(middle) + rounding_at(size)}};
  }
  std::ranges::sort(all, std::greater{}, &Candidate::saved);
  if (!(all[0].saved > 0.5 * (all[0].saved + 2 * all[0].slab.half))) return;
  box.slabs = std::uint32_t(slabs_.size());
  slabs_.push_back({all[0].slab, all[1].slab});
}

double NearestTriangle::away(const Box& b, const Vec3& p) const {
  const double x = std::max({b.low.x - p.x, 0.0, p.x - b.high.x});
  const double y = std::max({b.low.y - p.y, 0.0, p.y - b.high.y});
  const double z = std::max({b.low.z - p.z, 0.0, p.z - b.high.z});
  double squared = x * x + y * y + z * z;
  if (b.slabs == kNone) return squared;
  for (const Slab& slab : slabs_[b.slabs]) {
    const double outside =
        std::abs(dot(slab.direction, p) - slab.middle) - slab.half - rounding_at(p);
    if (outside > 0) squared = std::max(squared, outside * outside);
  }
  return squared;
}

// Both go down to leaves, the nearer one of two first, and leave out what is farther than `best`,
// which `leaf` makes better.

template <class Leaf>
void NearestTriangle::search_boxes(const Vec3& p, const NearestPoint& best, Leaf leaf) const {
  struct Entry {
    double squared;
    std::size_t node, begin, end;
    int level;
  };
  std::array<Entry, 64> stack;
  int n = 0;
  stack[n++] = {away(nodes_[0], p), 0, 0, order_.size(), 0};
  while (n > 0) {
    const Entry e = stack[--n];
    if (e.squared > best.squared) continue;
    if (e.level == levels_) {
      for (std::size_t i = e.begin; i < e.end; ++i) leaf(i);
      continue;
    }
    const std::size_t middle = e.begin + (e.end - e.begin) / 2;
    Entry left{away(nodes_[2 * e.node + 1], p), 2 * e.node + 1, e.begin, middle, e.level + 1};
    Entry right{away(nodes_[2 * e.node + 2], p), 2 * e.node + 2, middle, e.end, e.level + 1};
    if (left.squared < right.squared) std::swap(left, right);
    stack[n++] = left;  // the farther one waits
    stack[n++] = right;
  }
}

template <class Leaf>
void NearestTriangle::search_cells(const Vec3& p, const NearestPoint& best, Leaf leaf) const {
  using Cell = TriangleCells::Cell;
  struct Entry {
    double squared;
    const Cell* cell;
  };
  const std::vector<Cell>& cells = cells_->cells();
  const auto entry = [&](const Cell& cell) -> Entry {
    return {away({cell.low, cell.high}, p), &cell};
  };
  std::array<Entry, 64> stack;
  int n = 0;
  stack[n++] = entry(cells[0]);
  while (n > 0) {
    const Entry e = stack[--n];
    if (e.squared > best.squared) continue;
    if (e.cell->leaf) {
      for (std::uint32_t k = 0; k < e.cell->count; ++k) leaf(cells_->members()[e.cell->first + k]);
      continue;
    }
    Entry left = entry(cells[e.cell->first]), right = entry(cells[e.cell->first + 1]);
    if (left.squared < right.squared) std::swap(left, right);
    stack[n++] = left;
    stack[n++] = right;
  }
}

NearestPoint NearestTriangle::find(const Vec3& p, std::uint32_t hint) const {
  auto measure = [&](std::uint32_t t) {
    const Triangle& c = tin_.triangles[t];
    NearestPoint n = nearest_on(tin_.vertices[c[0]], tin_.vertices[c[1]], tin_.vertices[c[2]], p);
    n.triangle = t;
    return n;
  };
  NearestPoint best = measure(hint);
  const double rounding = rounding_at(p);
  std::uint32_t looked_at = 1;
  const auto look_at = [&](std::size_t i) {
    ++looked_at;
    if (!planes_.empty() && is_beyond(planes_[i], p, rounding, best.squared)) return;
    const NearestPoint m = measure(order_[i]);
    // Of equally near triangles the lowest, so that the hint does not decide.
    if (m.squared < best.squared || (m.squared == best.squared && m.triangle < best.triangle))
      best = m;
  };
  if (cells_)
    search_cells(p, best, look_at);
  else
    search_boxes(p, best, look_at);
  best.looked_at = looked_at;
  return best;
}

}  // namespace tind
