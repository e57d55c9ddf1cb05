// Where a split happens in the arrays depends on its number alone, so it is searched for once, when
// the mesh is opened; afterwards a split costs a walk over the faces that go over. The list says
// long before which faces those are: they are sent for ahead of time.

#include "terrain/progressive/stream/progressive_cursor.h"

#include <algorithm>
#include <string>

namespace tind {

namespace {

constexpr std::size_t kAhead = 12;  // splits

}  // namespace

Result<ProgressiveCursor> ProgressiveCursor::open(const ProgressiveMesh& mesh) {
  ProgressiveCursor c;
  c.mesh_ = &mesh;
  std::string problem;
  c.topology_ = proto::SplitTopology(mesh.base.triangles, mesh.base.vertices.size(),
                                     mesh.splits.size(), problem);
  if (!problem.empty()) return fail(Errc::bad_data, problem);
  c.positions_ = mesh.base.vertices;
  c.positions_.resize(mesh.base.vertices.size() + mesh.splits.size());
  c.places_.reserve(mesh.splits.size());
  for (const VertexSplit& s : mesh.splits) {
    const std::size_t known = c.topology_.vertices();
    const bool there =
        s.vertex < known && s.left < known && (s.right < known || s.right == VertexSplit::kNone);
    const auto place =
        there ? c.topology_.place(s.vertex, s.left, s.right) : proto::SplitTopology::Place{};
    if (place.edge == proto::SplitTopology::kNone)
      return fail(Errc::bad_data, "split " + std::to_string(c.places_.size()) +
                                      " names vertices that are not neighbours");
    c.topology_.split(place, s.right);
    c.places_.push_back(place);
    c.triangles_after_.push_back(std::uint32_t(c.topology_.faces()));
  }
  while (c.topology_.splits() > 0) c.topology_.unsplit();
  return c;
}

double ProgressiveCursor::error_m() const {
  return position() < size() ? double(mesh_->splits[position()].error_m) : mesh_->fine_error_m;
}

void ProgressiveCursor::up() {
  const std::size_t i = topology_.splits();
  const VertexSplit& s = mesh_->splits[i];
  topology_.split(places_[i], s.right);
  positions_[s.vertex] = s.vertex_fine;
  positions_[mesh_->base.vertices.size() + i] = s.added;
}

void ProgressiveCursor::down() {
  topology_.unsplit();
  const VertexSplit& s = mesh_->splits[topology_.splits()];
  positions_[s.vertex] = s.vertex_coarse;
}

void ProgressiveCursor::seek(std::size_t count) {
  count = std::min(count, size());
  while (position() < count) {
    const std::size_t later = position() + kAhead;
    if (later < count) {
      topology_.prefetch(places_[later].edge);
      __builtin_prefetch(&positions_[mesh_->splits[later].vertex]);
    }
    up();
  }
  while (position() > count) {
    if (position() > kAhead) {
      const std::size_t later = position() - kAhead;
      topology_.prefetch(places_[later].edge);
      __builtin_prefetch(&positions_[mesh_->splits[later].vertex]);
    }
    down();
  }
}

std::size_t ProgressiveCursor::position_for_error(double error_m) const {
  const auto within = std::ranges::partition_point(
      mesh_->splits, [&](const VertexSplit& s) { return double(s.error_m) > error_m; });
  return std::size_t(within - mesh_->splits.begin());
}

std::size_t ProgressiveCursor::position_for_triangles(std::size_t triangles) const {
  return std::size_t(std::ranges::upper_bound(triangles_after_, triangles) -
                     triangles_after_.begin());
}

Tin ProgressiveCursor::extract() const {
  Tin tin;
  tin.vertices.assign(positions().begin(), positions().end());
  tin.triangles.reserve(triangles());
  for (Index f = 0; f < topology_.face_slots(); ++f) {
    if (topology_.used(f))
      tin.triangles.push_back(
          {topology_.origin(3 * f), topology_.origin(3 * f + 1), topology_.origin(3 * f + 2)});
  }
  return tin;
}

Tin ProgressiveCursor::geomorph(double ahead) {
  const std::size_t here = position();
  if (here == size()) return extract();
  seek(here + 1);
  Tin tin = extract();
  seek(here);
  const VertexSplit& s = mesh_->splits[here];
  const auto on_the_way = [&](const Vec3& to) {
    return ahead >= 1 ? to : s.vertex_coarse + (to - s.vertex_coarse) * ahead;
  };
  tin.vertices[s.vertex] = on_the_way(s.vertex_fine);
  tin.vertices.back() = on_the_way(s.added);
  return tin;
}

}  // namespace tind
