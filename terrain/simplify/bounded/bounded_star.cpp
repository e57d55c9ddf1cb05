// The star's samples, scanned as few times and for as short as possible.

#include "terrain/simplify/bounded/bounded_star.h"

#include <algorithm>
#include <cmath>
#include <type_traits>

#include "terrain/simplify/common/star_fit.h"
#include "terrain/simplify/insertion/delaunay_insertion.h"

namespace tind {

template <class S>
void Star<S>::add_far_edge(const HalfedgeMesh& mesh, Index spoke) {
  const Index p = mesh.dest(spoke), q = mesh.apex(spoke);
  ring_.push_back({p, q, mesh.position(p), mesh.position(q), 0, 0, 0, 0, 0});
}

template <class S>
void Star<S>::add(const HalfedgeMesh& mesh, Index v) {
  mesh.for_each_out(v, [&](Index e) { add_far_edge(mesh, e); });
}

template <class S>
void Star<S>::add_kept(const HalfedgeMesh& mesh, Index v, Index h) {
  mesh.all_kept(v, h, [&](Index e) { return add_far_edge(mesh, e), true; });
}

/// surely_ccw of tin.h, for all triangles without a branch.
template <class S>
bool Star<S>::aim(const Vec3& apex) {
  bool all = true;
  for (RingEdge& e : ring_) {
    e.ax = e.a.x - apex.x, e.ay = e.a.y - apex.y;
    e.bx = e.b.x - apex.x, e.by = e.b.y - apex.y;
    const double l = e.ax * e.by, r = e.ay * e.bx;
    e.area = l - r;
    all &= surely_positive(l, r);
  }
  if constexpr (!std::is_same_v<S, GridSamples>)
    all = all &&
          std::ranges::all_of(ring_, [&](const RingEdge& e) { return S::takes(apex, e.a, e.b); });
  return all;
}

namespace {

/// How a height inside triangle (w, a, b) follows from that of its apex w: weight of the apex and
/// what a and b contribute, both linear in the place.
struct Facet {
  double wx, wy, lx, ly, rx, ry;
  template <class RingEdge>
  Facet(const Vec3& w, const RingEdge& e) : wx(w.x), wy(w.y) {
    const double inverse = 1 / e.area;
    lx = (e.ay - e.by) * inverse, ly = (e.bx - e.ax) * inverse;
    rx = (e.a.z * e.by - e.b.z * e.ay) * inverse, ry = (e.b.z * e.ax - e.a.z * e.bx) * inverse;
  }
  double weight(double x, double y) const { return 1 + (lx * (x - wx) + ly * (y - wy)); }
  double rest(double x, double y) const { return rx * (x - wx) + ry * (y - wy); }
};

constexpr double kNoWeight = 1e-13;  // on the ring: the apex has no say

}  // namespace

/// The last witness first.
template <class S>
void Star<S>::ask_witnesses(const Vec3& apex, Room& room, double give_up) const {
  const std::size_t count = std::min(witnesses_, witness_.size());
  for (std::size_t k = 0; k < count && !(room.gap() > give_up); ++k) {
    const Vec3& p = witness_[(witnesses_ - 1 - k) % witness_.size()];
    const double x = p.x - apex.x, y = p.y - apex.y;
    for (const RingEdge& e : ring_) {
      const double left = e.ax * y - e.ay * x, right = e.bx * y - e.by * x;
      if (!bool(int(left >= 0) & int(right <= 0) & int(e.area + right - left >= 0))) continue;
      const Facet f(apex, e);
      const double l = f.weight(p.x, p.y), r = p.z - f.rest(p.x, p.y);
      if (l > kNoWeight) {
        const double lo = (r - options_.eps) / l, hi = (r + options_.eps) / l;
        if (lo > room.lo) room.lo = lo, room.at_lo = p;
        if (hi < room.hi) room.hi = hi, room.at_hi = p;
      }
      break;
    }
  }
}

/// Intersects `room` with what the samples of one triangle allow; false as soon as the gap
/// exceeds `give_up`.
template <class S>
bool Star<S>::narrow_by(const RingEdge& e, const Vec3& apex, Room& room, double give_up) {
  const Facet f(apex, e);
  const double eps = options_.eps;
  double lo = room.lo, hi = room.hi;
  // A sample asks for more than lo when it lies above the plane through the ring's two vertices and
  // the apex at lo, raised by eps; likewise with hi. All between the two planes say nothing new.
  Band band;
  band.x = apex.x, band.y = apex.y, band.z = e.a.z;
  band.size = std::abs(e.b.z - e.a.z) + eps;
  const auto raise = [&] {
    band.top = lo + eps - band.z, band.top_x = lo * f.lx + f.rx, band.top_y = lo * f.ly + f.ry;
    band.size = std::max(band.size, std::abs(band.top));
  };
  const auto lower = [&] {
    band.bottom = hi - eps - band.z;
    band.bottom_x = hi * f.lx + f.rx, band.bottom_y = hi * f.ly + f.ry;
    band.size = std::max(band.size, std::abs(band.bottom));
  };
  raise(), lower();
  const auto ask = [&](double x, double y, double z, std::size_t) {
    const double l = f.weight(x, y), r = z - f.rest(x, y);
    const bool raises = r - eps > lo * l, lowers = r + eps < hi * l;
    if (!(raises || lowers) || l < kNoWeight) return true;
    if (raises) lo = (r - eps) / l, room.at_lo = {x, y, z}, raise();
    if (lowers) hi = (r + eps) / l, room.at_hi = {x, y, z}, lower();
    return lo - hi <= give_up;
  };
  const bool whole = samples_.scan_outside(apex, e.a, e.b, band, ask);
  room.lo = lo, room.hi = hi;
  if (!whole) remember(room);
  return whole;
}

/// The triangle that ends the search goes to the front: it is the likeliest to end the next one.
template <class S>
void Star<S>::narrow(const Vec3& apex, Room& room, double give_up, std::size_t first) {
  for (std::size_t i = first; i < ring_.size(); ++i) {
    if (narrow_by(ring_[i], apex, room, give_up)) continue;
    std::swap(ring_[first], ring_[i]);
    break;
  }
}

template <class S>
Room Star<S>::room(const Vec3& apex, double give_up) {
  Room room;
  ask_witnesses(apex, room, give_up);
  if (!(room.gap() > give_up)) narrow(apex, room, give_up);
  return room;
}

/// Clips the room to the band around what the samples of the star span.
template <class S>
void Star<S>::keep_near_samples(const Vec3& apex, Room& room) const {
  double low = HUGE_VAL, high = -HUGE_VAL;
  for (const RingEdge& e : ring_)
    samples_.scan(apex, e.a, e.b, [&](double, double, double z, std::size_t) {
      low = std::min(low, z);
      high = std::max(high, z);
      return true;
    });
  if (!(low <= high)) return;
  room.lo = std::max(room.lo, low - options_.eps);
  room.hi = std::min(room.hi, high + options_.eps);
}

template <class S>
bool Star<S>::choose_height(const Vec3& apex, Room room, double before, double& height) const {
  if (!(room.lo <= room.hi)) return false;
  const double eps = options_.eps;
  double h = (room.lo + room.hi) / 2;
  const double low = std::min(room.at_lo.z, room.at_hi.z);
  const double high = std::max(room.at_lo.z, room.at_hi.z);
  if (!(h >= low - eps && h <= high + eps)) {  // these two alone do not vouch for it
    keep_near_samples(apex, room);
    if (!(room.lo <= room.hi)) return false;
    h = (room.lo + room.hi) / 2;
  }
  if (!std::isfinite(h)) {
    double lowest = before, highest = before;
    for (const RingEdge& e : ring_) {
      lowest = std::min(lowest, e.a.z);
      highest = std::max(highest, e.a.z);
    }
    h = std::clamp(std::clamp(before, lowest, highest), room.lo, room.hi);
  }
  h = snap_height(h, options_.height_step);
  if (h < room.lo || h > room.hi || h < options_.height_min || h > options_.height_max)
    return false;
  height = h;
  return true;
}

template <class S>
bool Star<S>::least_squares_step(Vec3& apex) {
  const Vec3 w = apex;
  StarFit fit = StarFit::for_step();
  for (const RingEdge& e : ring_) fit.add(samples_, w, e.a, e.b);
  Vec2 step = fit.step_inside();
  const double unit = options_.place_step;
  for (int k = 0; k < 2; ++k, step = {step.x / 2, step.y / 2}) {
    const Vec3 at{w.x + std::nearbyint(step.x / unit) * unit,
                  w.y + std::nearbyint(step.y / unit) * unit, w.z};
    if (at.x == w.x && at.y == w.y) return false;
    if (!aim(at)) continue;
    apex = at;
    return true;
  }
  return false;
}

template class Star<GridSamples>;
template class Star<ScatteredSamples>;

}  // namespace tind
