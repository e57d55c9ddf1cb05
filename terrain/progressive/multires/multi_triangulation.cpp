// The collapses run from fine to coarse. A triangle is written down when it goes: by then both its
// ends are known, the node that splits it (whose collapse made it) and the one that makes it (this
// collapse). The reference to it from its splitter's list was left open, and is filled in now.

#include "terrain/progressive/multires/multi_triangulation.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "terrain/progressive/multires/post_error.h"

namespace tind {

namespace {

using Index = MultiTriangulation::Index;
constexpr Index kNone = MultiTriangulation::kNone;

template <class T>
std::size_t bytes_of(const std::vector<T>& v) {
  return v.capacity() * sizeof(T);
}

template <class F>
void for_each_triangle_at(const HalfedgeMesh& mesh, Index vertex, F&& f) {
  mesh.for_each_out(vertex, [&](Index h) { f(HalfedgeMesh::triangle(h)); });
}

}  // namespace

Index MultiTriangulation::maker(Index triangle) const {
  if (triangle >= base_begin()) return kNone;
  const auto next = std::upper_bound(first_fine_.begin(), first_fine_.end(), triangle);
  return Index(next - first_fine_.begin()) - 1;
}

std::vector<Index> MultiTriangulation::base_vertices() const {
  std::vector<Index> out;
  for (Index t = base_begin(); t < triangles(); ++t)
    out.insert(out.end(), corners_[t].begin(), corners_[t].end());
  std::sort(out.begin(), out.end());
  out.erase(std::unique(out.begin(), out.end()), out.end());
  return out;
}

std::size_t MultiTriangulation::memory_bytes() const {
  return bytes_of(vertices_) + bytes_of(corners_) + bytes_of(error_) + bytes_of(steepest_) +
         bytes_of(splitter_) + bytes_of(coarse_) + bytes_of(first_fine_) + bytes_of(first_coarse_) +
         bytes_of(added_) + bytes_of(moved_);
}

MultiTriangulationBuilder::MultiTriangulationBuilder(HalfedgeMesh& mesh, const Terrain& dem)
    : mesh_(mesh), dem_(dem), slots_(mesh.triangle_slots()), vertex_(mesh.vertex_slots()) {
  for (Index v = 0; v < vertex_.size(); ++v) vertex_[v] = v;
  made_.vertices_.assign(mesh.positions().begin(), mesh.positions().end());
  for (Index t = 0; t < slots_.size(); ++t) {
    if (!mesh.alive_triangle(t)) continue;
    slots_[t] = {kNone, kNone, 0, 0};
    measure(t, slope(t));
  }
  const std::size_t expected = 6 * mesh.vertex_slots() + 64;  // a vertex has six triangles
  made_.corners_.reserve(expected);
  made_.error_.reserve(expected);
  made_.steepest_.reserve(expected);
  made_.splitter_.reserve(expected);
  made_.coarse_.reserve(4 * mesh.vertex_slots() + 64);
  for (auto* list : {&made_.first_fine_, &made_.first_coarse_, &made_.added_})
    list->reserve(mesh.vertex_slots() + 1);
}

void MultiTriangulationBuilder::measure(Index t, std::uint8_t steepest) {
  const auto corner = [&](Index k) { return mesh_.position(mesh_.origin(3 * t + k)); };
  slots_[t].error = float_above(worst_post(dem_.grid, corner(0), corner(1), corner(2)));
  slots_[t].steepest = steepest;
}

/// Degrees, rounded up.
std::uint8_t MultiTriangulationBuilder::slope(Index t) const {
  const auto corner = [&](Index k) {
    const Vec3& p = mesh_.position(mesh_.origin(3 * t + k));
    return Vec3{p.x * dem_.spacing_x_m, p.y * dem_.spacing_y_m, p.z};
  };
  const Vec3 a = corner(0), n = cross(corner(1) - a, corner(2) - a);
  return std::uint8_t(std::ceil(std::atan2(std::hypot(n.x, n.y), n.z) * 180 / std::numbers::pi));
}

/// Writes a triangle down for good; `reference` is how its splitter finds it.
void MultiTriangulationBuilder::keep(Index t, Index reference) {
  const Slot& slot = slots_[t];
  const auto vertex = [&](Index k) { return vertex_[mesh_.origin(3 * t + k)]; };
  made_.corners_.push_back({vertex(0), vertex(1), vertex(2)});
  made_.error_.push_back(slot.error);
  made_.steepest_.push_back(slot.steepest);
  made_.splitter_.push_back(slot.splitter);
  if (slot.coarse_at != kNone) made_.coarse_[slot.coarse_at] = reference;
}

bool MultiTriangulationBuilder::collapse(Index h, const Vec3& at) {
  const Index gone = mesh_.origin(h), kept = mesh_.dest(h);
  const bool moves = at != mesh_.position(kept);
  star_.clear();
  for_each_triangle_at(mesh_, gone, [&](Index t) { star_.push_back(t); });
  if (moves)
    for_each_triangle_at(mesh_, kept, [&](Index t) {
      if (std::find(star_.begin(), star_.end(), t) == star_.end()) star_.push_back(t);
    });
  if (star_.size() > MultiTriangulation::kMostFine) return false;

  const Index node = Index(made_.added_.size());
  made_.first_fine_.push_back(Index(made_.corners_.size()));
  made_.first_coarse_.push_back(Index(made_.coarse_.size()));
  std::uint8_t steepest = 0;
  for (Index k = 0; k < star_.size(); ++k) {
    keep(star_[k], node * MultiTriangulation::kMostFine + k);
    steepest = std::max(steepest, slots_[star_[k]].steepest);
  }
  made_.added_.push_back(vertex_[gone]);
  if (moves || !made_.moved_.empty()) made_.moved_.resize(node + 1, kNone);
  if (moves) {
    made_.moved_[node] = vertex_[kept];
    vertex_[kept] = Index(made_.vertices_.size());
    made_.vertices_.push_back(at);
  }

  mesh_.collapse(h);
  mesh_.position(kept) = at;
  for (const Index t : star_) {
    if (!mesh_.alive_triangle(t)) continue;
    slots_[t] = {node, Index(made_.coarse_.size()), 0, 0};
    measure(t, steepest);
    made_.coarse_.push_back(kNone);
  }
  return true;
}

MultiTriangulation MultiTriangulationBuilder::finish() {
  made_.first_fine_.push_back(Index(made_.corners_.size()));
  made_.first_coarse_.push_back(Index(made_.coarse_.size()));
  if (!made_.moved_.empty()) made_.moved_.resize(made_.added_.size(), kNone);
  Index place = 0;
  for (Index t = 0; t < slots_.size(); ++t)
    if (mesh_.alive_triangle(t)) keep(t, MultiTriangulation::kBaseFlag | place++);
  return std::move(made_);
}

}  // namespace tind
