#include "terrain/progressive/between/between.h"

#include <algorithm>
#include <array>
#include <string>
#include <utility>

#include "terrain/progressive/between/set_collapser.h"
#include "terrain/progressive/stream/progressive_cursor.h"
#include "terrain/progressive/stream/split_recorder.h"

namespace tind {

namespace {

using Index = HalfedgeMesh::Index;

/// The paper collapses by quadric and moves vertices evenly. A set in which that turns a triangle
/// over tries the next of these, until none does or all have been tried.
constexpr std::array<SetPlan, 12> kPlans = {{{1, false},
                                             {1, true},
                                             {0.5, false},
                                             {2, true},
                                             {0.5, true},
                                             {2, false},
                                             {0.25, true},
                                             {4, true},
                                             {0.25, false},
                                             {4, false},
                                             {0.7, true},
                                             {1.4, true}}};
std::string place(const Vec3& p) {
  return "(" + std::to_string(p.x) + ", " + std::to_string(p.y) + ", " + std::to_string(p.z) + ")";
}

/// What is left must be the coarse model.
Result<void> arrived(const CollapsedSets& made, const Tin& coarse) {
  if (made.left_over)
    return fail(Errc::unsupported,
                "no collapse inside its set takes away the vertex at " + place(*made.left_over));
  const auto sorted = [](std::vector<Triangle> all) {
    for (Triangle& t : all) std::ranges::rotate(t, std::ranges::min_element(t));
    std::ranges::sort(all);
    return all;
  };
  const std::vector<Triangle> want = sorted(coarse.triangles),
                              have = sorted(made.mesh.base.triangles);
  if (want == have) return {};
  for (const Triangle& t : want)
    if (!std::ranges::binary_search(have, t))
      return fail(Errc::unsupported, "the coarse triangle at " + place(coarse.vertices[t[0]]) +
                                         " does not come about: are the two of the same surface?");
  return fail(Errc::unsupported, "more is left than the coarse model has");
}

/// Moves the vertices to the lattice; the farthest way of any.
double snap(HalfedgeMesh& m, const SpaceLattice& lattice) {
  double most = 0;
  for (Index v = 0; v < m.vertex_slots(); ++v) {
    const Vec3 to = lattice.snap(m.position(v));
    most = std::max(most, length(to - m.position(v)));
    m.position(v) = to;
  }
  return most;
}

/// Of a closed model: half of what Euler's formula lacks.
int handles(const HalfedgeMesh& m) {
  const auto count = [](std::size_t n) { return std::int64_t(n); };
  return int((2 - count(m.vertex_slots()) + count(m.triangle_count()) / 2) / 2);
}

constexpr std::size_t kWinding = 4;  // vertices split in for each of the fine model

/// In one part, without loose vertices.
Result<HalfedgeMesh> whole_model(const Tin& tin, const char* which) {
  auto m = HalfedgeMesh::from_tin(tin);
  if (!m) return fail(which, m.error());
  const std::string model = "the " + std::string(which) + " model ";
  std::vector<char> seen(tin.vertices.size(), 0);
  std::vector<Index> stack;
  for (Index v = 0; v < m->vertex_slots(); ++v) {
    if (!m->alive_vertex(v))
      return fail(Errc::invalid_argument,
                  model + "has a vertex without triangles at " + place(m->position(v)));
  }
  if (tin.vertices.size() < 3) return fail(Errc::invalid_argument, model + "is empty");
  stack.push_back(0), seen[0] = 1;
  std::size_t reached = 0;
  for (; !stack.empty(); ++reached) {
    const Index v = stack.back();
    stack.pop_back();
    m->for_each_neighbour(v, [&](Index w) {
      if (!std::exchange(seen[w], 1)) stack.push_back(w);
    });
  }
  if (reached < seen.size()) {
    const auto other = Index(std::ranges::find(seen, 0) - seen.begin());
    return fail(Errc::invalid_argument, model + "is in several parts: nothing leads from " +
                                            place(m->position(0)) + " to " +
                                            place(m->position(other)));
  }
  return m;
}

}  // namespace

Result<BetweenModels> between_models(const Tin& fine, const Tin& coarse,
                                     const SpaceLattice* lattice, const Progress& progress) {
  auto m = whole_model(fine, "fine");
  if (!m) return std::unexpected(m.error());
  auto c = whole_model(coarse, "coarse");
  if (!c) return std::unexpected(c.error());
  if (coarse.vertices.size() > fine.vertices.size())
    return fail(Errc::invalid_argument, "the coarse model has more vertices than the fine one");
  auto models = cap_borders(std::move(*m), std::move(*c));
  if (!models) return std::unexpected(models.error());
  if (const int a = handles(models->fine), b = handles(models->coarse); a != b)
    return fail(Errc::invalid_argument, "the two models differ in their number of handles: " +
                                            std::to_string(a) + " and " + std::to_string(b));
  const auto sets = vertex_sets(*models, progress.part(0, 0.7));
  if (!sets) return std::unexpected(sets.error());
  const double moved = lattice ? snap(models->fine, *lattice) : 0;
  if (lattice) snap(models->coarse, *lattice);
  const std::size_t coarse_slots = models->coarse.vertex_slots();

  BetweenModels out;
  std::vector<std::size_t> tried(coarse_slots, 0);
  std::vector<SetPlan> plans(coarse_slots, kPlans[0]);
  // Where most vertices had to be split in, the paths wind, and no order of collapses helps.
  const bool winding = sets->split_in > kWinding * fine.vertices.size();
  const std::size_t rounds = winding ? 1 : kPlans.size();
  for (std::size_t round = 0; round < rounds && (round == 0 || out.turned > 0); ++round) {
    const double done = 0.7 + 0.3 * double(round) / double(kPlans.size());
    CollapsedSets made =
        collapse_sets(*models, *sets, plans, lattice, progress.part(done, done + 0.02));
    if (progress.stopped()) return fail(Errc::cancelled, "it was stopped");
    if (const auto ok = arrived(made, coarse); !ok) {
      if (round == 0) return std::unexpected(ok.error());
      break;
    }
    const std::size_t turned = triangles_turned(made.mesh);
    if (round == 0 || turned < out.turned) out.mesh = std::move(made.mesh), out.turned = turned;
    for (const Index j : made.turned) plans[j] = kPlans[++tried[j] % kPlans.size()];
  }
  out.split_in = sets->split_in;
  out.mesh.base.triangles = coarse.triangles;
  out.mesh.fine_error_m = moved;
  for (VertexSplit& s : out.mesh.splits) s.error_m = rounded_up(double(s.error_m) + moved);
  return out;
}

std::size_t triangles_turned(const ProgressiveMesh& pm) {
  auto cursor = ProgressiveCursor::open(pm);
  if (!cursor) return 0;
  std::size_t turned = 0;
  proto::SplitTopology::Fan fan;
  for (std::size_t i = 0; i < pm.splits.size(); ++i) {
    const VertexSplit& s = pm.splits[i];
    cursor->topology().fan(s.vertex, fan);
    const std::size_t n = fan.ring.size();
    const auto at = [&](std::uint32_t v) {
      return std::size_t(std::ranges::find(fan.ring, v) - fan.ring.begin());
    };
    const std::size_t left = at(s.left);
    const std::size_t over =
        s.right == VertexSplit::kNone ? n - 1 - left : (at(s.right) + n - left) % n;
    const auto positions = cursor->positions();
    for (std::size_t k = 0; k < fan.edges.size(); ++k) {
      const Vec3 &a = positions[fan.ring[k]], &b = positions[fan.ring[(k + 1) % n]];
      const Vec3& to = (k + n - left) % n < over ? s.added : s.vertex_fine;
      const Vec3 was = cross(a - s.vertex_coarse, b - s.vertex_coarse), now = cross(a - to, b - to);
      turned += dot(was, now) <= 0 && dot(was, was) > 0 && dot(now, now) > 0;
    }
    cursor->seek(i + 1);
  }
  return turned;
}

}  // namespace tind
