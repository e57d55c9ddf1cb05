// Sutherland and Hodgman's clipping of each triangle by two half-planes. Vertices are shared by
// number throughout: an edge is cut once, whichever of its triangles comes first.
//
// The middle line lies at 16383.5, between two places of the lattice, so no vertex of the parent is
// on it; a cut of the first line may be on the second, which the rule "zero is inside" covers.

#include "terrain/tile/parent_part.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>

namespace tind {

namespace {

constexpr double kExtent = 32767, kMiddle = kExtent / 2;
using Polygon = std::vector<std::uint32_t>;

/// One half-plane: x (axis 0) or y (axis 1) below the middle, or above.
class Cutter {
 public:
  Cutter(std::vector<Vec3>& vertices, int axis, bool high)
      : vertices_(vertices), axis_(axis), sign_(high ? 1 : -1) {}

  Polygon clip(const Polygon& in) {
    Polygon out;
    for (std::size_t i = 0; i < in.size(); ++i) {
      const std::uint32_t a = in[i], b = in[(i + 1) % in.size()];
      const double sa = side(a), sb = side(b);
      if (sa >= 0) out.push_back(a);
      if (sa * sb < 0) out.push_back(cut(a, b));
    }
    return out;
  }

 private:
  std::vector<Vec3>& vertices_;
  int axis_;
  double sign_;
  std::map<std::array<std::uint32_t, 2>, std::uint32_t> cuts_;

  double along(const Vec3& v) const { return axis_ == 0 ? v.x : v.y; }
  double side(std::uint32_t v) const { return sign_ * (along(vertices_[v]) - kMiddle); }

  std::uint32_t cut(std::uint32_t a, std::uint32_t b) {
    const auto [found, fresh] = cuts_.try_emplace({std::min(a, b), std::max(a, b)}, 0);
    if (!fresh) return found->second;
    Vec3 p = vertices_[a], q = vertices_[b];
    if (q.x < p.x || (q.x == p.x && q.y < p.y)) std::swap(p, q);
    const double s = (kMiddle - along(p)) / (along(q) - along(p));
    Vec3 v = p + (q - p) * s;
    (axis_ == 0 ? v.x : v.y) = kMiddle;
    // An edge through the centre meets both lines there, not one of them a bit beside it.
    if (double& other = axis_ == 0 ? v.y : v.x; std::abs(other - kMiddle) < 1e-6) other = kMiddle;
    // An edge along a side of the square keeps to it.
    if (p.x == q.x) v.x = p.x;
    if (p.y == q.y) v.y = p.y;
    vertices_.push_back(v);
    return found->second = std::uint32_t(vertices_.size() - 1);
  }
};

/// The fan whose thinnest triangle is the widest. False when none is valid.
bool triangulate(const Polygon& p, const std::vector<Vec3>& at, std::vector<Triangle>& out) {
  const std::size_t n = p.size();
  std::size_t best = n;
  double widest = 0;
  for (std::size_t k = 0; k < n; ++k) {
    double thinnest = HUGE_VAL;
    for (std::size_t i = 1; i + 1 < n; ++i) {
      const Vec3 &a = at[p[k]], &b = at[p[(k + i) % n]], &c = at[p[(k + i + 1) % n]];
      thinnest = std::min(thinnest, surely_ccw(a, b, c) ? orient2d(a, b, c) : 0);
    }
    if (thinnest > widest) widest = thinnest, best = k;
  }
  if (best == n) return false;
  for (std::size_t i = 1; i + 1 < n; ++i)
    out.push_back({p[best], p[(best + i) % n], p[(best + i + 1) % n]});
  return true;
}

}  // namespace

Result<Tin> parent_part(const Tin& parent, TileId child) {
  const bool east = child.x % 2 == 1, north = child.y % 2 == 1;
  std::vector<Vec3> vertices = parent.vertices;
  Cutter by_x(vertices, 0, east), by_y(vertices, 1, north);
  Tin part;
  for (const Triangle& t : parent.triangles) {
    const Polygon polygon = by_y.clip(by_x.clip({t[0], t[1], t[2]}));
    if (polygon.size() < 3) continue;
    if (!triangulate(polygon, vertices, part.triangles)) {
      const Vec3& v = parent.vertices[t[0]];
      return fail(Errc::bad_data, "the parent of " + child.text() +
                                      " has a triangle without area at " + std::to_string(v.x) +
                                      ", " + std::to_string(v.y));
    }
  }
  // Only what is used, in the order of first use, in the child's numbers.
  std::vector<std::uint32_t> number(vertices.size(), ~0u);
  for (Triangle& t : part.triangles) {
    for (std::uint32_t& v : t) {
      if (number[v] == ~0u) {
        number[v] = std::uint32_t(part.vertices.size());
        const Vec3& p = vertices[v];
        part.vertices.push_back(
            {2 * p.x - (east ? kExtent : 0), 2 * p.y - (north ? kExtent : 0), p.z});
      }
      v = number[v];
    }
  }
  if (part.triangles.empty())
    return fail(Errc::bad_data, "the parent of " + child.text() + " does not cover it");
  return part;
}

}  // namespace tind
