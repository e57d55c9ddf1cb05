#include "terrain/simplify/insertion/line_points.h"

namespace tind {

void LinePoints::add_line(Index a, Index b, std::span<const Vec3> inner) {
  edges_.add(a, b);
  const std::size_t first = points_.size();
  for (const Vec3& p : inner) points_.push_back({p, lines_.size()});
  lines_.push_back({a, b, first, points_.size()});
}

void LinePoints::index_points() {
  order_.resize(points_.size());
  for (std::uint32_t k = 0; k < order_.size(); ++k) order_[k] = k;
  std::sort(order_.begin(), order_.end(), [&](std::uint32_t i, std::uint32_t j) {
    const Vec3 &p = points_[i].at, &q = points_[j].at;
    const int s = strip_of(p.y), t = strip_of(q.y);
    return s != t ? s < t : p.x != q.x ? p.x < q.x : i < j;
  });
  if (order_.empty()) return;
  first_strip_ = strip_of(points_[order_.front()].at.y);
  const int strips = strip_of(points_[order_.back()].at.y) - first_strip_ + 1;
  strip_start_.assign(std::size_t(strips) + 1, 0);
  for (const Point& p : points_) ++strip_start_[std::size_t(strip_of(p.at.y) - first_strip_) + 1];
  for (std::size_t s = 1; s < strip_start_.size(); ++s) strip_start_[s] += strip_start_[s - 1];
}

LinePoints::Index LinePoints::insert(HalfedgeMesh& mesh, std::size_t k) {
  Point& point = points_[k];
  if (point.vertex != kNone) return kNone;
  const Line& line = lines_[point.line];
  Index u = line.a, w = line.b;
  for (std::size_t i = k; i > line.first && u == line.a; --i)
    if (points_[i - 1].vertex != kNone) u = points_[i - 1].vertex;
  for (std::size_t i = k + 1; i < line.last && w == line.b; ++i)
    if (points_[i].vertex != kNone) w = points_[i].vertex;
  const Index h = mesh.find_edge(u, w);
  if (h == kNone) return kNone;
  const auto has_room = [&](Index e) {
    const Vec3& apex = mesh.position(mesh.apex(e));
    return surely_ccw(mesh.position(mesh.origin(e)), point.at, apex) &&
           surely_ccw(point.at, mesh.position(mesh.dest(e)), apex);
  };
  if (!has_room(h) || (mesh.twin(h) != kNone && !has_room(mesh.twin(h)))) return kNone;
  point.vertex = mesh.split_edge(h, point.at);
  edges_.remove(u, w);
  edges_.add(u, point.vertex);
  edges_.add(point.vertex, w);
  return point.vertex;
}

}  // namespace tind
