// Vertex removal, after [Schroeder92]. A removal is planned on the ring alone: ears are cut
// off until a triangle is left (or, with the vertex on a straight border or on a diagonal, until
// one quadrilateral is left). A vertex in the middle of a straight line goes along it: the line's
// two neighbours lose no ear and become the diagonal that stays, so that each side of the line is
// filled for itself. Only when the plan stands - every triangle counter-clockwise, every
// post within the bound - is it carried out: each ear is one edge flip, the last step one collapse.
// So the topology stays the half-edge mesh's business, and a refused removal costs no undo.

#include "terrain/simplify/collapse/vertex_removal.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "terrain/simplify/collapse/bucket_queue.h"
#include "terrain/simplify/collapse/collapse_method.h"
#include "terrain/simplify/collapse/exact_check.h"
#include "terrain/simplify/common/held_mesh.h"
#include "terrain/simplify/common/terrain_mesh.h"

namespace tind {

namespace {

using Index = HalfedgeMesh::Index;
constexpr Index kNone = HalfedgeMesh::kNone;

/// Rings longer than this are left alone: cutting ears is quadratic in the ring.
constexpr std::size_t kLongestRing = 64;
/// `k-degree` has this many buckets for each degree; all larger degrees are as bad as the largest.
constexpr std::uint32_t kTies = 32, kLargestDegree = 60;
static_assert(kTies * (kLargestDegree + 1) <= BucketQueue::kBuckets);

/// How one vertex is to go. For a border vertex the ring is open, from the neighbour after it along
/// the border to the one before it.
struct Plan {
  std::vector<Index> ring;          // its neighbours, counter-clockwise
  std::vector<Index> rest;          // what ears have left of the ring
  std::vector<Index> ears;          // neighbours to lose their edge to the vertex, in order
  std::vector<Triangle> triangles;  // that fill the hole
  Index into = kNone;               // the neighbour that the vertex merges into in the end
  bool line = false;                // the vertex lies on a line inside the mesh ...
  std::array<Index, 2> along = {};  // ... between these two

  bool keeps_edge_to(Index w) const { return line && (w == along[0] || w == along[1]); }
};

class Remover {
 public:
  Remover(TerrainMesh& terrain, const HeightGrid& grid, Criterion criterion, int k,
          std::optional<double> max_error);
  /// Of a held mesh, within its bound.
  Remover(HeldMesh& held, Criterion criterion, int k);

  /// Removes vertices until at most `target` triangles are left or none may go. False when told
  /// to stop.
  bool run(std::size_t target, const Progress& progress);

  std::uint64_t removed() const { return removed_; }

 private:
  using Bucket = BucketQueue::Bucket;
  TerrainMesh& terrain_;
  HalfedgeMesh& mesh_;
  Criterion criterion_;
  int k_;
  std::optional<WithinError> bound_;
  std::optional<WithinHeld> held_;
  BucketQueue queue_;
  std::vector<std::uint32_t> degree_;
  std::vector<std::uint8_t> may_go_;
  std::vector<std::uint32_t> changed_in_;  // the turn in which the vertex's ring last changed
  std::uint32_t turn_ = 1;
  std::vector<Index> waiting_;  // for the next turn
  /// `plane`, whose keys are expensive: of each vertex, up to date but for those in waiting_.
  std::vector<Bucket> key_;
  Plan plan_;
  std::uint32_t removed_ = 0;
  std::vector<std::uint32_t> renewed_for_;  // the removal after which the vertex last got its key

  const Vec3& at(Index v) const { return mesh_.position(v); }
  Vec3 metric(Index v) const { return terrain_.metric(at(v)); }

  Remover(TerrainMesh& terrain, Criterion criterion, int k);
  void enter_all();
  void gather_ring(Index v);
  bool may_ever_go(Index v) const;
  Bucket key(Index v) const;
  double plane_distance(Index v) const;
  bool on_inner_line(Index v) const {
    return terrain_.kind[v] == VertexKind::along_line && !mesh_.on_border(v);
  }
  std::array<Index, 2> line_neighbours(Index v) const;
  double distance_to_line(Index v, const std::array<Index, 2>& ends) const;
  std::uint32_t neighbour_degrees(Index v) const;
  void visit(Index v, Bucket b);
  double ear_power(Index v, std::size_t i) const;
  bool cut_ears(Index v, std::size_t last);
  bool close_hole(Index v);
  bool within_bound() const;
  bool make_plan(Index v);
  void carry_out(Index v);
  void count_degrees(bool border);
  void enter(Index v);
  void refresh();
};

Remover::Remover(TerrainMesh& terrain, Criterion criterion, int k)
    : terrain_(terrain),
      mesh_(terrain.mesh),
      criterion_(criterion),
      k_(k),
      queue_(mesh_.vertex_slots()),
      degree_(mesh_.vertex_slots()),
      may_go_(mesh_.vertex_slots()),
      changed_in_(mesh_.vertex_slots(), 0),
      renewed_for_(mesh_.vertex_slots(), 0) {}

Remover::Remover(TerrainMesh& terrain, const HeightGrid& grid, Criterion criterion, int k,
                 std::optional<double> max_error)
    : Remover(terrain, criterion, k) {
  if (max_error) bound_.emplace(grid, *max_error);
  enter_all();
}

Remover::Remover(HeldMesh& held, Criterion criterion, int k) : Remover(held.terrain, criterion, k) {
  held_.emplace(held);
  enter_all();
}

void Remover::enter_all() {
  const Index n = Index(mesh_.vertex_slots());
  for (Index v = 0; v < n; ++v)
    if (mesh_.alive_vertex(v)) degree_[v] = std::uint32_t(mesh_.degree(v));
  key_.resize(criterion_ == Criterion::plane ? n : 0);
  for (Index v = 0; v < n; ++v) {
    may_go_[v] = may_ever_go(v);
    if (may_go_[v]) enter(v);
  }
}

void Remover::gather_ring(Index v) {
  plan_.ring.clear();
  mesh_.for_each_neighbour(v, [&](Index w) { plan_.ring.push_back(w); });
}

/// The two neighbours along the border of a border vertex: after and before it.
std::array<Index, 2> border_neighbours(const HalfedgeMesh& mesh, Index v) {
  return {mesh.dest(mesh.out(v)), mesh.origin(mesh.border_in(v))};
}

/// The neighbours along its line of a vertex in the middle of a straight part.
std::array<Index, 2> Remover::line_neighbours(Index v) const {
  std::array<Index, 2> ends = {kNone, kNone};
  mesh_.for_each_out(v, [&](Index h) {
    if (terrain_.lines.contains(v, mesh_.dest(h))) ends[ends[0] == kNone ? 0 : 1] = mesh_.dest(h);
  });
  return ends;
}

/// Interior vertices may go, those of lines where the line is straight; border vertices only
/// where the border passes straight through. Removals never bend a border or a line, so this is
/// asked once.
bool Remover::may_ever_go(Index v) const {
  if (!mesh_.alive_vertex(v)) return false;
  if (held_ && terrain_.kind[v] == VertexKind::fixed) return false;
  if (terrain_.lines.on_line(v)) return terrain_.kind[v] == VertexKind::along_line;
  if (!mesh_.on_border(v)) return true;
  const auto [a, b] = border_neighbours(mesh_, v);
  const double forth =
      (at(a).x - at(v).x) * (at(v).x - at(b).x) + (at(a).y - at(v).y) * (at(v).y - at(b).y);
  return orient2d(at(b), at(v), at(a)) == 0 && forth > 0;
}

double Remover::distance_to_line(Index v, const std::array<Index, 2>& ends) const {
  const auto [a, b] = ends;
  const Vec3 along = metric(b) - metric(a);
  return length(cross(along, metric(v) - metric(a))) / length(along);
}

double Remover::plane_distance(Index v) const {
  // The average plane of the fan: its area-weighted normal through its area-weighted centre.
  const Vec3 p = metric(v);
  Vec3 normal, centre;
  double area = 0;
  Vec3 spoke = metric(mesh_.dest(mesh_.out(v))) - p;
  mesh_.for_each_out(v, [&](Index h) {
    const Vec3 next = metric(mesh_.apex(h)) - p;
    const Vec3 n = cross(spoke, next);
    const double w = length(n);
    normal = normal + n;
    centre = centre + (spoke + next) * w;
    area += w;
    spoke = next;
  });
  return std::abs(dot(normal, centre)) / (3 * area * length(normal));
}

/// The sum of the k smallest degrees among the neighbours (fewer neighbours count as the largest).
std::uint32_t Remover::neighbour_degrees(Index v) const {
  std::array<std::uint32_t, kLongestRing + 1> degrees;
  int n = 0;
  mesh_.for_each_neighbour(v, [&](Index w) {
    if (n < int(degrees.size())) degrees[n++] = degree_[w];
  });
  const int k = std::min(k_, n);
  if (k < n) std::partial_sort(degrees.begin(), degrees.begin() + k, degrees.begin() + n);
  std::uint32_t sum = 0;
  for (int i = 0; i < k; ++i) sum += degrees[i];
  if (k < k_)
    sum += std::uint32_t(k_ - k) * *std::max_element(degrees.begin(), degrees.begin() + n);
  return sum;
}

Remover::Bucket Remover::key(Index v) const {
  switch (criterion_) {
    case Criterion::plane:
      return BucketQueue::bucket_of(
          float(mesh_.on_border(v) ? distance_to_line(v, border_neighbours(mesh_, v))
                : on_inner_line(v) ? distance_to_line(v, line_neighbours(v))
                                   : plane_distance(v)));
    case Criterion::degree:
      return Bucket(std::min(degree_[v], kLargestDegree));
    case Criterion::k_degree: {  // the neighbours' mean degree, in halves, breaks the tie
      const std::uint32_t tie = std::min(kTies - 1, 2 * neighbour_degrees(v) / std::uint32_t(k_));
      return Bucket(kTies * std::min(degree_[v], kLargestDegree) + tie);
    }
  }
  return 0;
}

/// Power of `p` to the circle through a, b, c (counter-clockwise): negative inside. Devillers cuts
/// the ear whose circle is farthest from the vanishing vertex in this sense, relative to its area.
double power(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& p) {
  const double ax = a.x - p.x, ay = a.y - p.y, bx = b.x - p.x, by = b.y - p.y;
  const double cx = c.x - p.x, cy = c.y - p.y;
  const double aa = ax * ax + ay * ay, bb = bx * bx + by * by, cc = cx * cx + cy * cy;
  const double in_circle =
      aa * (bx * cy - by * cx) - bb * (ax * cy - ay * cx) + cc * (ax * by - ay * bx);
  return -in_circle / orient2d(a, b, c);
}

/// The power of what is left of the ring at i to the circle of the ear there; infinite where it is
/// none: an ear is counter-clockwise and leaves the vertex strictly inside what remains, so that
/// each intermediate flip is valid too.
double Remover::ear_power(Index v, std::size_t i) const {
  const std::vector<Index>& ring = plan_.rest;
  const std::size_t n = ring.size();
  if (mesh_.on_border(v) && (i == 0 || i + 1 == n)) return HUGE_VAL;
  if (plan_.keeps_edge_to(ring[i])) return HUGE_VAL;
  const Vec3 &a = at(ring[(i + n - 1) % n]), &b = at(ring[i]), &c = at(ring[(i + 1) % n]);
  if (!surely_ccw(a, b, c) || !surely_ccw(at(v), a, c)) return HUGE_VAL;
  return power(a, b, c, at(v));
}

/// Cuts ears off the ring until `last` vertices are left, the best first; a cut concerns the ears
/// on both sides of it only.
bool Remover::cut_ears(Index v, std::size_t last) {
  std::vector<Index>& ring = plan_.rest;
  if (ring.size() <= last) return true;
  std::array<double, kLongestRing> power;
  for (std::size_t i = 0; i < ring.size(); ++i) power[i] = ear_power(v, i);
  while (true) {
    const std::size_t n = ring.size();
    const auto least = std::min_element(power.begin(), power.begin() + n);
    const auto best = std::size_t(least - power.begin());
    if (*least == HUGE_VAL) return false;
    plan_.triangles.push_back({ring[(best + n - 1) % n], ring[best], ring[(best + 1) % n]});
    plan_.ears.push_back(ring[best]);
    ring.erase(ring.begin() + std::ptrdiff_t(best));
    if (n - 1 <= last) return true;
    std::copy(least + 1, power.begin() + n, least);
    for (const std::size_t i : {best % (n - 1), (best + n - 2) % (n - 1)})
      power[i] = ear_power(v, i);
  }
}

/// Fills what is left by a collapse into one of its corners: the first for which every triangle is
/// counter-clockwise (of two diagonals the one whose smaller triangle is larger).
bool Remover::close_hole(Index v) {
  const std::vector<Index>& ring = plan_.rest;
  const std::size_t n = ring.size();
  const bool border = mesh_.on_border(v);
  std::size_t best = n;
  double largest = 0;
  for (std::size_t i = 0; i < (border ? 1 : n); ++i) {
    if (plan_.line && !plan_.keeps_edge_to(ring[i])) continue;
    double smallest = HUGE_VAL;
    for (std::size_t j = 1; j + 1 < n; ++j) {
      const Vec3 &a = at(ring[i]), &b = at(ring[(i + j) % n]);
      const Vec3& c = at(ring[(i + j + 1) % n]);
      smallest = std::min(smallest, surely_ccw(a, b, c) ? orient2d(a, b, c) : 0);
    }
    if (smallest > largest) largest = smallest, best = i;
  }
  if (best == n) return false;
  for (std::size_t j = 1; j + 1 < n; ++j) {
    plan_.triangles.push_back({ring[best], ring[(best + j) % n], ring[(best + j + 1) % n]});
  }
  plan_.into = ring[best];
  return true;
}

bool Remover::within_bound() const {
  return std::ranges::all_of(plan_.triangles, [&](const Triangle& t) {
    const Vec3 &a = at(t[0]), &b = at(t[1]), &c = at(t[2]);
    return (!bound_ || bound_->holds(a, b, c)) && (!held_ || held_->holds(a, b, c));
  });
}

bool Remover::make_plan(Index v) {
  gather_ring(v);
  if (plan_.ring.size() > kLongestRing) return false;
  plan_.line = on_inner_line(v);
  if (plan_.line) plan_.along = line_neighbours(v);
  plan_.rest = plan_.ring;
  plan_.ears.clear();
  plan_.triangles.clear();
  const std::size_t last = mesh_.on_border(v) ? 3 : 4;
  return cut_ears(v, last) && close_hole(v) && within_bound();
}

void Remover::carry_out(Index v) {
  for (const Index w : plan_.ears) mesh_.flip(mesh_.find(v, w));
  if (terrain_.lines.on_line(v)) move_lines(terrain_, v, plan_.into);
  mesh_.collapse(mesh_.find(v, plan_.into));
}

/// Every neighbour has lost its edge to the vertex; each diagonal of the hole is an edge for two,
/// and so is the new border edge that the last triangle of an open ring brings.
void Remover::count_degrees(bool border) {
  for (const Index w : plan_.ring) --degree_[w];
  auto diagonal = [&](Index a, Index b) { ++degree_[a], ++degree_[b]; };
  for (std::size_t i = 0; i + (border ? 0 : 1) < plan_.triangles.size(); ++i)
    diagonal(plan_.triangles[i][0], plan_.triangles[i][2]);
}

/// A ring that is too long to be filled needs no key; it comes by again when it gets shorter.
void Remover::enter(Index v) {
  if (degree_[v] > kLongestRing) return;
  const Bucket b = key(v);
  if (criterion_ == Criterion::plane) key_[v] = b;
  queue_.push(v, b);
}

/// After a removal the ring waits. Degrees get their keys at once, and `k-degree` looks one ring
/// farther; a plane is fitted once a turn, however often the ring changed.
void Remover::refresh() {
  if (criterion_ == Criterion::plane) {
    ++removed_;
    for (const Index v : plan_.ring) {
      if (may_go_[v] && changed_in_[v] != turn_) waiting_.push_back(v);
      changed_in_[v] = turn_;
    }
    return;
  }
  auto renew = [&](Index v) {
    if (!may_go_[v] || renewed_for_[v] == removed_) return;
    renewed_for_[v] = removed_;
    enter(v);
  };
  ++removed_;
  for (const Index v : plan_.ring) {
    changed_in_[v] = turn_;
    renew(v);
    if (criterion_ != Criterion::k_degree) continue;
    mesh_.for_each_out(v, [&](Index h) { renew(mesh_.dest(h)); });
  }
}

/// The turn of vertex v, which waited in bucket b.
void Remover::visit(Index v, Bucket b) {
  if (changed_in_[v] == turn_) {
    if (criterion_ != Criterion::plane) waiting_.push_back(v);
    return;
  }
  if (const Bucket now = criterion_ == Criterion::plane ? key_[v] : key(v); now > b) {
    queue_.push(v, now);
    return;
  }
  if (!make_plan(v)) return;
  const bool border = mesh_.on_border(v);
  carry_out(v);
  count_degrees(border);
  refresh();
}

/// Takes vertices in turns: the ring of a removed vertex waits for the next. For `plane` a turn is
/// one bucket, which is enough for equal keys to thin out evenly. Degrees say nothing about where a
/// vertex lies, and a removal makes low degrees next to it: taken strictly smallest first, they eat
/// holes into one corner of the terrain and leave the rest alone. So for them a turn is one pass
/// over the whole mesh.
bool Remover::run(std::size_t target, const Progress& progress) {
  const std::size_t start = mesh_.triangle_count();
  const double all = double(std::max<std::size_t>(1, start - std::min(start, target)));
  auto enough = [&] { return mesh_.triangle_count() <= target; };
  std::vector<Index> batch;
  while (!enough()) {
    if (progress.stopped()) return false;
    progress.at(double(start - mesh_.triangle_count()) / all);
    const Bucket b = queue_.next_batch(batch);
    if (b == BucketQueue::kAbsent && waiting_.empty()) break;
    for (std::size_t i = 0; i < batch.size() && !enough(); ++i)
      if (queue_.take(batch[i], b)) visit(batch[i], b);
    if (criterion_ != Criterion::plane && b != BucketQueue::kAbsent) continue;
    ++turn_;
    std::sort(waiting_.begin(), waiting_.end());  // in mesh order neighbours share the cache
    for (const Index v : waiting_)
      if (mesh_.alive_vertex(v)) enter(v);
    waiting_.clear();
  }
  return true;
}

}  // namespace

Result<void> check_method(const VertexRemovalOptions& method) {
  if (method.k < 1 || method.k > 16) return fail(Errc::invalid_argument, "k must lie in 1..16");
  return {};
}

Result<Simplified> simplify_vertex_removal(const Terrain& dem, const VertexRemovalOptions& method,
                                           const RunOptions& options, const Progress& progress) {
  if (const auto ok = check_method(method); !ok) return std::unexpected(ok.error());
  Result<TerrainMesh> terrain = terrain_mesh(dem, options.constraints.get());
  if (!terrain) return std::unexpected(terrain.error());

  Simplified out;
  out.input_triangles = terrain->mesh.triangle_count();
  const std::size_t target = target_triangles(options.stop, out.input_triangles);
  Remover remover(*terrain, dem.grid, method.criterion, method.k, options.stop.max_error_m);
  if (!remover.run(target, progress)) return fail(Errc::cancelled, "simplification was stopped");
  out.steps = remover.removed();
  out.note = stop_note(options.stop, out.input_triangles, terrain->mesh.triangle_count());
  out.tin = terrain->mesh.to_tin();
  return out;
}

Result<std::uint64_t> collapse_held(HeldMesh& held, const VertexRemovalOptions& method,
                                    const Progress& progress) {
  Remover remover(held, method.criterion, method.k);
  if (!remover.run(held.triangles, progress))
    return fail(Errc::cancelled, "simplification was stopped");
  return remover.removed();
}

}  // namespace tind
