// Triangle collapse (PMTC). Weights only grow, but for the valence penalty: so a triangle's place
// in the queue is a lower bound, is looked at anew when its turn comes, and no step re-weighs its
// surroundings. That, and a third of the steps, is where the time goes (or does not).

#include "terrain/simplify/collapse/triangle_collapse.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <vector>

#include "terrain/simplify/collapse/collapse_method.h"
#include "terrain/simplify/collapse/placement.h"
#include "terrain/simplify/common/springs.h"

namespace tind {

namespace {

using Index = HalfedgeMesh::Index;
using Bucket = BucketQueue::Bucket;
using Quadric = QuadricN<3>;
constexpr Index kNone = HalfedgeMesh::kNone;

/// Weight of the planes that hold borders of general meshes in place.
constexpr double kBorderWeight = 10;
/// Triangles whose corners have more neighbours than this together are left alone.
constexpr int kLargestStencil = 48;
/// How many edges of the rim, cheapest first, may be refused before the step does without.
constexpr int kRimTries = 6;
/// Valence of the merged vertex that costs nothing extra, and what each edge above it costs.
constexpr int kFreeValence = 9;
constexpr float kValencePenalty = 0.25f;

/// Two buckets an octave: the order of near equals matters less than that one sweep over the
/// terrain finds many triangles to merge, each beside the last in memory (0.8 of the time, 1.01 of
/// the RMS).
Bucket bucket_of(float cost) { return Bucket(BucketQueue::bucket_of(cost) & ~3u); }

template <class Rules>
class Collapser {
 public:
  Collapser(HalfedgeMesh& mesh, Rules& rules, bool centroid)
      : mesh_(mesh),
        rules_(rules),
        centroid_(centroid),
        vertex_(mesh.vertex_slots()),
        queue_(mesh.triangle_slots()) {
    for (Index t = 0; t < mesh_.triangle_slots(); ++t) add_quadric(t);
    for (Index v = 0; v < mesh_.vertex_slots(); ++v)
      if (mesh_.alive_vertex(v))
        vertex_[v].degree = std::uint16_t(std::min(mesh_.degree(v), 0xffff));
  }

  /// Steps until at most `target` triangles are left or none can go. False when told to stop.
  bool run(std::size_t target, const Progress& progress);

  /// From now on tells every edge collapse, also the two that a triangle's is made of, and leaves
  /// alone the triangles for which the mesh between these two would not be valid.
  void tell(CollapseRecorder& recorder) { recorder_ = &recorder; }

  std::uint64_t steps() const { return steps_; }

 private:
  /// What the turn of a triangle would do: merge all of it, or only edge `edge`.
  struct Move {
    float cost = kNever;
    Index edge = kNone;
    Vec3 edge_to;          // where the edge merges
    Index pinned = kNone;  // the triangle's corner that cannot move, if any
  };

  /// One cache line: what a weight needs of a corner beside its position.
  struct alignas(64) Vertex {
    Quadric q;                     // relative to the vertex
    std::uint32_t changed_in = 0;  // the round of its last merge
    std::uint16_t degree = 0;
  };

  struct Candidate {
    Index triangle;
    Move move;
  };
  static constexpr std::size_t kChunk = 128;

  HalfedgeMesh& mesh_;
  Rules& rules_;
  bool centroid_;
  std::vector<Index> batch_;
  std::vector<Candidate> candidates_;
  std::vector<Vertex> vertex_;
  BucketQueue queue_;
  std::uint32_t round_ = 0;
  std::uint64_t steps_ = 0;
  std::size_t target_ = 0;
  bool edges_only_ = false;
  CollapseRecorder* recorder_ = nullptr;

  const Vec3& at(Index v) const { return mesh_.position(v); }
  OffsetN<3> offset(const Vec3& from, const Vec3& to) const {
    const Vec3 m = metric_offset(rules_, from, to);
    return {float(m.x), float(m.y), float(m.z)};
  }
  Quadric seen_from(Index v, const Vec3& origin) const {
    Quadric q = vertex_[v].q;
    q.move_origin(offset(at(v), origin));
    return q;
  }
  std::size_t missing() const {
    return mesh_.triangle_count() > target_ ? mesh_.triangle_count() - target_ : 0;
  }

  void add_quadric(Index t);
  Move weigh(Index t) const;
  Move weigh_edges(Index h, bool border_only) const;
  float triangle_cost(Index h, Index pinned) const;
  Vec3 place_triangle(Index h, Index pinned) const;
  bool may_merge(Index h, const Vec3& p) const;
  std::optional<Vec3> waypoint(Index h, const Vec3& p) const;
  void tell_collapse(Index h, const Vec3& p) const;
  Index merge_triangle(Index h, const Vec3& p, const Vec3& between);
  Index merge_edge(Index h, const Vec3& p);
  void collapse_rim_edge(Index centre);
  void look_again_around(Index v, Bucket b);
  bool step(Index t, const Move& move);
  void push_all();
  [[gnu::always_inline]] void look_ahead(std::size_t i, Bucket b) const {
    constexpr std::size_t kFar = 24, kNear = 12;
    if (i + kFar < batch_.size()) {
      const Index t = batch_[i + kFar];
      queue_.prefetch(t);
      mesh_.prefetch_halfedge(3 * t);
    }
    if (i + kNear < batch_.size()) {
      const Index t = batch_[i + kNear];
      if (!queue_.in_bucket(t, b) || !mesh_.alive_triangle(t)) return;
      for (Index h = 3 * t; h < 3 * t + 3; ++h) {
        const Index v = mesh_.origin(h);
        mesh_.prefetch_vertex(v);
        __builtin_prefetch(&vertex_[v]);
      }
    }
  }
  [[gnu::always_inline]] void look_around(Index t) const {
    for (Index h = 3 * t; h < 3 * t + 3; ++h) {
      Index e = mesh_.rotate_ccw(h);
      for (int k = 0; k < 12 && e != kNone && e != h; ++k) {
        const Index v = mesh_.dest(e);
        mesh_.prefetch_vertex(v);
        __builtin_prefetch(&vertex_[v]);
        queue_.prefetch(e / 3);
        e = mesh_.rotate_ccw(e);
      }
    }
  }
  bool changed_now(Index t) const;
  void weigh_chunk(std::size_t begin, Bucket b);
  void visit(const Candidate& c, Bucket b);
  bool drain(const Progress& progress);
};

template <class Rules>
void Collapser<Rules>::add_quadric(Index t) {
  if (!mesh_.alive_triangle(t)) return;
  const Index h = 3 * t;
  const Vec3 o = at(mesh_.origin(h));
  const Vec3 e = rules_.metric(at(mesh_.dest(h)) - o), f = rules_.metric(at(mesh_.apex(h)) - o);
  const Vec3 n = cross(e, f);
  const double area = length(n) / 2;
  const Quadric q =
      Quadric::of_plane({n.x, n.y, n.z}, area > 0 ? 0.25 / area : 0, kQuadricNSpring * area / 3);
  for (Index k = h; k < h + 3; ++k) vertex_[mesh_.origin(k)].q.add(q);
  if (Rules::kPlanar == 2) return;
  for (Index k = h; k < h + 3; ++k) {
    if (mesh_.twin(k) != kNone) continue;
    // A plane through the border edge, at right angles to the triangle.
    const Vec3 along = at(mesh_.dest(k)) - at(mesh_.origin(k));
    const Vec3 out = cross(along, n);
    const double weight = dot(out, out) > 0 ? kBorderWeight * dot(along, along) / dot(out, out) : 0;
    const Quadric wall = Quadric::of_plane({out.x, out.y, out.z}, weight, 0);
    vertex_[mesh_.origin(k)].q.add(wall);
    vertex_[mesh_.dest(k)].q.add(wall);
  }
}

/// The cheapest of the triangle's edges that may merge.
template <class Rules>
auto Collapser<Rules>::weigh_edges(Index h, bool border_only) const -> Move {
  Move best;
  for (Index e = h; e < h + 3; ++e) {
    if (border_only && mesh_.twin(e) != kNone) continue;
    Index k = e;  // so that an end on the border stays
    if (mesh_.twin(k) != kNone && mesh_.on_border(mesh_.origin(k))) k = mesh_.twin(k);
    const Merge rule = rules_.rule(k);
    if (rule == Merge::never) continue;
    const Index a = mesh_.origin(k), b = mesh_.dest(k);
    Quadric q = seen_from(b, at(a));
    q.add(vertex_[a].q);
    const Placed<3> p = place_merged<3>(rules_, rule, q, mesh_, a, b);
    if (p.cost < best.cost) best = {p.cost, k, rules_.on_lattice(a, b, p.at), kNone};
  }
  return best;
}

/// What merging all of a triangle costs: the error at its centroid (or at the corner that is pinned
/// to the border), on terrain at the best height there. Three evaluations instead of a sum of
/// moved quadrics and a linear system: that is for the triangle that is taken.
template <class Rules>
float Collapser<Rules>::triangle_cost(Index h, Index pinned) const {
  const std::array<Index, 3> corner = {mesh_.origin(h), mesh_.dest(h), mesh_.apex(h)};
  const Vec3 p =
      pinned != kNone ? at(pinned) : (at(corner[0]) + at(corner[1]) + at(corner[2])) * (1.0 / 3);
  float cost = 0, slope = 0, bend = 0;
  int valence = -9;
  for (const Index v : corner) {
    const auto [value, up] = vertex_[v].q.value_and_slope(offset(at(v), p), 2);
    cost += value;
    slope += up;
    bend += vertex_[v].q.a[Quadric::at(2, 2)];
    valence += vertex_[v].degree;
  }
  const bool height_free = pinned == kNone ? !centroid_ : !rules_.height_is_fixed(pinned);
  if (Rules::kPlanar == 2 && height_free) cost -= slope * slope / bend;
  cost = std::max(0.0f, cost);
  return valence > kFreeValence ? cost * (1 + kValencePenalty * float(valence - kFreeValence))
                                : cost;
}

/// Where a triangle merges.
template <class Rules>
Vec3 Collapser<Rules>::place_triangle(Index h, Index pinned) const {
  const Index a = mesh_.origin(h), b = mesh_.dest(h), c = mesh_.apex(h);
  const Vec3& origin = at(a);
  const Vec3 centroid = (at(a) + at(b) + at(c)) * (1.0 / 3);
  if (pinned == kNone && centroid_) return rules_.snap(centroid);
  Quadric q = seen_from(b, origin);
  q.add(seen_from(c, origin));
  q.add(vertex_[a].q);
  if (pinned != kNone)
    return place_at<3>(rules_, q, origin, at(pinned), !rules_.height_is_fixed(pinned)).at;
  const Vec3 ab = metric_offset(rules_, origin, at(b)), ac = metric_offset(rules_, origin, at(c));
  const double z = Rules::kPlanar == 3;
  const double reach = std::max(ab.x * ab.x + ab.y * ab.y + z * ab.z * ab.z,
                                ac.x * ac.x + ac.y * ac.y + z * ac.z * ac.z);
  return place_free<3>(rules_, q, origin, 2 * reach, centroid).at;
}

template <class Rules>
auto Collapser<Rules>::weigh(Index t) const -> Move {
  const Index h = 3 * t;
  bool border_edge = false;
  Index pinned = kNone;
  int corners_outside = 0;
  for (Index e = h; e < h + 3; ++e) {
    border_edge |= mesh_.twin(e) == kNone;
    if (rules_.interior(mesh_.origin(e))) continue;
    pinned = mesh_.origin(e);
    ++corners_outside;
  }
  if (border_edge) return weigh_edges(h, true);
  if (edges_only_ || missing() < 4 || corners_outside > 1) return weigh_edges(h, false);
  return {triangle_cost(h, pinned), kNone, {}, pinned};
}

/// Whether the triangle may merge at p. The topology stays when its corners share no neighbours but
/// the apexes of its three edges, which differ; the shape, when all triangles around it allow it.
template <class Rules>
bool Collapser<Rules>::may_merge(Index h, const Vec3& p) const {
  const std::array<Index, 3> corner = {mesh_.origin(h), mesh_.dest(h), mesh_.apex(h)};
  auto is_corner = [&](Index v) { return v == corner[0] || v == corner[1] || v == corner[2]; };
  std::array<Index, kLargestStencil> seen;
  int n = 0;
  bool ok = mesh_.triangle_count() > 8;
  auto see = [&](Index v) {
    if (is_corner(v)) return;
    if (n == kLargestStencil)
      ok = false;
    else
      seen[n++] = v;
  };
  for (const Index v : corner) {
    if (vertex_[v].degree < 4) return false;
    mesh_.for_each_out(v, [&](Index e) {
      const Index b = mesh_.dest(e), c = mesh_.apex(e);
      see(b);
      if (mesh_.twin(HalfedgeMesh::prev(e)) == kNone) see(c);
      if (!ok || is_corner(b) || is_corner(c)) return;
      ok = rules_.allows_triangle({at(v), at(b), at(c)}, {p, at(b), at(c)});
    });
    if (!ok) return false;
  }
  std::sort(seen.begin(), seen.begin() + n);
  int shared = 0;
  for (int i = 1; i < n; ++i) shared += seen[i] == seen[i - 1];
  const Index x = mesh_.apex(mesh_.twin(h)), y = mesh_.apex(mesh_.twin(HalfedgeMesh::next(h))),
              z = mesh_.apex(mesh_.twin(HalfedgeMesh::prev(h)));
  return shared == 3 && x != y && y != z && z != x;
}

/// Where dest(h) may be after the first of the two edge collapses that merge a triangle at p.
template <class Rules>
std::optional<Vec3> Collapser<Rules>::waypoint(Index h, const Vec3& p) const {
  const Vec3 &a = at(mesh_.origin(h)), &b = at(mesh_.dest(h));
  const Vec3 middle = rules_.on_lattice(mesh_.origin(h), mesh_.dest(h), rules_.snap((a + b) * 0.5));
  const bool pinned = !rules_.interior(mesh_.origin(h)) || !rules_.interior(mesh_.dest(h));
  if (pinned) return rules_.allows(mesh_, h, p) ? std::optional(p) : std::nullopt;
  for (const Vec3& between : {p, b, a, middle})
    if (rules_.allows(mesh_, h, between)) return between;
  return {};
}

template <class Rules>
void Collapser<Rules>::tell_collapse(Index h, const Vec3& p) const {
  if (recorder_) recorder_->collapse(collapse_of(mesh_, h, p));
}

/// Two edge collapses: first origin(h), then apex(h), into dest(h), which moves to its new place by
/// way of `between`.
template <class Rules>
Index Collapser<Rules>::merge_triangle(Index h, const Vec3& p, const Vec3& between) {
  const Index a = mesh_.origin(h), b = mesh_.dest(h), c = mesh_.apex(h);
  Quadric q = seen_from(a, p);
  q.add(seen_from(b, p));
  q.add(seen_from(c, p));
  vertex_[b].q = q;
  for (Index e = h, k = 0; k < 3; ++k, e = HalfedgeMesh::next(e))
    --vertex_[mesh_.apex(mesh_.twin(e))].degree;
  vertex_[b].degree = std::uint16_t(vertex_[a].degree + vertex_[b].degree + vertex_[c].degree - 9);
  rules_.merged(a, b);
  rules_.merged(c, b);
  tell_collapse(h, between);
  mesh_.collapse(h);
  mesh_.position(b) = between;
  const Index e = mesh_.find(c, b);
  tell_collapse(e, p);
  mesh_.collapse(e);
  mesh_.position(b) = p;
  return b;
}

template <class Rules>
Index Collapser<Rules>::merge_edge(Index h, const Vec3& p) {
  const Index a = mesh_.origin(h), b = mesh_.dest(h), g = mesh_.twin(h);
  Quadric q = seen_from(a, p);
  q.add(seen_from(b, p));
  vertex_[b].q = q;
  --vertex_[mesh_.apex(h)].degree;
  if (g != kNone) --vertex_[mesh_.apex(g)].degree;
  vertex_[b].degree = std::uint16_t(vertex_[a].degree + vertex_[b].degree - (g == kNone ? 3 : 4));
  rules_.merged(a, b);
  tell_collapse(h, p);
  mesh_.collapse(h);
  mesh_.position(b) = p;
  return b;
}

/// The second half of a step. Edges are ranked by the error at the most natural place for each, and
/// only those that are tried are placed properly.
template <class Rules>
void Collapser<Rules>::collapse_rim_edge(Index centre) {
  struct Ranked {
    float cost;
    Index edge;
    Merge rule;
  };
  std::array<Ranked, kLargestStencil> rim;
  int n = 0;
  mesh_.for_each_out(centre, [&](Index spoke) {
    Index e = HalfedgeMesh::next(spoke);
    if (mesh_.twin(e) == kNone || n == kLargestStencil) return;
    if (mesh_.on_border(mesh_.origin(e))) e = mesh_.twin(e);
    const Merge rule = rules_.rule(e);
    if (rule == Merge::never) return;
    const Index a = mesh_.origin(e), b = mesh_.dest(e);
    const Vec3 p = rule == Merge::at_dest     ? at(b)
                   : rule == Merge::at_origin ? at(a)
                                              : (at(a) + at(b)) * 0.5;
    rim[n++] = {vertex_[a].q.value(offset(at(a), p)) + vertex_[b].q.value(offset(at(b), p)), e,
                rule};
  });
  for (int tries = 0; tries < std::min(n, kRimTries); ++tries) {
    std::iter_swap(rim.begin() + tries, std::min_element(rim.begin() + tries, rim.begin() + n,
                                                         [](const Ranked& x, const Ranked& y) {
                                                           return x.cost < y.cost;
                                                         }));
    const Index e = rim[tries].edge;
    const Index a = mesh_.origin(e), b = mesh_.dest(e);
    Quadric q = seen_from(b, at(a));
    q.add(vertex_[a].q);
    const Vec3 p =
        rules_.on_lattice(a, b, place_merged<3>(rules_, rim[tries].rule, q, mesh_, a, b).at);
    if (!rules_.allows(mesh_, e, p) || !collapse_keeps_manifold(mesh_, e)) continue;
    vertex_[merge_edge(e, p)].changed_in = round_;
    return;
  }
}

/// Triangles that were refused get another turn once something around them has changed.
template <class Rules>
void Collapser<Rules>::look_again_around(Index v, Bucket b) {
  mesh_.for_each_out(v, [&](Index e) {
    if (!queue_.queued(e / 3)) queue_.push(e / 3, b);
  });
}

template <class Rules>
bool Collapser<Rules>::step(Index t, const Move& move) {
  Index survivor;
  if (move.edge != kNone) {
    if (!rules_.allows(mesh_, move.edge, move.edge_to)) return false;
    if (!collapse_keeps_manifold(mesh_, move.edge)) return false;
    survivor = merge_edge(move.edge, move.edge_to);
  } else {
    const Index end = move.pinned != kNone ? move.pinned : mesh_.origin(3 * t);
    const Vec3 p = rules_.on_lattice(end, end, place_triangle(3 * t, move.pinned));
    if (!may_merge(3 * t, p)) return false;
    const std::optional<Vec3> between = recorder_ ? waypoint(3 * t, p) : p;
    if (!between) return false;
    survivor = merge_triangle(3 * t, p, *between);
  }
  vertex_[survivor].changed_in = round_;
  ++steps_;
  if (!edges_only_ && missing() >= 2) collapse_rim_edge(survivor);
  return true;
}

template <class Rules>
void Collapser<Rules>::push_all() {
  for (Index t = 0; t < mesh_.triangle_slots(); ++t) {
    if (!mesh_.alive_triangle(t)) continue;
    const float cost = weigh(t).cost;
    if (cost < kNever) queue_.push(t, bucket_of(cost));
  }
}

template <class Rules>
bool Collapser<Rules>::changed_now(Index t) const {
  const Index h = 3 * t;
  return vertex_[mesh_.origin(h)].changed_in == round_ ||
         vertex_[mesh_.dest(h)].changed_in == round_ || vertex_[mesh_.apex(h)].changed_in == round_;
}

template <class Rules>
void Collapser<Rules>::weigh_chunk(std::size_t begin, Bucket b) {
  candidates_.clear();
  const std::size_t end = std::min(begin + kChunk, batch_.size());
  for (std::size_t i = begin; i < end; ++i) {
    look_ahead(i, b);
    const Index t = batch_[i];
    if (!queue_.take(t, b) || !mesh_.alive_triangle(t)) continue;
    if (changed_now(t)) {
      queue_.push(t, b);
      continue;
    }
    const Move move = weigh(t);
    if (!(move.cost < kNever)) continue;
    const Bucket now = bucket_of(move.cost);
    if (now > b) {
      queue_.push(t, now);
      continue;
    }
    candidates_.push_back({t, move});
    for (Index h = 3 * t; h < 3 * t + 3; ++h)
      if (mesh_.twin(h) != kNone) mesh_.prefetch_halfedge(mesh_.twin(h));
  }
}

template <class Rules>
bool Collapser<Rules>::drain(const Progress& progress) {
  const std::size_t start = mesh_.triangle_count();
  while (missing() > 0) {
    if (progress.stopped()) return false;
    progress.at(double(start - mesh_.triangle_count()) / double(start - target_));
    const Bucket b = queue_.next_batch(batch_);
    if (b == BucketQueue::kAbsent) break;
    ++round_;
    for (std::size_t i = 0; i < batch_.size() && missing() > 0; i += kChunk) {
      weigh_chunk(i, b);
      for (const Candidate& c : candidates_) look_around(c.triangle);
      for (const Candidate& c : candidates_) visit(c, b);
    }
  }
  return true;
}

/// The turn of a candidate.
template <class Rules>
void Collapser<Rules>::visit(const Candidate& c, Bucket b) {
  const Index t = c.triangle;
  if (missing() == 0 || !mesh_.alive_triangle(t)) return;
  const bool merge = c.move.edge == kNone;
  if (changed_now(t) || (merge ? missing() < 4 : !mesh_.alive_triangle(c.move.edge / 3))) {
    queue_.push(t, b);
    return;
  }
  const Index survivor = mesh_.dest(merge ? 3 * t : c.move.edge);
  if (step(t, c.move) && mesh_.alive_vertex(survivor)) look_again_around(survivor, b);
}

template <class Rules>
bool Collapser<Rules>::run(std::size_t target, const Progress& progress) {
  target_ = target;
  edges_only_ = false;
  queue_ = BucketQueue(mesh_.triangle_slots());
  push_all();
  if (!drain(progress)) return false;
  edges_only_ = true;  // where no triangle can merge any more, an edge often can
  for (std::uint64_t before = ~std::uint64_t(0); missing() > 0 && steps_ != before;) {
    before = steps_;
    push_all();
    if (!drain(progress)) return false;
  }
  return true;
}

/// As record_by_bounds. False when stopped.
template <class Rules>
bool record_steps(Collapser<Rules>& collapser, const HalfedgeMesh& mesh, Rules& rules,
                  const RunOptions& options, const Progress& progress) {
  CollapseRecorder& recorder = *options.recorder;
  recorder.fine(mesh);
  collapser.tell(recorder);
  std::vector<double> ladder = rules.ladder(options.stop, recorder.lattice);
  ladder.push_back(HUGE_VAL);
  bool ran = true;
  for (std::size_t k = 0; k < ladder.size() && ran; ++k) {
    if (mesh.triangle_count() <= recorder.triangles) break;
    rules.bound(ladder[k] * (1 - 1e-6));
    const double n = double(ladder.size());
    ran = collapser.run(recorder.triangles, progress.part(double(k) / n, double(k + 1) / n));
  }
  recorder.base(mesh);
  return ran;
}

template <class Rules>
Result<Simplified> run(HalfedgeMesh& mesh, Rules& rules, const TriangleCollapseOptions& method,
                       const RunOptions& options, const Progress& progress) {
  Simplified out;
  out.input_triangles = mesh.triangle_count();
  Collapser<Rules> collapser(mesh, rules, method.placement == Placement::centroid);
  CollapseRecorder* const recorder = options.recorder;
  bool ran = collapser.run(target_triangles(options.stop, out.input_triangles),
                           recorder ? progress.part(0, 0.5) : progress.part(0, 1));
  if (ran && recorder) {
    ran = record_steps(collapser, mesh, rules, options, progress.part(0.5, 1));
  }
  if (!ran) return fail(Errc::cancelled, "simplification was stopped");
  out.steps = collapser.steps();
  out.note = stop_note(options.stop, out.input_triangles, mesh.triangle_count());
  out.tin = mesh.to_tin();
  return out;
}

}  // namespace

Result<Simplified> simplify_triangle_collapse(const Terrain& dem,
                                              const TriangleCollapseOptions& method,
                                              const RunOptions& options, const Progress& progress) {
  Result<TerrainMesh> terrain = terrain_mesh(dem, options.constraints.get());
  if (!terrain) return std::unexpected(terrain.error());
  TerrainRules rules(*terrain, dem.grid, options.stop.max_error_m);
  if (options.recorder) {
    put_on_lattice(terrain->mesh, options.recorder->lattice);
    rules.put_on(options.recorder->lattice);
  }
  return run(terrain->mesh, rules, method, options, progress);
}

Result<Simplified> triangle_collapse_mesh(const Tin& tin, const TriangleCollapseOptions& method,
                                          const RunOptions& options, const Progress& progress) {
  Result<HalfedgeMesh> mesh = HalfedgeMesh::from_tin(tin);
  if (!mesh) return std::unexpected(mesh.error());
  SurfaceRules rules(*mesh);
  if (options.recorder) rules.put_on(options.recorder->lattice);
  const auto seams = double(rules.seam_vertices());
  auto made = run(*mesh, rules, method, options, progress);
  if (made) made->details[kSeamVertices] = seams;
  return made;
}

Result<std::uint64_t> collapse_held(HeldMesh& held, const TriangleCollapseOptions& method,
                                    const Progress& progress) {
  TerrainRules rules(held);
  Collapser<TerrainRules> collapser(held.terrain.mesh, rules,
                                    method.placement == Placement::centroid);
  if (!collapser.run(held.triangles, progress))
    return fail(Errc::cancelled, "simplification was stopped");
  return collapser.steps();
}

}  // namespace tind
