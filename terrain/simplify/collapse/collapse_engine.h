#pragma once
// The engine that all edge-collapse methods share. A method has four parts:
//
//   cost       what collapsing an edge costs            } Cost::propose
//   placement  where the merged vertex goes             }
//   filter     whether the collapse may happen at all     Filter::allows
//   stop       when enough has been collapsed             CollapseStop
//
// A method brings Cost and Filter as plain types (no virtual call per edge):
//
//   struct Cost {
//     /// True when no collapse ever makes another edge cheaper (sums of quadrics). The engine then
//     /// evaluates an edge only when its turn comes, never around a collapse.
//     static constexpr bool kOnlyGrows;
//     /// Cost (>= 0) and position for edge h, which is any one of the two half-edges; kNever when
//     /// this edge must stay. Called again each time: nothing is stored per edge.
//     Proposal propose(const HalfedgeMesh&, Index h);
//     /// Called just before the collapse of h (origin(h) vanishes into dest(h)) to `at`, e.g. to
//     /// merge quadrics.
//     void merge(const HalfedgeMesh&, Index h, const Vec3& at);
//     /// The cost alone, or nearly: where the edge waits until its turn comes. Only where
//     propose()
//     /// takes long.
//     float estimate(const HalfedgeMesh&, Index h);
//   };
//   struct Filter {
//     /// True when the star that the collapse of h to `at` leaves is acceptable.
//     bool allows(const HalfedgeMesh&, Index h, const Vec3& at);
//   };
//
// A CollapseRecorder, if there is one, is told each collapse before it is made.
//
// Which end vanishes: the one that is not on the border; when both or none are, origin(h). The
// engine itself checks the link condition. It sets aside edges that a filter refuses, and tries
// them again when something near them has changed.
//
// Order: cheapest first to within 9 % (BucketQueue). Inside a bucket the engine works in rounds: a
// vertex that has been merged in a round waits for the next. So equal costs (plateaus) thin out
// evenly, and no vertex rolls over the whole plateau. Deterministic. O((collapses + edges) *
// degree).

#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

#include "terrain/base/progress.h"
#include "terrain/mesh/halfedge_mesh.h"
#include "terrain/simplify/collapse/bucket_queue.h"
#include "terrain/simplify/common/collapse_recorder.h"

namespace tind {

inline constexpr float kNever = std::numeric_limits<float>::infinity();

struct Proposal {
  float cost = kNever;
  Vec3 position;
};

template <class Cost>
concept Estimates = requires(Cost& cost, const HalfedgeMesh& mesh, HalfedgeMesh::Index h) {
  cost.estimate(mesh, h);
};

struct CollapseStop {
  std::size_t triangles = 0;  // stop as soon as at most so many are left
  float cost = kNever;        // stop at the first bucket above this cost
};

struct CollapseRun {
  std::uint64_t collapses = 0;
  bool reached = false;  // at most stop.triangles are left, or stop.cost is reached
  bool cancelled = false;
};

/// True iff h may collapse without changing the topology; as HalfedgeMesh::link_ok, but fast for
/// edges inside the mesh.
bool collapse_keeps_manifold(const HalfedgeMesh&, HalfedgeMesh::Index h);

/// Collapses edges of `mesh` in place until `stop`, or until no edge is left that may go.
/// `recorder` (not owned) hears of each.
template <class Cost, class Filter>
CollapseRun collapse_edges(HalfedgeMesh& mesh, Cost& cost, Filter& filter, const CollapseStop& stop,
                           const Progress& progress = {}, CollapseRecorder* recorder = nullptr);

// ---- implementation -------------------------------------------------------------------------

namespace detail {

template <class Cost, class Filter>
class CollapseEngine {
 public:
  using Index = HalfedgeMesh::Index;
  static constexpr Index kNone = HalfedgeMesh::kNone;
  using Bucket = BucketQueue::Bucket;

  CollapseEngine(HalfedgeMesh& mesh, Cost& cost, Filter& filter, const CollapseStop& stop,
                 const Progress& progress, CollapseRecorder* recorder)
      : mesh_(mesh),
        cost_(cost),
        filter_(filter),
        stop_(stop),
        progress_(progress),
        recorder_(recorder),
        queue_(mesh.halfedge_slots()),
        state_(mesh.vertex_slots()),
        start_(mesh.triangle_count()) {
    for (Index v = 0; v < state_.size(); ++v)
      state_[v] = {0, true, mesh.alive_vertex(v) && mesh.on_border(v)};
  }

  CollapseRun run() {
    do {
      const std::uint64_t before = run_.collapses;
      push_all();
      drain();
      if (run_.collapses == before) break;
    } while (!run_.reached && !run_.cancelled);
    return run_;
  }

 private:
  struct VertexState {
    std::uint32_t merged_in : 30;   // the round of its last merge
    std::uint32_t near_change : 1;  // its star has changed since the last push_all
    std::uint32_t border : 1;
  };

  struct Candidate {
    Index h;
    Proposal proposal;
  };
  static constexpr std::size_t kChunk = 128;

  HalfedgeMesh& mesh_;
  Cost& cost_;
  Filter& filter_;
  const CollapseStop& stop_;
  const Progress& progress_;
  CollapseRecorder* recorder_;
  BucketQueue queue_;
  std::vector<VertexState> state_;  // per vertex
  std::vector<Index> batch_;
  std::vector<Candidate> candidates_;
  CollapseRun run_;
  std::uint32_t round_ = 0;
  std::size_t start_;

  /// An edge is entered under the lower of its two half-edges.
  Index edge(Index h) const {
    const Index g = mesh_.twin(h);
    return g < h ? g : h;
  }

  /// So oriented that the end which vanishes is the origin.
  Index oriented(Index h) const {
    const Index g = mesh_.twin(h);
    if (g == kNone) return h;
    return state_[mesh_.origin(h)].border && !state_[mesh_.dest(h)].border ? g : h;
  }

  void push(Index e) {
    float c;
    if constexpr (Estimates<Cost>)
      c = cost_.estimate(mesh_, e);
    else
      c = cost_.propose(mesh_, e).cost;
    if (c < kNever) queue_.push(e, BucketQueue::bucket_of(c));
  }

  bool enough() const { return mesh_.triangle_count() <= stop_.triangles; }

  void push_all() {
    for (Index h = 0; h < mesh_.halfedge_slots(); ++h) {
      if (!mesh_.alive_triangle(h / 3) || edge(h) != h || queue_.queued(h)) continue;
      if (state_[mesh_.origin(h)].near_change || state_[mesh_.dest(h)].near_change) push(h);
    }
    for (VertexState& v : state_) v.near_change = false;
  }

  void drain() {
    const Bucket last =
        stop_.cost < kNever ? BucketQueue::bucket_of(stop_.cost) : BucketQueue::kAbsent;
    for (;;) {
      if (enough()) {
        run_.reached = true;
        return;
      }
      const Bucket b = queue_.next_batch(batch_);
      if (b == BucketQueue::kAbsent) return;
      if (b > last) {
        run_.reached = true;
        return;
      }
      ++round_;
      for (std::size_t i = 0; i < batch_.size() && !enough(); i += kChunk) {
        propose_chunk(i, b);
        for (const Candidate& c : candidates_) look_around(c.h);
        for (const Candidate& c : candidates_) visit(c, b);
      }
      if (progress_.stopped()) {
        run_.cancelled = true;
        return;
      }
      const std::size_t goal = start_ - std::min(stop_.triangles, start_);
      if (goal > 0) progress_.at(double(start_ - mesh_.triangle_count()) / double(goal));
    }
  }

  // Almost all time goes into waiting for memory. A batch says long in advance which edges come
  // next. So they are taken in chunks and in three steps. Each step prefetches what the next one
  // will read, and works on other edges meanwhile.

  /// The edges of the chunk that still cost what their bucket says, with their placement; the
  /// others go back into the queue.
  void propose_chunk(std::size_t begin, Bucket b) {
    candidates_.clear();
    const std::size_t end = std::min(begin + kChunk, batch_.size());
    for (std::size_t i = begin; i < end; ++i) {
      look_ahead(i, b);
      const Index e = batch_[i];
      if (!queue_.take(e, b)) continue;
      if (!mesh_.alive_triangle(e / 3) || edge(e) != e) continue;
      if (merged_now(e)) {
        queue_.push(e, b);
        continue;
      }
      const Index h = oriented(e);
      const Proposal p = cost_.propose(mesh_, h);
      if (!(p.cost < kNever)) continue;
      const Bucket now = BucketQueue::bucket_of(p.cost);
      if (now > b)
        queue_.push(e, now);
      else
        candidates_.push_back({h, p});
    }
  }

  bool merged_now(Index h) const {
    return state_[mesh_.origin(h)].merged_in == round_ || state_[mesh_.dest(h)].merged_in == round_;
  }

  [[gnu::always_inline]] void look_ahead(std::size_t i, Bucket b) const {
    constexpr std::size_t kFar = 24, kNear = 12;
    if (i + kFar < batch_.size()) {
      const Index h = batch_[i + kFar];
      queue_.prefetch(h);
      mesh_.prefetch_halfedge(h);
    }
    if (i + kNear < batch_.size()) {
      const Index h = batch_[i + kNear];
      if (!queue_.in_bucket(h, b) || !mesh_.alive_triangle(h / 3)) return;
      const Index g = mesh_.twin(h);
      if (g != kNone) mesh_.prefetch_halfedge(g);
      for (const Index v : {mesh_.origin(h), mesh_.dest(h)}) {
        mesh_.prefetch_vertex(v);
        __builtin_prefetch(&state_[v]);
        if constexpr (requires { cost_.prefetch(v); }) cost_.prefetch(v);
      }
    }
  }

  /// Prefetches the ring around an edge that is likely to collapse.
  [[gnu::always_inline]] void look_around(Index h) const {
    const Index g = mesh_.twin(h);
    if (g == kNone) return;
    look_at_fan(h, HalfedgeMesh::next(g));
    look_at_fan(g, HalfedgeMesh::next(h));
  }
  [[gnu::always_inline]] void look_at_fan(Index e, Index last) const {
    for (int k = 0; k < 12 && e != kNone && e != last; ++k) {
      const Index v = mesh_.apex(e);
      mesh_.prefetch_vertex(v);
      __builtin_prefetch(&state_[v]);
      e = mesh_.rotate_ccw(e);
    }
  }

  /// The turn of a candidate, oriented so that its origin goes: may it?
  void visit(const Candidate& c, Bucket b) {
    if (enough() || !mesh_.alive_triangle(c.h / 3)) return;
    if (merged_now(c.h)) {  // by another candidate of the chunk: its placement is out of date
      queue_.push(edge(c.h), b);
      return;
    }
    if (filter_.allows(mesh_, c.h, c.proposal.position) && collapse_keeps_manifold(mesh_, c.h))
      apply(c.h, c.proposal);
  }

  void apply(Index h, const Proposal& p) {
    const Index removed = mesh_.origin(h), kept = mesh_.dest(h);
    if (recorder_) recorder_->collapse(collapse_of(mesh_, h, p.position));
    cost_.merge(mesh_, h, p.position);
    mesh_.collapse(h);
    mesh_.position(kept) = p.position;
    state_[kept] = {round_, true, state_[kept].border || state_[removed].border};
    ++run_.collapses;
    mesh_.for_each_out(kept, [&](Index k) {
      state_[mesh_.dest(k)].near_change = true;
      requeue(k);
      // The last spoke of a border fan has no half-edge that leaves `kept`.
      if (mesh_.twin(HalfedgeMesh::prev(k)) == kNone) {
        state_[mesh_.apex(k)].near_change = true;
        requeue(HalfedgeMesh::prev(k));
      }
      if constexpr (!Cost::kOnlyGrows) push(edge(HalfedgeMesh::next(k)));
    });
  }

  /// A spoke of a merged vertex. Where costs only grow, its place in the queue is still a lower
  /// bound and stays; otherwise it may have become cheaper.
  void requeue(Index k) {
    const Index e = edge(k);
    if (!Cost::kOnlyGrows || !queue_.queued(e)) push(e);
  }
};

}  // namespace detail

template <class Cost, class Filter>
CollapseRun collapse_edges(HalfedgeMesh& mesh, Cost& cost, Filter& filter, const CollapseStop& stop,
                           const Progress& progress, CollapseRecorder* recorder) {
  return detail::CollapseEngine(mesh, cost, filter, stop, progress, recorder).run();
}

}  // namespace tind
