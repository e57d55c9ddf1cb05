#pragma once
// Inserts samples into a Delaunay triangulation until no error is above a limit: greedy insertion
// [Garland95]. There are two drivers:
//
//   run_worst_first   the textbook order, one indexed heap of triangles: fewest insertions;
//                     run_to_low where a count ends it
//   run_passes        no heap: each pass gives every changed triangle its own worst sample. Up to a
//                     third more insertions in half the time; the right start when a decimation
//                     follows, which removes the surplus again
//
// Works on any HalfedgeMesh whose domain is convex. A border edge is split only where a sample lies
// exactly on it, and never when it is locked.

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <unordered_set>
#include <vector>

#include "terrain/base/progress.h"
#include "terrain/mesh/halfedge_mesh.h"
#include "terrain/mesh/triangle_plane.h"
#include "terrain/simplify/common/samples.h"
#include "terrain/simplify/insertion/line_points.h"

namespace tind {

struct InsertionOptions {
  double limit = 0;              // a sample farther than this from its triangle is inserted
  double x_scale = 1;            // metric length of an x unit over that of a y unit (Delaunay test)
  bool locked_border = false;    // border edges are not split
  bool integer_lattice = false;  // vertices go to the nearest integer position ...
  double lattice_max = 0;        // ... inside (0, lattice_max): borders are locked
  double lattice_step = 1;       // ... that is a multiple of this
  double height_step = 0;        // vertex heights are multiples of this (0: free)
  /// Places of samples are no whole numbers: one of which rounding cannot say on which side of an
  /// edge it lies splits that edge, so that no triangle is left without area.
  bool any_place = false;
};

/// InsertionOptions::x_scale for a post spacing. Nearly square posts count as square: the four
/// corners of a cell are cocircular then, for certain, and the diagonal that insertion happened to
/// make stays, instead of all being turned the same way (which costs a quarter more triangles).
inline double delaunay_x_scale(double spacing_x, double spacing_y) {
  const double scale = spacing_x / spacing_y;
  return std::abs(scale - 1) < 0.05 ? 1 : scale;
}

/// How many insertions before a count of triangles run_to_low may stop: within half a per cent of
/// it. Sixteen find an error as low as any around there.
inline std::uint64_t insertions_back(std::uint64_t triangles) {
  return std::min<std::uint64_t>(16, triangles / 400);
}

/// A height brought to the step that vertices may have.
inline double snap_height(double h, double step) {
  return step > 0 ? std::nearbyint(h / step) * step : h;
}

template <class Samples>
class DelaunayInsertion {
 public:
  using Index = HalfedgeMesh::Index;
  static constexpr Index kNone = HalfedgeMesh::kNone;

  DelaunayInsertion(HalfedgeMesh& mesh, const Samples& samples, const InsertionOptions& options)
      : mesh_(mesh), samples_(samples), options_(options) {
    options_.limit = std::max(0.0, options_.limit);  // below, no sample would be near enough ever
  }

  /// From now on the edges of `lines` (not owned) are never flipped, and their points are samples
  /// too. REQUIRES: samples on the lines are void, and sample numbers lie below samples.size(). The
  /// domain need not be convex then.
  void keep(LinePoints* lines) { lines_ = lines; }

  std::uint64_t insertions() const { return insertions_; }

  /// The sample behind each vertex slot (its true, unrounded place); NaN heights where there
  /// is none.
  std::vector<Vec3> take_origins() {
    origins_.resize(mesh_.vertex_slots(), {0, 0, std::numeric_limits<double>::quiet_NaN()});
    return std::move(origins_);
  }

  /// Restores the Delaunay property around new vertex v (all edges opposite to it). Appends every
  /// changed triangle to `touched`.
  void legalise(Index v) {
    touched_.clear();
    stack_.clear();
    mesh_.for_each_out(v, [&](Index h) {
      touched_.push_back(HalfedgeMesh::triangle(h));
      stack_.push_back(HalfedgeMesh::next(h));
    });
    while (!stack_.empty()) {
      const Index h = stack_.back();  // opposite to v in its triangle, v on its left
      stack_.pop_back();
      const Index g = mesh_.twin(h);
      if (g == kNone || is_line(h) || !inside_circle(h, g)) continue;
      touched_.push_back(HalfedgeMesh::triangle(g));
      // Now h runs from the far apex to v, and g's other two edges lie opposite to v.
      mesh_.flip(h);
      stack_.push_back(HalfedgeMesh::prev(h));
      stack_.push_back(HalfedgeMesh::next(mesh_.twin(h)));
    }
  }
  const std::vector<Index>& touched() const { return touched_; }

  /// Makes p a vertex (p must lie in the domain). False when a vertex is there already.
  bool insert_point(const Vec3& p) { return insert_at(first_alive(), p, true); }

  /// The same for a point near vertex `near`.
  bool insert_point(const Vec3& p, Index near) {
    return insert_at(HalfedgeMesh::triangle(mesh_.out(near)), p, false);
  }

  /// The triangle that holds a point of the domain, its border included, and one of its edges that
  /// the point lies on.
  struct Place {
    Index triangle = kNone, on = kNone;
    bool vertex = false;  // the point is a corner of it
  };
  /// kNone where the way there does not end: outside of the domain, or in circles, which walks over
  /// triangles that are not Delaunay may go in.
  Place locate(const Vec3& p) const { return locate(first_alive(), p); }

  void run_passes(const Progress& progress = {}) {
    std::vector<Index> now, next;
    for (Index t = 0; t < mesh_.triangle_slots(); ++t)
      if (mesh_.alive_triangle(t)) now.push_back(t);
    std::vector<std::uint8_t> queued(mesh_.triangle_slots(), 1);
    while (!now.empty() && !progress.stopped()) {
      next.clear();
      for (const Index t : now) {
        queued[t] = 0;
        if ((++tries_ & 63) == 0 && progress.stopped()) return;
        if (!insert_worst(t, progress)) continue;
        queued.resize(mesh_.triangle_slots(), 0);
        for (const Index changed : touched_) {
          if (!queued[changed]) next.push_back(changed);
          queued[changed] = 1;
        }
      }
      now.swap(next);
    }
  }

  /// Inserts the globally worst sample first; stops at the limit or at `max_triangles`.
  void run_worst_first(std::uint64_t max_triangles = ~std::uint64_t(0),
                       const Progress& progress = {}) {
    heap_.clear();
    place_.assign(place_.size(), kNone);
    for (Index t = 0; t < mesh_.triangle_slots(); ++t) refresh(t);
    for (std::uint64_t n = 0; !heap_.empty() && mesh_.triangle_count() < max_triangles; ++n) {
      if ((n & 1023) == 0 && progress.stopped()) return;
      insert_worst_of_all();
    }
  }

  /// As run_worst_first, but stops up to `back` insertions earlier: where the largest error is
  /// least. Each third insertion flips edges such that a sample near by is off by more than any was
  /// before, up to four times as much, until the next few insertions have mended that.
  /// COST: a copy of the mesh, one more scan of all samples.
  void run_to_low(std::uint64_t max_triangles, std::uint64_t back, const Progress& progress = {}) {
    run_worst_first(max_triangles - std::min(max_triangles, 2 * back), progress);
    if (heap_.empty() || mesh_.triangle_count() >= max_triangles) return;
    const HalfedgeMesh mesh = mesh_;
    const LinePoints lines = lines_ ? *lines_ : LinePoints{};
    const auto origins = origins_;
    const auto hopeless = hopeless_;
    const auto taken = taken_;
    const std::uint64_t insertions = insertions_;
    double least = remaining_error();
    std::uint64_t there = mesh_.triangle_count();
    while (!heap_.empty() && mesh_.triangle_count() < max_triangles) {
      if (progress.stopped()) return;
      insert_worst_of_all();
      if (!(remaining_error() <= least)) continue;
      least = remaining_error();
      there = mesh_.triangle_count();
    }
    if (there == mesh_.triangle_count()) return;
    mesh_ = mesh;
    if (lines_) *lines_ = lines;
    origins_ = origins;
    hopeless_ = hopeless;
    taken_ = taken;
    insertions_ = insertions;
    run_worst_first(there, progress);
  }

  /// The largest error among triangles still in the heap of run_worst_first; 0 when none.
  double remaining_error() const { return heap_.empty() ? 0 : worst_[heap_[0]].error; }

 private:
  struct Worst {
    double error = 0;
    std::size_t index = 0;
  };

  HalfedgeMesh& mesh_;
  const Samples& samples_;
  InsertionOptions options_;
  LinePoints* lines_ = nullptr;
  std::uint64_t insertions_ = 0;
  std::vector<Index> touched_, stack_;
  std::vector<Vec3> origins_;           // by vertex slot
  std::vector<std::uint8_t> hopeless_;  // by sample: it cannot become a vertex; empty: all can
  /// On the integer lattice: places at which there is a vertex, or the border, for good. Where
  /// posts are denser than places, one of each is tried, not all.
  std::unordered_set<std::uint64_t> taken_;
  std::uint64_t tries_ = 0;
  std::vector<Worst> worst_;         // by triangle slot
  std::vector<Index> heap_, place_;  // binary max-heap of triangles, and where each one is

  Worst worst_sample(Index t) const {
    const Vec3& a = mesh_.position(mesh_.origin(3 * t));
    const Vec3& b = mesh_.position(mesh_.origin(3 * t + 1));
    const Vec3& c = mesh_.position(mesh_.origin(3 * t + 2));
    const auto [gx, gy] = gradient(a, b, c);
    const double z0 = a.z - gx * a.x - gy * a.y;
    Worst worst;
    Band band{a.x,
              a.y,
              a.z,
              options_.limit,
              gx,
              gy,
              -options_.limit,
              gx,
              gy,
              std::max(std::abs(b.z - a.z), std::abs(c.z - a.z)) + options_.limit};
    const auto ask = [&](double x, double y, double z, std::size_t i) {
      const double e = std::abs(z0 + gx * x + gy * y - z);
      if (e > worst.error && e > options_.limit && !is_hopeless(i) && !is_taken(x, y)) {
        worst = {e, i};
        band.top = e, band.bottom = -e;
      }
      return true;
    };
    samples_.scan_outside(a, b, c, band, ask);
    if (lines_)
      lines_->scan(a, b, c,
                   [&](const Vec3& p, std::size_t k) { ask(p.x, p.y, p.z, samples_.size() + k); });
    return worst;
  }

  bool is_hopeless(std::size_t i) const { return i < hopeless_.size() && hopeless_[i] != 0; }
  bool give_up(std::size_t i) {
    if (i >= hopeless_.size()) hopeless_.resize(std::max(i + 1, samples_.size()), 0);
    hopeless_[i] = 1;
    return false;
  }

  /// REQUIRES: a lattice of at most 2^32 places a side.
  static std::uint64_t place_number(double x, double y) {
    return std::uint64_t(std::int64_t(x)) << 32 | std::uint32_t(std::int64_t(y));
  }
  bool is_taken(double x, double y) const {
    return !taken_.empty() && taken_.contains(place_number(on_lattice(x), on_lattice(y)));
  }

  double on_lattice(double x) const {
    const double step = options_.lattice_step;
    const double last = std::ceil(options_.lattice_max / step - 1) * step;
    return std::clamp(std::nearbyint(x / step) * step, step, last);
  }

  /// Inserts the worst sample of t that can become a vertex; false when none is above the limit, or
  /// on a stop.
  bool insert_worst(Index t, const Progress& progress) {
    for (;;) {
      if ((++tries_ & 63) == 0 && progress.stopped()) return false;
      const Worst worst = worst_sample(t);
      if (!(worst.error > options_.limit)) return false;
      if (insert(t, worst.index)) return true;
    }
  }

  /// Makes sample i a vertex; t is where to look first. False when it cannot become one.
  bool insert(Index t, std::size_t i) {
    if (lines_ && i >= samples_.size()) return insert_on_line(i);
    Vec3 p = samples_.sample(i);
    if (options_.integer_lattice) {
      p.x = on_lattice(p.x);
      p.y = on_lattice(p.y);
    }
    p.z = snap_height(p.z, options_.height_step);
    if (!insert_at(t, p, !options_.integer_lattice && !options_.locked_border)) return give_up(i);
    origins_.resize(mesh_.vertex_slots(), {0, 0, std::numeric_limits<double>::quiet_NaN()});
    origins_.back() = samples_.sample(i);
    return true;
  }

  bool insert_on_line(std::size_t i) {
    const Index v = lines_->insert(mesh_, i - samples_.size());
    if (v == kNone) return give_up(i);
    ++insertions_;
    legalise(v);
    return true;
  }

  bool is_line(Index h) const { return lines_ && lines_->keeps(mesh_.origin(h), mesh_.dest(h)); }

  /// Lines bring coordinates that are no small integers: will p leave room on both sides of every
  /// edge of triangle t, and of the one beyond `on`?
  bool has_room(Index t, Index on, const Vec3& p) const {
    const auto clear = [&](Index h) {
      return surely_ccw(mesh_.position(mesh_.origin(h)), mesh_.position(mesh_.dest(h)), p);
    };
    const auto all_clear = [&](Index first, Index except) {
      for (Index h = first; h < first + 3; ++h)
        if (h != except && !clear(h)) return false;
      return true;
    };
    if (!all_clear(3 * t, on)) return false;
    const Index beyond = on == kNone ? kNone : mesh_.twin(on);
    return beyond == kNone || all_clear(3 * HalfedgeMesh::triangle(beyond), beyond);
  }

  Index first_alive() const {
    Index t = 0;
    while (!mesh_.alive_triangle(t)) ++t;
    return t;
  }

  Place locate(Index t, const Vec3& p) const {
    for (std::size_t steps = 0;; ++steps) {
      Index out = kNone, on = kNone;
      int zeros = 0;
      for (Index h = 3 * t; h < 3 * t + 3; ++h) {
        const double side =
            orient2d(mesh_.position(mesh_.origin(h)), mesh_.position(mesh_.dest(h)), p);
        if (side < 0 && !(options_.any_place && barely(h, p))) out = h;
        if (side == 0) on = h, ++zeros;
      }
      if (out == kNone) return options_.any_place ? place_near(t, p) : Place{t, on, zeros >= 2};
      if (mesh_.twin(out) == kNone || steps > mesh_.triangle_slots()) return {};
      t = HalfedgeMesh::triangle(mesh_.twin(out));
    }
  }

  /// True where rounding cannot say whether p lies beside edge h.
  bool barely(Index h, const Vec3& p) const {
    const Vec3 &a = mesh_.position(mesh_.origin(h)), &b = mesh_.position(mesh_.dest(h));
    return !surely_ccw(a, b, p) && !surely_ccw(b, a, p);
  }

  /// Of a point in triangle t, or beside it by rounding. A border edge is met exactly or not at
  /// all.
  Place place_near(Index t, const Vec3& p) const {
    Place place{t, kNone, false};
    int near = 0;
    for (Index h = 3 * t; h < 3 * t + 3; ++h) {
      if (!barely(h, p)) continue;
      ++near;
      const bool border = mesh_.twin(h) == kNone;
      if (!border ||
          orient2d(mesh_.position(mesh_.origin(h)), mesh_.position(mesh_.dest(h)), p) == 0)
        place.on = h;
      else
        return {};
    }
    place.vertex = near >= 2;
    return place;
  }

  /// Makes p a vertex; looks for its triangle from t on (rounding may have moved p across an edge).
  bool insert_at(Index from, const Vec3& p, bool may_split_border) {
    const auto [t, on, vertex] = locate(from, p);
    const bool on_border = t != kNone && on != kNone && mesh_.twin(on) == kNone;
    if (vertex || (on_border && !may_split_border)) {
      if (options_.integer_lattice && !lines_) taken_.insert(place_number(p.x, p.y));
      return false;
    }
    if (t == kNone) return false;
    if (lines_ && ((on != kNone && is_line(on)) || !has_room(t, on, p))) return false;
    const Index v = on == kNone ? mesh_.split_triangle(t, p) : mesh_.split_edge(on, p);
    ++insertions_;
    legalise(v);
    return true;
  }

  /// True when the apex of twin g lies inside the circle through triangle h, and the edge can flip.
  bool inside_circle(Index h, Index g) const {
    const Vec3& a = mesh_.position(mesh_.origin(h));
    const Vec3& b = mesh_.position(mesh_.dest(h));
    const Vec3& c = mesh_.position(mesh_.apex(h));
    const Vec3& d = mesh_.position(mesh_.apex(g));
    const double s = options_.x_scale;
    const double ax = (a.x - d.x) * s, ay = a.y - d.y, bx = (b.x - d.x) * s, by = b.y - d.y;
    const double cx = (c.x - d.x) * s, cy = c.y - d.y;
    const double a2 = ax * ax + ay * ay, b2 = bx * bx + by * by, c2 = cx * cx + cy * cy;
    const double bc = bx * cy, cb = cx * by, ca = cx * ay, ac = ax * cy, ab = ax * by, ba = bx * ay;
    const double det = a2 * (bc - cb) + b2 * (ca - ac) + c2 * (ab - ba);
    // Shewchuk's bound: flip only when certain, so that flipping always ends.
    const double size = (std::abs(bc) + std::abs(cb)) * a2 + (std::abs(ca) + std::abs(ac)) * b2 +
                        (std::abs(ab) + std::abs(ba)) * c2;
    if (!(det > 2e-15 * size)) return false;
    return surely_ccw(a, d, c) && surely_ccw(d, b, c);
  }

  // --- the heap of run_worst_first ---------------------------------------------------------------

  void insert_worst_of_all() {
    const Index t = heap_[0];
    if (!insert(t, worst_[t].index)) {  // a sample that cannot become a vertex
      refresh(t);
      return;
    }
    for (const Index changed : touched_) refresh(changed);
  }

  bool worse(Index s, Index t) const {
    return worst_[s].error > worst_[t].error || (worst_[s].error == worst_[t].error && s < t);
  }
  void put(std::size_t at, Index t) {
    heap_[at] = t;
    place_[t] = Index(at);
  }
  void sift_up(std::size_t at, Index t) {
    for (; at > 0 && worse(t, heap_[(at - 1) / 2]); at = (at - 1) / 2) put(at, heap_[(at - 1) / 2]);
    put(at, t);
  }
  void sift_down(std::size_t at, Index t) {
    for (;;) {
      std::size_t child = 2 * at + 1;
      if (child >= heap_.size()) break;
      if (child + 1 < heap_.size() && worse(heap_[child + 1], heap_[child])) ++child;
      if (!worse(heap_[child], t)) break;
      put(at, heap_[child]);
      at = child;
    }
    put(at, t);
  }
  /// Measures triangle t again and moves it to where it belongs in the heap.
  void refresh(Index t) {
    if (worst_.size() < mesh_.triangle_slots()) {
      worst_.resize(mesh_.triangle_slots());
      place_.resize(mesh_.triangle_slots(), kNone);
    }
    worst_[t] = worst_sample(t);
    const bool bad = worst_[t].error > options_.limit;
    if (place_[t] == kNone) {
      if (!bad) return;
      heap_.push_back(t);
      sift_up(heap_.size() - 1, t);
      return;
    }
    const std::size_t at = place_[t];
    if (!bad) {
      const Index last = heap_.back();
      heap_.pop_back();
      place_[t] = kNone;
      if (last == t) return;
      sift_down(at, last);
      sift_up(place_[last], last);
      return;
    }
    sift_down(at, t);
    sift_up(place_[t], t);
  }
};

}  // namespace tind
