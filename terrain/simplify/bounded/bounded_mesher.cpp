// The edits of `bounded`, in order of use: insert, sweep, directed search, relax, flip.

#include "terrain/simplify/bounded/bounded_mesher.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <limits>

#include "terrain/mesh/triangle_plane.h"

namespace tind {

namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// In the middle half of a room. What needs no change leaves the most to what comes later, and the
/// triangles that know nothing but it need not be asked.
bool near_middle(double height, const Room& room) {
  const double quarter = (room.hi - room.lo) / 4;
  return height >= room.lo + quarter && height <= room.hi - quarter;
}

}  // namespace

template <class S>
BoundedMesher<S>::BoundedMesher(HalfedgeMesh mesh, const S& samples, const MesherOptions& options)
    : mesh_(std::move(mesh)),
      samples_(samples),
      options_(options),
      eps_(options.eps -
           std::min(options.eps / 2, 1e-9 * std::max({1.0, options.eps, options.relief}))),
      star_(samples, {eps_, options.height_step, options.height_min, options.height_max,
                      options.search_step_min}),
      around_(star_) {}

// --- insert --------------------------------------------------------------------------------------

template <class S>
InsertionOptions BoundedMesher<S>::insertion_options() const {
  InsertionOptions o;
  o.limit = eps_;
  o.x_scale = options_.x_scale;
  o.any_place = options_.any_place;
  o.locked_border = options_.locked_border;
  o.integer_lattice = options_.integer_lattice;
  o.lattice_max = options_.lattice_max;
  o.lattice_step = options_.lattice_step;
  o.height_step = options_.height_step;
  return o;
}

template <class S>
void BoundedMesher<S>::insert(const Progress& progress) {
  DelaunayInsertion<S> insertion(mesh_, samples_, insertion_options());
  insertion.keep(lines_);
  insertion.run_passes(progress);
  stats_.inserted = insertion.insertions();
  origin_ = insertion.take_origins();
}

/// How far a triangle's samples are beyond the band, all together.
template <class S>
double BoundedMesher<S>::excess(const Vec3& a, const Vec3& b, const Vec3& c) const {
  const auto [gx, gy] = gradient(a, b, c);
  double sum = 0;
  samples_.scan(a, b, c, [&](double x, double y, double z, std::size_t) {
    sum += std::max(0.0, std::abs(a.z + (gx * (x - a.x) + gy * (y - a.y)) - z) - eps_);
    return true;
  });
  return sum;
}

/// `excess_here`: of the triangle of h.
template <class S>
bool BoundedMesher<S>::turn_if_better(Index h, double excess_here) {
  const Index twin = mesh_.twin(h), v = mesh_.origin(h), w = mesh_.dest(h);
  if (twin == kNone || lines_->keeps(v, w)) return false;
  const Vec3 &a = mesh_.position(v), &b = mesh_.position(w);
  const Vec3 &c = mesh_.position(mesh_.apex(h)), &d = mesh_.position(mesh_.apex(twin));
  if (!S::takes(a, d, c) || !S::takes(d, b, c)) return false;
  if (!(excess(a, d, c) + excess(d, b, c) < excess_here + excess(b, a, d))) return false;
  mesh_.flip(h);
  return true;
}

/// Insertion gives up a sample where a vertex stands already, its place rounded. A line's vertices
/// on both sides may then have an edge just beside that vertex, and the triangle between is far too
/// steep for what rounding took from the place: the edge that crosses it is a better one.
template <class S>
void BoundedMesher<S>::turn_edges(const Progress& progress) {
  constexpr int kMostPasses = 8;
  bool turned = true;
  for (int pass = 0; pass < kMostPasses && turned && !progress.stopped(); ++pass) {
    turned = false;
    for (Index h = 0; h < mesh_.halfedge_slots(); h += 3) {
      if (!mesh_.alive_triangle(h / 3)) continue;
      const double here = excess(mesh_.position(mesh_.origin(h)), mesh_.position(mesh_.dest(h)),
                                 mesh_.position(mesh_.apex(h)));
      if (here > 0)
        turned = turn_if_better(h, here) || turn_if_better(h + 1, here) ||
                 turn_if_better(h + 2, here) || turned;
    }
  }
}

/// The same of a peak a few units wide: where its neighbours are no vertices, because the mesh was
/// flat there before, an edge that passes just beside it leaves room for no better one.
template <class S>
void BoundedMesher<S>::surround_peaks(const Progress& progress) {
  constexpr std::size_t kMost = 4096;  // of which it is worth it
  std::vector<Vec3> peaks;
  for (Index t = 0; t < mesh_.halfedge_slots() / 3; ++t) {
    if (!mesh_.alive_triangle(t)) continue;
    const Vec3 &a = mesh_.position(mesh_.origin(3 * t)), &b = mesh_.position(mesh_.dest(3 * t)),
               &c = mesh_.position(mesh_.apex(3 * t));
    const auto [gx, gy] = gradient(a, b, c);
    samples_.scan(a, b, c, [&](double x, double y, double z, std::size_t) {
      if (std::abs(a.z + (gx * (x - a.x) + gy * (y - a.y)) - z) > eps_) peaks.push_back({x, y, z});
      return peaks.size() <= kMost;
    });
    if (peaks.size() > kMost || progress.stopped()) return;
  }
  if (peaks.empty()) return;
  const std::vector<Vec3> origins = std::move(origin_);
  DelaunayInsertion<S> insertion(mesh_, samples_, insertion_options());
  insertion.keep(lines_);
  for (const Vec3& p : peaks) {
    const double r = options_.surround;
    const Vec3 south_west{p.x - r, p.y - r, 0}, north_east{p.x + r, p.y + r, 0};
    const auto add = [&](double x, double y, double z, std::size_t) {
      const Vec3 at{std::round(x), std::round(y),
                    std::clamp(snap_height(z, options_.height_step), options_.height_min,
                               options_.height_max)};
      const double most = options_.lattice_max;  // borders stay as they are
      if (at.x > 0 && at.y > 0 && at.x < most && at.y < most) insertion.insert_point(at);
      return true;
    };
    samples_.scan(south_west, {p.x + r, p.y - r, 0}, north_east, add);
    samples_.scan(south_west, north_east, {p.x - r, p.y + r, 0}, add);
  }
  insert(progress);
  for (Index v = 0; v < std::min(origins.size(), origin_.size()); ++v) origin_[v] = origins[v];
}

// --- sweep ---------------------------------------------------------------------------------------

template <class S>
bool BoundedMesher<S>::straight_border(Index v) const {
  const Index out = mesh_.out(v), in = mesh_.border_in(v);
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
  assert(mesh_.link_ok(h));
  const Index w = mesh_.dest(h);
  for (const auto& e : star_.ring()) dirty_[e.from] = dirty_[e.to] = 1;
  mesh_.collapse(h);
  mesh_.position(w) = apex;
  dirty_[w] = 1;
}

/// The half-edges between v and the vertices that it may vanish into.
template <class S>
std::span<const typename BoundedMesher<S>::Index> BoundedMesher<S>::edges_to_targets(Index v) {
  edges_.clear();
  if (mesh_.on_border(v)) {
    edges_.push_back(mesh_.out(v));
    // Along this one it is the other vertex that vanishes, and v that goes on in its place: what is
    // held (a line's end, a corner of a block) would be held no more.
    const Index in = mesh_.border_in(v), from = mesh_.origin(in);
    if (!stays(from) && from >= options_.pinned) edges_.push_back(in);
  } else {
    mesh_.for_each_out(v, [&](Index e) { edges_.push_back(e); });
  }
  return edges_;
}

/// The star that neighbour k would get: all edges around v but its own. Inside, edge k of v's ring
/// starts there; a border vertex has two targets, at the ring's two ends.
template <class S>
void BoundedMesher<S>::take_over(std::size_t k, bool at_border) {
  const auto ring = std::span(around_.ring());
  star_.clear();
  if (at_border) {
    star_.add(k == 0 ? ring.subspan(1) : ring.first(ring.size() - 1));
  } else {
    star_.add(ring.subspan(k + 1, ring.size() - 1 - k - (k == 0)));
    if (k > 1) star_.add(ring.first(k - 1));
  }
}

/// Tries to make v vanish into one of its neighbours, which then takes the height that suits all.
template <class S>
bool BoundedMesher<S>::try_targets(Index v, bool search) {
  star_.remember(origin_[v]);
  // An edge that is not feasible is of interest only if it is the nearest to it so far.
  double give_up = search ? options_.search_reach * eps_ : 0;
  around_.clear();
  around_.add(mesh_, v);
  const bool at_border = mesh_.on_border(v);
  const auto edges = edges_to_targets(v);
  Index best_edge = kNone;
  Room closest = {kInfinity, 0};
  for (std::size_t k = 0; k < edges.size(); ++k) {
    const Index h = edges[k];
    const Index w = mesh_.origin(h) == v ? mesh_.dest(h) : mesh_.origin(h);
    const Vec3 target = mesh_.position(w);
    take_over(k, at_border);
    if (!star_.aim(target)) continue;
    const bool fixed = (options_.locked_border && mesh_.on_border(w)) || stays(w);
    const double limit = fixed ? 0 : give_up;
    Room room;
    if (fixed) {
      room = {target.z, target.z, target, target};
    } else {
      // Before anything is scanned: do v's and w's own samples agree?
      const Vec3& own = origin_[w];
      if (own.x == target.x && own.y == target.y && !std::isnan(own.z))
        room = {own.z - eps_, own.z + eps_, own, own};
    }
    star_.ask_witnesses(target, room, limit);
    if (room.gap() > limit) continue;
    star_.narrow(target, room, limit);
    if (room.gap() > limit) continue;
    Vec3 apex = target;
    bool feasible = near_middle(target.z, room);
    if (!feasible) {
      // w has to move up or down: what do the samples of its own triangles say?
      const std::size_t own_triangles = star_.ring().size();
      star_.add_kept(mesh_, w, h);
      star_.aim(target);
      star_.narrow(target, room, limit, own_triangles);
      feasible = star_.choose_height(target, room, target.z, apex.z);
    }
    // That w sees every edge of v's ring from its left says that an inner edge may collapse; the
    // border is another matter.
    if (feasible && (!at_border || mesh_.link_ok(h))) {
      collapse(h, apex);
      ++stats_.swept;
      return true;
    }
    if (search && room.gap() <= give_up && room.gap() < closest.gap() && may_move(v) &&
        may_move(w)) {
      closest = room;
      give_up = std::max(0.0, room.gap());
      best_edge = h;
    }
  }
  if (best_edge == kNone) return false;
  star_.remember(closest);
  return directed_search(best_edge, mesh_.position(mesh_.dest(best_edge)), closest.gap());
}

// --- directed search -----------------------------------------------------------------------------

constexpr std::array<Vec2, 8> kAround = {
    {{1, 0}, {0, 1}, {-1, 0}, {0, -1}, {1, 1}, {-1, 1}, {-1, -1}, {1, -1}}};

/// Moves the apex that edge h would collapse into so as to close the gap between what the samples
/// below and above ask of its height: first to where least squares put it, then by a pattern search
/// over eight directions, halving the step.
template <class S>
bool BoundedMesher<S>::directed_search(Index h, const Vec3& start, double gap) {
  const Index v = mesh_.origin(h), w = mesh_.dest(h);
  const Vec3 a = mesh_.position(v), b = mesh_.position(w);
  star_.clear();
  star_.add_kept(mesh_, v, h);
  star_.add_kept(mesh_, w, h);
  const double unit = options_.search_step_min;
  double step = std::max(std::abs(a.x - b.x), std::abs(a.y - b.y)) / 4;
  step = std::max(unit, std::floor(step / unit) * unit);
  Vec3 at = start;
  const double least_gain = options_.step_gain * eps_;
  const auto try_at = [&](const Vec3& p, bool& done) {
    const double wanted = gap > 0 ? std::max(0.0, gap - least_gain) : gap;
    const Room r = star_.room(p, wanted);
    if (!(r.gap() < gap && r.gap() <= wanted)) return false;
    gap = r.gap();
    at = p;
    star_.remember(r);
    done = star_.choose_height(at, r, (a.z + b.z) / 2, at.z);
    if (done) collapse(h, at), ++stats_.searched;
    return true;
  };
  bool done = false;
  Vec3 middle{std::floor((a.x + b.x) / 2 / unit) * unit, std::floor((a.y + b.y) / 2 / unit) * unit,
              (a.z + b.z) / 2};
  if (!star_.aim(middle)) middle = start;
  if (star_.least_squares_step(middle) && try_at(middle, done) && done) return true;
  int tries = options_.search_tries;
  while (tries > 0) {
    bool moved = false;
    for (const Vec2& d : kAround) {
      if (--tries < 0) break;
      const Vec3 p{at.x + d.x * step, at.y + d.y * step, at.z};
      if (!star_.aim(p) || !try_at(p, done)) continue;
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
    star_.forget_witnesses();
    done += try_targets(v, search);
  }
  return done;
}

// --- rounds --------------------------------------------------------------------------------------

/// Moves v to the place near by where its samples leave the most room for its height, and puts it
/// into the middle of that room. This is what lets the next sweep find edges to collapse.
template <class S>
void BoundedMesher<S>::move_vertex(Index v) {
  star_.clear();
  star_.add(mesh_, v);
  const Vec3 before = mesh_.position(v);
  Vec3 at = before;
  star_.aim(at);
  Room best = star_.room(at, kInfinity);
  star_.remember(best);
  if (!(best.lo <= best.hi)) return;  // a sample that insertion gave up: leave it as it is
  const double unit = options_.search_step_min;
  double reach = kInfinity;
  for (const auto& e : star_.ring()) {
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
      if (!star_.aim(p)) continue;
      const double wanted = best.gap() - least_gain;
      const Room r = star_.room(p, wanted);
      if (!(r.gap() < wanted)) continue;
      best = r;
      at = p;
      star_.remember(r);
      moved = true;
      break;
    }
    if (moved) continue;
    if (step <= unit) break;
    step = std::max(unit, std::floor(step / 2 / unit) * unit);
  }
  if (!star_.choose_height(at, best, before.z, at.z)) return;
  stats_.moved += at != before;
  mesh_.position(v) = at;
}

template <class S>
void BoundedMesher<S>::relax(const Progress& progress) {
  std::uint64_t seen = 0;
  for (const Index v : spatial_order()) {
    if ((++seen & 1023) == 0 && progress.stopped()) return;
    star_.forget_witnesses();
    if (active_[v] && may_move(v)) move_vertex(v);
  }
}

/// Sum of the squared errors of a triangle's samples; infinite where one is beyond the band, or
/// from `limit` on.
template <class S>
double BoundedMesher<S>::squares(const Vec3& a, const Vec3& b, const Vec3& c, double limit) const {
  const auto [gx, gy] = gradient(a, b, c);
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
    if (!S::takes(a, d, c) || !S::takes(d, b, c)) continue;
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
  if (options_.surround > 0) surround_peaks(progress);
  if (lines_ && options_.turns) turn_edges(progress);
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

template <class S>
void BoundedMesher<S>::refine(const Progress& progress) {
  const Index before = mesh_.vertex_slots();
  insert(progress);
  origin_.resize(mesh_.vertex_slots(), {0, 0, std::numeric_limits<double>::quiet_NaN()});
  active_.assign(mesh_.vertex_slots(), 0);
  for (Index v = before; v < mesh_.vertex_slots(); ++v) {
    active_[v] = 1;
    mesh_.for_each_out(v, [&](Index h) { active_[mesh_.dest(h)] = 1; });
  }
  decimate(progress);
}

template class BoundedMesher<GridSamples>;
template class BoundedMesher<ScatteredSamples>;

}  // namespace tind
