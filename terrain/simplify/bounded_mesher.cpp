// The edits of `bounded`, in order of use: insert, sweep, directed search, relax, flip.

#include "terrain/simplify/bounded_mesher.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace tind {

namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

}  // namespace

template <class S>
BoundedMesher<S>::BoundedMesher(HalfedgeMesh mesh, const S& samples, const BoundedOptions& options)
    : mesh_(std::move(mesh)),
      samples_(samples),
      options_(options),
      eps_(options.eps - 1e-9 * std::max({1.0, options.eps, options.relief})) {}

// --- insert --------------------------------------------------------------------------------------

template <class S>
void BoundedMesher<S>::insert(const Progress& progress) {
  InsertionOptions o;
  o.limit = eps_;
  o.x_scale = options_.x_scale;
  o.locked_border = options_.locked_border;
  o.integer_lattice = options_.integer_lattice;
  o.lattice_max = options_.lattice_max;
  o.lattice_step = options_.lattice_step;
  o.height_step = options_.height_step;
  DelaunayInsertion<S> insertion(mesh_, samples_, o);
  insertion.keep(lines_);
  insertion.run_passes(progress);
  stats_.inserted = insertion.insertions();
  origin_ = insertion.take_origins();
}

// --- the star ------------------------------------------------------------------------------------

/// Adds the far edges of v's triangles to the ring, but for those that touch `except`.
template <class S>
void BoundedMesher<S>::add_to_ring(Index v, Index except) {
  mesh_.for_each_out(v, [&](Index e) {
    const Index p = mesh_.dest(e), q = mesh_.apex(e);
    if (p != except && q != except)
      ring_.push_back({p, q, mesh_.position(p), mesh_.position(q), 0, 0, 0, 0, 0});
  });
}

/// Makes `apex` the apex of the ring's triangles; false when one of them is not counter-clockwise
/// for certain (surely_ccw of tin.h, for all triangles without a branch). Whatever asks for room
/// does this before.
template <class S>
bool BoundedMesher<S>::aim(const Vec3& apex) {
  bool all = true;
  for (RingEdge& e : ring_) {
    e.ax = e.a.x - apex.x, e.ay = e.a.y - apex.y;
    e.bx = e.b.x - apex.x, e.by = e.b.y - apex.y;
    const double l = e.ax * e.by, r = e.ay * e.bx;
    e.area = l - r;
    all &= e.area > 3.3306690738754716e-16 * (std::abs(l) + std::abs(r));
  }
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

/// What the witnesses alone leave of the room, the last first; no further than needed when the gap
/// exceeds `give_up`.
template <class S>
void BoundedMesher<S>::ask_witnesses(const Vec3& apex, Interval& room, double give_up) {
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
        const double lo = (r - eps_) / l, hi = (r + eps_) / l;
        if (lo > room.lo) room.lo = lo, lowest_ = p;
        if (hi < room.hi) room.hi = hi, highest_ = p;
      }
      break;
    }
  }
}

/// Intersects `room` with what the samples of triangle (w, e) allow. A sample that the apex carries
/// with weight l > 0 needs |z - rest - l h| <= eps, where rest is what the ring's two heights give.
/// False as soon as the gap exceeds `give_up`.
template <class S>
bool BoundedMesher<S>::narrow(const Vec3& w, const RingEdge& e, Interval& room, double give_up) {
  const Facet f(w, e);
  double lo = room.lo, hi = room.hi;
  const double eps = eps_;
  // A sample asks for more than lo when it lies above the plane through the ring's two vertices and
  // the apex at lo, raised by eps; likewise with hi. All between the two planes say nothing new.
  Band band;
  band.x = w.x, band.y = w.y, band.z = e.a.z;
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
    if (raises) lo = (r - eps) / l, lowest_ = {x, y, z}, raise();
    if (lowers) hi = (r + eps) / l, highest_ = {x, y, z}, lower();
    return lo - hi <= give_up;
  };
  const bool whole = samples_.scan_outside(w, e.a, e.b, band, ask);
  if (!whole) add_witness(lowest_), add_witness(highest_);
  room = {lo, hi};
  return whole;
}

/// The room over all of ring_, starting from `start`. The triangle that ends the search goes to the
/// front: it is the likeliest to end the next one.
template <class S>
typename BoundedMesher<S>::Interval BoundedMesher<S>::room(const Vec3& apex, Interval start,
                                                           double give_up) {
  ask_witnesses(apex, start, give_up);
  if (start.gap() > give_up) return start;
  for (std::size_t i = 0; i < ring_.size(); ++i) {
    if (narrow(apex, ring_[i], start, give_up)) continue;
    std::swap(ring_[0], ring_[i]);
    break;
  }
  return start;
}

/// Clips the room to the band around what the samples of the star span.
template <class S>
void BoundedMesher<S>::keep_near_samples(const Vec3& apex, Interval& room) const {
  double low = kInfinity, high = -kInfinity;
  for (const RingEdge& e : ring_)
    samples_.scan(apex, e.a, e.b, [&](double, double, double z, std::size_t) {
      low = std::min(low, z);
      high = std::max(high, z);
      return true;
    });
  if (!(low <= high)) return;
  room.lo = std::max(room.lo, low - eps_);
  room.hi = std::min(room.hi, high + eps_);
}

/// The centre of the room, on the height step if there is one; false when nothing fits. Samples
/// that carry little of the apex's weight would let it fly far off between them: it stays within
/// the band around what its star's samples span. Where there are none, in a void, it stays in the
/// range of what is around it.
template <class S>
bool BoundedMesher<S>::choose_height(const Vec3& apex, Interval room, double before,
                                     double& height) const {
  if (!(room.lo <= room.hi)) return false;
  double h = (room.lo + room.hi) / 2;
  const double low = std::min(lowest_.z, highest_.z), high = std::max(lowest_.z, highest_.z);
  if (!(h >= low - eps_ && h <= high + eps_)) {  // these two alone do not vouch for it
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

// --- sweep ---------------------------------------------------------------------------------------

template <class S>
typename BoundedMesher<S>::Index BoundedMesher<S>::border_before(Index v) const {
  Index last = mesh_.out(v);
  mesh_.for_each_out(v, [&](Index e) { last = e; });
  return HalfedgeMesh::prev(last);  // the border half-edge that arrives at v
}

template <class S>
bool BoundedMesher<S>::straight_border(Index v) const {
  const Index out = mesh_.out(v), in = border_before(v);
  return orient2d(mesh_.position(mesh_.origin(in)), mesh_.position(v),
                  mesh_.position(mesh_.dest(out))) == 0;
}

template <class S>
bool BoundedMesher<S>::may_vanish(Index v) const {
  if (!mesh_.alive_vertex(v) || v < options_.pinned || stays(v)) return false;
  return !mesh_.on_border(v) || (!options_.locked_border && straight_border(v));
}

/// Vertices in blocks, row of blocks by row of blocks, so that neighbours in the list are
/// neighbours in the samples' memory.
template <class S>
std::vector<typename BoundedMesher<S>::Index> BoundedMesher<S>::spatial_order() const {
  Vec3 low{kInfinity, kInfinity, 0}, high{-kInfinity, -kInfinity, 0};
  std::size_t n = 0;
  for (Index v = 0; v < mesh_.vertex_slots(); ++v) {
    if (!mesh_.alive_vertex(v)) continue;
    ++n;
    const Vec3& p = mesh_.position(v);
    low = {std::min(low.x, p.x), std::min(low.y, p.y), 0};
    high = {std::max(high.x, p.x), std::max(high.y, p.y), 0};
  }
  const int side = std::clamp(int(std::sqrt(double(n) / 16)), 1, 4096);
  const double sx = side / std::max(1e-9, high.x - low.x);
  const double sy = side / std::max(1e-9, high.y - low.y);
  auto key = [&](Index v) {
    const Vec3& p = mesh_.position(v);
    const int i = std::min(side - 1, int((p.x - low.x) * sx));
    const int j = std::min(side - 1, int((high.y - p.y) * sy));
    return std::size_t(j) * side + (j % 2 ? side - 1 - i : i);
  };
  std::vector<Index> start(std::size_t(side) * side + 1, 0), order(n);
  for (Index v = 0; v < mesh_.vertex_slots(); ++v)
    if (mesh_.alive_vertex(v)) ++start[key(v) + 1];
  for (std::size_t i = 1; i < start.size(); ++i) start[i] += start[i - 1];
  for (Index v = 0; v < mesh_.vertex_slots(); ++v)
    if (mesh_.alive_vertex(v)) order[start[key(v)]++] = v;
  return order;
}

/// Collapses h into `apex`; everything around is worth another try.
template <class S>
void BoundedMesher<S>::collapse(Index h, const Vec3& apex) {
  const Index w = mesh_.dest(h);
  for (const RingEdge& e : ring_) dirty_[e.from] = dirty_[e.to] = 1;
  mesh_.collapse(h);
  mesh_.position(w) = apex;
  dirty_[w] = 1;
}

/// Tries to make v vanish into one of its neighbours, which then takes the height that suits all.
template <class S>
bool BoundedMesher<S>::try_targets(Index v, bool search) {
  std::array<Index, 64> edges;  // half-edges between v and the vertices that it may vanish into
  std::size_t count = 0;
  if (mesh_.on_border(v)) {
    edges[count++] = mesh_.out(v);
    edges[count++] = border_before(v);
  } else {
    mesh_.for_each_out(v, [&](Index e) {
      if (count < edges.size()) edges[count++] = e;
    });
  }
  if (!std::isnan(origin_[v].z)) add_witness(origin_[v]);
  // An edge that is not feasible is of interest only if it is the nearest to it so far.
  double give_up = search ? options_.search_reach * eps_ : 0;
  ring_.clear();
  add_to_ring(v, kNone);
  around_.swap(ring_);
  double best_gap = kInfinity;
  Index best_edge = kNone;
  std::array<Vec3, 2> closest;  // the samples that keep it from being feasible
  for (std::size_t k = 0; k < count; ++k) {
    const Index h = edges[k];
    const Index w = mesh_.origin(h) == v ? mesh_.dest(h) : mesh_.origin(h);
    const Vec3 target = mesh_.position(w);
    const bool fixed = (options_.locked_border && mesh_.on_border(w)) || stays(w);
    ring_.clear();
    for (const RingEdge& e : around_)
      if (e.from != w && e.to != w) ring_.push_back(e);
    if (!aim(target)) continue;
    Interval start = fixed ? Interval{target.z, target.z} : Interval{-kInfinity, kInfinity};
    lowest_ = highest_ = target;
    if (!fixed) {
      // Before anything is scanned: do v's and w's own samples agree?
      const Vec3& own = origin_[w];
      if (own.x == target.x && own.y == target.y && !std::isnan(own.z)) {
        start = Interval{own.z - eps_, own.z + eps_};
        lowest_ = highest_ = own;
      }
      ask_witnesses(target, start, give_up);
      if (start.gap() > give_up) continue;
      add_to_ring(w, v);
      aim(target);
    }
    const Interval r = room(target, start, fixed ? 0 : give_up);
    Vec3 apex = target;
    if (choose_height(target, r, target.z, apex.z) && mesh_.link_ok(h)) {
      collapse(h, apex);
      ++stats_.swept;
      return true;
    }
    if (search && r.gap() <= give_up && r.gap() < best_gap && may_move(v) && may_move(w)) {
      best_gap = r.gap();
      give_up = std::max(0.0, best_gap);
      best_edge = h;
      closest = {lowest_, highest_};
    }
  }
  if (best_edge == kNone) return false;
  add_witness(closest[0]), add_witness(closest[1]);
  return directed_search(best_edge, mesh_.position(mesh_.dest(best_edge)), best_gap);
}

// --- directed search -----------------------------------------------------------------------------

constexpr std::array<Vec2, 8> kAround = {
    {{1, 0}, {0, 1}, {-1, 0}, {0, -1}, {1, 1}, {-1, 1}, {-1, -1}, {1, -1}}};

/// Moves the apex of ring_ to where one Gauss-Newton step would make the sum of the squared errors
/// of the star's samples least (bounded_count.cpp has the derivation). False when the step leads
/// nowhere or out of the star.
template <class S>
bool BoundedMesher<S>::least_squares_step(Vec3& apex) {
  constexpr double kPrior = 0.02;  // as a sample at the apex: against flying off
  const Vec3 w = apex;
  double xx = 0, xy = 0, xz = 0, yy = 0, yz = 0, zz = kPrior, x = 0, y = 0, z = 0, reach = 0;
  for (const RingEdge& e : ring_) {
    const Vec3 a = e.a - w, b = e.b - w;
    const double per_area = 1 / (a.x * b.y - a.y * b.x);
    const double gx = (a.z * b.y - b.z * a.y) * per_area, gy = (b.z * a.x - a.z * b.x) * per_area;
    const double lx = (a.y - b.y) * per_area, ly = (b.x - a.x) * per_area;
    double bb = 0, br = 0;
    samples_.scan(w, e.a, e.b, [&](double px, double py, double pz, std::size_t) {
      const double u = px - w.x, v = py - w.y, weight = 1 + (lx * u + ly * v);
      bb += weight * weight;
      br += weight * (pz - (w.z + (gx * u + gy * v)));
      return true;
    });
    xx += bb * gx * gx, xy += bb * gx * gy, yy += bb * gy * gy;
    xz -= bb * gx, yz -= bb * gy, zz += bb;
    x -= br * gx, y -= br * gy, z += br;
    reach = std::max({reach, std::abs(a.x), std::abs(a.y)});
  }
  // The height follows; what is left is two by two, a little damped.
  const double k = 1 / zz, damp = 1e-2 * (xx + yy) + 1e-9;
  const double a = xx - xz * xz * k + damp, b = xy - xz * yz * k, d = yy - yz * yz * k + damp;
  const double p = x - xz * z * k, q = y - yz * z * k, det = a * d - b * b;
  if (!(det > 0)) return false;
  Vec2 step = {(d * p - b * q) / det, (a * q - b * p) / det};
  const double scale = std::min(1.0, reach / 2 / std::max(std::abs(step.x), std::abs(step.y)));
  const double unit = options_.search_step_min;
  for (const double share : {scale, scale / 2}) {
    const Vec3 at{w.x + std::nearbyint(step.x * share / unit) * unit,
                  w.y + std::nearbyint(step.y * share / unit) * unit, w.z};
    if (at.x == w.x && at.y == w.y) return false;
    if (!aim(at)) continue;
    apex = at;
    return true;
  }
  return false;
}

/// Moves the apex that edge h would collapse into so as to close the gap between what the samples
/// below and above ask of its height: first to where least squares put it, then by a pattern search
/// over eight directions, halving the step.
template <class S>
bool BoundedMesher<S>::directed_search(Index h, const Vec3& start, double gap) {
  const Index v = mesh_.origin(h), w = mesh_.dest(h);
  const Vec3 a = mesh_.position(v), b = mesh_.position(w);
  ring_.clear();
  add_to_ring(v, w);
  add_to_ring(w, v);
  const double unit = options_.search_step_min;
  double step = std::max(std::abs(a.x - b.x), std::abs(a.y - b.y)) / 4;
  step = std::max(unit, std::floor(step / unit) * unit);
  Vec3 at = start;
  const double least_gain = options_.step_gain * eps_;
  const auto try_at = [&](const Vec3& p, bool& done) {
    const double wanted = gap > 0 ? std::max(0.0, gap - least_gain) : gap;
    const Interval r = room(p, {-kInfinity, kInfinity}, wanted);
    if (!(r.gap() < gap && r.gap() <= wanted)) return false;
    gap = r.gap();
    at = p;
    add_witness(lowest_), add_witness(highest_);
    done = choose_height(at, r, (a.z + b.z) / 2, at.z) && mesh_.link_ok(h);
    if (done) collapse(h, at), ++stats_.searched;
    return true;
  };
  bool done = false;
  Vec3 middle{std::floor((a.x + b.x) / 2 / unit) * unit, std::floor((a.y + b.y) / 2 / unit) * unit,
              (a.z + b.z) / 2};
  if (!aim(middle)) middle = start;
  if (least_squares_step(middle) && try_at(middle, done) && done) return true;
  int tries = options_.search_tries;
  while (tries > 0) {
    bool moved = false;
    for (const Vec2& d : kAround) {
      if (--tries < 0) break;
      const Vec3 p{at.x + d.x * step, at.y + d.y * step, at.z};
      if (!aim(p) || !try_at(p, done)) continue;
      if (done) return true;
      moved = true;
      break;
    }
    if (moved) continue;
    if (step <= unit) break;
    step = std::max(unit, std::floor(step / 2 / unit) * unit);
  }
  return false;
}

template <class S>
std::uint64_t BoundedMesher<S>::sweep(bool search, const Progress& progress) {
  std::uint64_t done = 0, seen = 0;
  for (const Index v : spatial_order()) {
    if ((++seen & 1023) == 0 && progress.stopped()) break;
    if (!dirty_[v] || !may_vanish(v)) continue;
    dirty_[v] = 0;
    forget_witnesses();
    done += try_targets(v, search);
  }
  return done;
}

// --- rounds --------------------------------------------------------------------------------------

/// Moves v to the place near by where its samples leave the most room for its height, and puts it
/// into the middle of that room. This is what lets the next sweep find edges to collapse.
template <class S>
void BoundedMesher<S>::move_vertex(Index v) {
  ring_.clear();
  add_to_ring(v, kNone);
  const Vec3 before = mesh_.position(v);
  Vec3 at = before;
  aim(at);
  Interval best = room(at, {-kInfinity, kInfinity}, kInfinity);
  add_witness(lowest_), add_witness(highest_);
  if (!(best.lo <= best.hi)) return;  // a sample that insertion gave up: leave it as it is
  const double unit = options_.search_step_min;
  double reach = kInfinity;
  for (const RingEdge& e : ring_) {
    reach = std::min(reach, std::max(std::abs(e.a.x - at.x), std::abs(e.a.y - at.y)));
  }
  double step = std::max(unit, std::floor(reach / 4 / unit) * unit);
  const double least_gain = options_.step_gain * eps_;
  int tries = options_.move_tries;
  while (tries > 0 && std::isfinite(best.gap())) {
    bool moved = false;
    for (const Vec2& d : kAround) {
      if (--tries < 0) break;
      const Vec3 p{at.x + d.x * step, at.y + d.y * step, at.z};
      if (!aim(p)) continue;
      const double wanted = best.gap() - least_gain;
      const Interval r = room(p, {-kInfinity, kInfinity}, wanted);
      if (!(r.gap() < wanted)) continue;
      best = r;
      at = p;
      add_witness(lowest_), add_witness(highest_);
      moved = true;
      break;
    }
    if (moved) continue;
    if (step <= unit) break;
    step = std::max(unit, std::floor(step / 2 / unit) * unit);
  }
  if (!choose_height(at, best, before.z, at.z)) return;
  stats_.moved += at != before;
  mesh_.position(v) = at;
}

template <class S>
void BoundedMesher<S>::relax(const Progress& progress) {
  std::uint64_t seen = 0;
  for (const Index v : spatial_order()) {
    if ((++seen & 1023) == 0 && progress.stopped()) return;
    forget_witnesses();
    if (active_[v] && may_move(v)) move_vertex(v);
  }
}

/// Sum of the squared errors of a triangle's samples; infinite where one is beyond the band, or
/// from `limit` on.
template <class S>
double BoundedMesher<S>::squares(const Vec3& a, const Vec3& b, const Vec3& c, double limit) const {
  const double area = orient2d(a, b, c);
  const double gx = ((b.z - a.z) * (c.y - a.y) - (c.z - a.z) * (b.y - a.y)) / area;
  const double gy = ((c.z - a.z) * (b.x - a.x) - (b.z - a.z) * (c.x - a.x)) / area;
  double sum = 0;
  const bool whole = samples_.scan(a, b, c, [&](double x, double y, double z, std::size_t) {
    const double e = a.z + (gx * (x - a.x) + gy * (y - a.y)) - z;
    sum += e * e;
    return std::abs(e) <= eps_ && sum < limit;
  });
  return whole ? sum : kInfinity;
}

/// Flips edges where the other diagonal of the two triangles follows the samples better.
template <class S>
void BoundedMesher<S>::flip_edges(const Progress& progress) {
  constexpr double kWorthIt = 0.95;
  for (Index h = 0; h < mesh_.halfedge_slots(); ++h) {
    if ((h & 4095) == 0 && progress.stopped()) return;
    if (!mesh_.alive_triangle(h / 3) || mesh_.twin(h) == kNone || mesh_.twin(h) < h) continue;
    const Index v = mesh_.origin(h), w = mesh_.dest(h);
    if (!active_[v] || !active_[w] || (on_line(v) && on_line(w))) continue;
    const Vec3 &a = mesh_.position(v), &b = mesh_.position(w);
    const Vec3 &c = mesh_.position(mesh_.apex(h)), &d = mesh_.position(mesh_.apex(mesh_.twin(h)));
    if (!surely_ccw(a, d, c) || !surely_ccw(d, b, c)) continue;
    const double before = squares(a, b, c, kInfinity) + squares(b, a, d, kInfinity);
    const double limit = kWorthIt * before, first = squares(a, d, c, limit);
    if (!std::isfinite(before) || !(first < limit)) continue;
    if (first + squares(d, b, c, limit - first) < limit) mesh_.flip(h);
  }
}

template <class S>
void BoundedMesher<S>::decimate(const Progress& progress) {
  dirty_ = active_;
  sweep(options_.search, progress);
  if (!options_.search) return;
  for (int round = 0; round < options_.rounds && !progress.stopped(); ++round) {
    progress.at(0.5 + 0.5 * round / options_.rounds);
    relax(progress);
    if (options_.flips) flip_edges(progress);
    dirty_ = active_;
    sweep(true, progress);
  }
}

template <class S>
void BoundedMesher<S>::run(const Progress& progress) {
  insert(progress);
  progress.at(0.2);
  active_.assign(mesh_.vertex_slots(), 1);
  decimate(progress);
}

template <class S>
void BoundedMesher<S>::mend(std::vector<std::uint8_t> active, std::vector<std::uint8_t> frozen,
                            const Progress& progress) {
  active_ = std::move(active);
  frozen_ = std::move(frozen);
  origin_.assign(mesh_.vertex_slots(), {0, 0, std::numeric_limits<double>::quiet_NaN()});
  decimate(progress);
}

template class BoundedMesher<GridSamples>;
template class BoundedMesher<ScatteredSamples>;

}  // namespace tind
