// Both shapes are a line with a reach: a ring has reach 0 and an inside.

#include "terrain/progressive/multires/region.h"

#include <algorithm>

namespace tind {

namespace {

constexpr double kTouch = 1e-9;  // so near is on the line

double cross(Vec2 o, Vec2 a, Vec2 b) {
  return (a.x - o.x) * (b.y - o.y) - (a.y - o.y) * (b.x - o.x);
}

double distance(Vec2 p, Vec2 a, Vec2 b) {
  const Vec2 d{b.x - a.x, b.y - a.y};
  const double l2 = d.x * d.x + d.y * d.y;
  const double t = l2 > 0 ? std::clamp(((p.x - a.x) * d.x + (p.y - a.y) * d.y) / l2, 0.0, 1.0) : 0;
  return std::hypot(a.x + t * d.x - p.x, a.y + t * d.y - p.y);
}

double distance(Vec2 a, Vec2 b, Vec2 c, Vec2 d) {
  if (cross(a, b, c) * cross(a, b, d) < 0 && cross(c, d, a) * cross(c, d, b) < 0) return 0;
  return std::min({distance(a, c, d), distance(b, c, d), distance(c, a, b), distance(d, a, b)});
}

bool in_triangle(Vec2 p, const Vec2 (&t)[3]) {
  const double u = cross(t[0], t[1], p), v = cross(t[1], t[2], p), w = cross(t[2], t[0], p);
  return (u >= 0 && v >= 0 && w >= 0) || (u <= 0 && v <= 0 && w <= 0);
}

double distance(Vec2 p, Vec2 q, const Vec2 (&t)[3]) {
  if (in_triangle(p, t)) return 0;
  return std::min(
      {distance(p, q, t[0], t[1]), distance(p, q, t[1], t[2]), distance(p, q, t[2], t[0])});
}

bool in_ring(Vec2 p, const std::vector<Vec2>& ring) {
  bool inside = false;
  for (std::size_t i = 0; i + 1 < ring.size(); ++i) {
    const Vec2 a = ring[i], b = ring[i + 1];
    if ((a.y > p.y) != (b.y > p.y) && p.x < a.x + (p.y - a.y) * (b.x - a.x) / (b.y - a.y))
      inside = !inside;
  }
  return inside;
}

}  // namespace

Region Region::polygon(std::vector<Vec2> ring) {
  ring.push_back(ring.front());
  Region out = corridor(ring, kTouch, 1, 1);
  out.ring_ = true;
  return out;
}

Region Region::corridor(const std::vector<Vec2>& route, double half_width_m, double metres_x,
                        double metres_y) {
  Region out;
  out.metres_x_ = metres_x, out.metres_y_ = metres_y;
  out.reach_ = half_width_m;
  for (const Vec2 p : route) out.line_.push_back(out.scaled(p.x, p.y));
  out.low_ = out.high_ = out.line_.front();
  for (const Vec2 p : out.line_) {
    out.low_ = {std::min(out.low_.x, p.x), std::min(out.low_.y, p.y)};
    out.high_ = {std::max(out.high_.x, p.x), std::max(out.high_.y, p.y)};
  }
  const double r = half_width_m + kTouch;
  out.low_ = {out.low_.x - r, out.low_.y - r};
  out.high_ = {out.high_.x + r, out.high_.y + r};
  return out;
}

bool Region::contains(Vec2 post) const {
  const Vec2 p = scaled(post.x, post.y);
  if (p.x < low_.x || p.y < low_.y || p.x > high_.x || p.y > high_.y) return false;
  if (ring_ && in_ring(p, line_)) return true;
  for (std::size_t i = 0; i + 1 < line_.size(); ++i)
    if (distance(p, line_[i], line_[i + 1]) <= reach_) return true;
  return false;
}

bool Region::touches(const Vec3& a, const Vec3& b, const Vec3& c) const {
  const Vec2 t[3] = {scaled(a.x, a.y), scaled(b.x, b.y), scaled(c.x, c.y)};
  const auto [x0, x1] = std::minmax({t[0].x, t[1].x, t[2].x});
  const auto [y0, y1] = std::minmax({t[0].y, t[1].y, t[2].y});
  if (x1 < low_.x || x0 > high_.x || y1 < low_.y || y0 > high_.y) return false;
  if (ring_ && in_ring(t[0], line_)) return true;
  for (std::size_t i = 0; i + 1 < line_.size(); ++i)
    if (distance(line_[i], line_[i + 1], t) <= reach_ + kTouch) return true;
  return false;
}

}  // namespace tind
