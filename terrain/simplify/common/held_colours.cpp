#include "terrain/simplify/common/held_colours.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace tind {

namespace {

/// Where the line at height y meets a triangle, if it does.
class Span {
 public:
  explicit Span(double y) : y_(y) {}

  void cross(const Vec3& p, const Vec3& q) {
    if ((p.y < y_ && q.y < y_) || (p.y > y_ && q.y > y_)) return;
    if (p.y == q.y) {
      take(p.x), take(q.x);
    } else {
      take(p.x + (y_ - p.y) / (q.y - p.y) * (q.x - p.x));
    }
  }
  double low() const { return low_; }
  double high() const { return high_; }

 private:
  double y_, low_ = HUGE_VAL, high_ = -HUGE_VAL;

  void take(double x) { low_ = std::min(low_, x), high_ = std::max(high_, x); }
};

}  // namespace

HeldColours::HeldColours(int cells, double extent, std::vector<Colour> nodes)
    : cells_(cells), step_(extent / cells), nodes_(std::move(nodes)) {}

HeldColours::Colour HeldColours::at(double x, double y) const {
  const double u = std::clamp(x / step_, 0.0, double(cells_));
  const double v = std::clamp(y / step_, 0.0, double(cells_));
  const int i = std::min(int(u), cells_ - 1), j = std::min(int(v), cells_ - 1);
  const float s = float(u - i), t = float(v - j);
  const Colour &a = node(i, j), &b = node(i + 1, j), &c = node(i, j + 1), &d = node(i + 1, j + 1);
  Colour out;
  for (std::size_t k = 0; k < 3; ++k) {
    const float low = a[k] + s * (b[k] - a[k]), high = c[k] + s * (d[k] - c[k]);
    out[k] = low + t * (high - low);
  }
  return out;
}

double HeldColours::error(const Vec3& a, const Vec3& b, const Vec3& c) const {
  const double area = (b.x - a.x) * (c.y - a.y) - (c.x - a.x) * (b.y - a.y);
  if (!(area > 0)) return 0;
  const Colour at_a = at(a.x, a.y), at_b = at(b.x, b.y), at_c = at(c.x, c.y);
  // The weights of b and c are linear in the place.
  const double bx = (c.y - a.y) / area, by = (a.x - c.x) / area;
  const double cx = (a.y - b.y) / area, cy = (b.x - a.x) / area;
  const int first = std::max(0, int(std::ceil(std::min({a.y, b.y, c.y}) / step_)));
  const int last = std::min(cells_, int(std::floor(std::max({a.y, b.y, c.y}) / step_)));
  double sum = 0;
  for (int j = first; j <= last; ++j) {
    const double y = j * step_;
    Span span(y);
    span.cross(a, b), span.cross(b, c), span.cross(c, a);
    if (!(span.low() <= span.high())) continue;
    const int from = std::max(0, int(std::ceil(span.low() / step_)));
    const int to = std::min(cells_, int(std::floor(span.high() / step_)));
    for (int i = from; i <= to; ++i) {
      const double x = i * step_ - a.x, up = y - a.y;
      const float of_b = float(bx * x + by * up), of_c = float(cx * x + cy * up);
      const Colour& wanted = node(i, j);
      for (std::size_t k = 0; k < 3; ++k) {
        const float wrong =
            at_a[k] + of_b * (at_b[k] - at_a[k]) + of_c * (at_c[k] - at_a[k]) - wanted[k];
        sum += double(wrong) * wrong;
      }
    }
  }
  return sum;
}

}  // namespace tind
