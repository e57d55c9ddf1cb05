// The edits of `bounded`, in order of use: insert, sweep, directed search, ring yield, relax.

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
      eps_(options.eps - 1e-9 * std::max(1.0, options.eps)) {}

// --- insert --------------------------------------------------------------------------------------

template <class S>
void BoundedMesher<S>::insert(const Progress& progress) {
  InsertionOptions o;
  o.limit = eps_;
  o.x_scale = options_.x_scale;
  o.integer_lattice = options_.integer_lattice;
  o.lattice_max = options_.lattice_max;
  o.height_step = options_.height_step;
  DelaunayInsertion<S> insertion(mesh_, samples_, o);
  insertion.run_passes(progress);
  stats_.inserted = insertion.insertions();
}

// --- the star ------------------------------------------------------------------------------------

/// The ring of the star that edge h's two ends leave behind; false when the mesh would pinch.
template <class S>
bool BoundedMesher<S>::gather_ring(Index h) {
  const Index v = mesh_.origin(h), w = mesh_.dest(h);
  ring_.clear();
  mesh_.for_each_out(v, [&](Index e) {
    const Index p = mesh_.dest(e), q = mesh_.apex(e);
    if (p != w && q != w) ring_.push_back({p, q});
  });
  return true;
}

template <class S>
void BoundedMesher<S>::gather_fan(Index v) {
  ring_.clear();
  mesh_.for_each_out(v, [&](Index e) { ring_.push_back({mesh_.dest(e), mesh_.apex(e)}); });
}

template <class S>
bool BoundedMesher<S>::ring_ccw(const Vec3& apex) const {
  for (const RingEdge& e : ring_)
    if (!surely_ccw(apex, mesh_.position(e[0]), mesh_.position(e[1]))) return false;
  return true;
}

/// Intersects `room` with what the samples of triangle (w, e) allow. A sample that the apex carries
/// with weight l > 0 needs |z - rest - l h| <= eps, where rest is what the ring's two heights give.
template <class S>
bool BoundedMesher<S>::narrow(const Vec3& w, RingEdge e, Interval& room, double eps,
                              bool stop_when_empty) const {
  const Vec3 &a = mesh_.position(e[0]), &b = mesh_.position(e[1]);
  const double ax = a.x - w.x, ay = a.y - w.y, bx = b.x - w.x, by = b.y - w.y;
  const double inverse = 1 / (ax * by - ay * bx);
  const double lx = (ay - by) * inverse, ly = (bx - ax) * inverse;
  const double rx = (a.z * by - b.z * ay) * inverse, ry = (b.z * ax - a.z * bx) * inverse;
  double lo = room.lo, hi = room.hi;
  const bool whole = samples_.scan(w, a, b, [&](double x, double y, double z, std::size_t) {
    const double dx = x - w.x, dy = y - w.y;
    const double l = 1 + (lx * dx + ly * dy);
    if (l < 1e-9) return true;  // on the ring: the apex has no say
    const double r = z - (rx * dx + ry * dy);
    if (r - eps > lo * l) lo = (r - eps) / l;
    if (r + eps < hi * l) hi = (r + eps) / l;
    return lo <= hi || !stop_when_empty;
  });
  room = {lo, hi};
  return whole;
}

/// The room over all of ring_, starting from `start`.
template <class S>
typename BoundedMesher<S>::Interval BoundedMesher<S>::room(const Vec3& apex, Interval start,
                                                           bool stop_when_empty) {
  for (const RingEdge& e : ring_)
    if (!narrow(apex, e, start, eps_, stop_when_empty)) break;
  return start;
}

/// The centre of the room, on the height step if there is one; false when nothing fits. Where the
/// samples say little (a wide room: they carry hardly any weight of the apex) the apex stays in the
/// range of what is around it rather than to fly off.
template <class S>
bool BoundedMesher<S>::choose_height(Interval room, double before, double& height) const {
  if (!(room.lo <= room.hi)) return false;
  double h = (room.lo + room.hi) / 2;
  if (!(room.hi - room.lo <= 4 * eps_)) {
    double low = before, high = before;
    for (const RingEdge& e : ring_) {
      low = std::min(low, mesh_.position(e[0]).z);
      high = std::max(high, mesh_.position(e[0]).z);
    }
    if (!std::isfinite(h)) h = before;
    h = std::clamp(std::clamp(h, low, high), room.lo, room.hi);
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
  if (!mesh_.alive_vertex(v) || v < options_.pinned) return false;
  return !mesh_.on_border(v) || (!options_.locked_border && straight_border(v));
}

/// Vertices in blocks, row of blocks by row of blocks, so that neighbours in the list are
/// neighbours in the samples' memory.
template <class S>
std::vector<typename BoundedMesher<S>::Index> BoundedMesher<S>::spatial_order() const {
  Vec3 low{kInfinity, kInfinity, 0}, high{-kInfinity, -kInfinity, 0};
  for (Index v = 0; v < mesh_.vertex_slots(); ++v) {
    const Vec3& p = mesh_.position(v);
    low = {std::min(low.x, p.x), std::min(low.y, p.y), 0};
    high = {std::max(high.x, p.x), std::max(high.y, p.y), 0};
  }
  const std::size_t n = mesh_.vertex_slots();
  const int side = std::clamp(int(std::sqrt(double(n) / 16)), 1, 4096);
  const double sx = side / std::max(1e-9, high.x - low.x),
               sy = side / std::max(1e-9, high.y - low.y);
  auto key = [&](Index v) {
    const Vec3& p = mesh_.position(v);
    const int i = std::min(side - 1, int((p.x - low.x) * sx));
    const int j = std::min(side - 1, int((high.y - p.y) * sy));
    return std::size_t(j) * side + (j % 2 ? side - 1 - i : i);
  };
  std::vector<Index> start(std::size_t(side) * side + 1, 0), order(n);
  for (Index v = 0; v < n; ++v) ++start[key(v) + 1];
  for (std::size_t i = 1; i < start.size(); ++i) start[i] += start[i - 1];
  for (Index v = 0; v < n; ++v) order[start[key(v)]++] = v;
  return order;
}

template <class S>
void BoundedMesher<S>::mark_ring() {
  for (const RingEdge& e : ring_) dirty_[e[0]] = dirty_[e[1]] = 1;
}

/// Collapses h to `apex` if the star stays valid and within the band.
template <class S>
bool BoundedMesher<S>::collapse_at(Index h, const Vec3& apex) {
  const Index v = mesh_.origin(h), w = mesh_.dest(h);
  (void)v;
  if (!mesh_.link_ok(h)) return false;
  mark_ring();
  mesh_.collapse(h);
  mesh_.position(w) = apex;
  dirty_[w] = 1;
  return true;
}

/// Tries to make v vanish into one of its neighbours, which then takes the height that suits all.
template <class S>
bool BoundedMesher<S>::try_targets(Index v, bool search) {
  const bool border = mesh_.on_border(v);
  std::array<Index, 64> edges;
  std::size_t count = 0;
  if (border) {
    edges[count++] = mesh_.out(v);
    edges[count++] = border_before(v);
  } else {
    mesh_.for_each_out(v, [&](Index e) {
      if (count < edges.size()) edges[count++] = e;
    });
  }
  const Vec3 here = mesh_.position(v);
  struct Near {
    double gap = kInfinity;
    Index edge = kNone;
    Vec3 apex;
  } best;
  for (std::size_t k = 0; k < count; ++k) {
    const Index h = edges[k];
    const Index w = mesh_.origin(h) == v ? mesh_.dest(h) : mesh_.origin(h);
    const Vec3 target = mesh_.position(w);
    const bool fixed = options_.locked_border && mesh_.on_border(w);
    gather_ring(mesh_.origin(h) == v ? h : h);
    if (mesh_.origin(h) != v) {  // the border edge that arrives at v: v's fan is its dest's
      ring_.clear();
      mesh_.for_each_out(v, [&](Index e) {
        const Index p = mesh_.dest(e), q = mesh_.apex(e);
        if (p != w && q != w) ring_.push_back({p, q});
      });
    }
    if (!ring_ccw(target)) continue;
    // The triangle that takes over v's own place is the likeliest to fail: look there first.
    for (std::size_t i = 1; i < ring_.size(); ++i) {
      if (orient2d(target, mesh_.position(ring_[i][0]), here) >= 0 &&
          orient2d(target, mesh_.position(ring_[i][1]), here) <= 0) {
        std::swap(ring_[0], ring_[i]);
        break;
      }
    }
    if (!fixed) {
      mesh_.for_each_out(w, [&](Index e) {
        const Index p = mesh_.dest(e), q = mesh_.apex(e);
        if (p != v && q != v) ring_.push_back({p, q});
      });
    }
    const Interval start = fixed ? Interval{target.z, target.z} : Interval{-kInfinity, kInfinity};
    Vec3 apex = target;
    const Interval r = room(target, start, true);
    if (choose_height(r, target.z, apex.z)) {
      if (collapse_at(h, apex)) {
        ++stats_.swept;
        return true;
      }
      continue;
    }
    (void)best;
  }
  (void)search;
  return false;
}

template <class S>
std::uint64_t BoundedMesher<S>::sweep(bool search, const Progress& progress) {
  std::uint64_t done = 0, seen = 0;
  for (const Index v : spatial_order()) {
    if ((++seen & 1023) == 0 && progress.stopped()) break;
    if (!dirty_[v] || !may_vanish(v)) continue;
    dirty_[v] = 0;
    done += try_targets(v, search);
  }
  return done;
}

template <class S>
void BoundedMesher<S>::run(const Progress& progress) {
  insert(progress);
  dirty_.assign(mesh_.vertex_slots(), 1);
  sweep(false, progress);
}

template class BoundedMesher<GridSamples>;
template class BoundedMesher<ScatteredSamples>;

}  // namespace tind
