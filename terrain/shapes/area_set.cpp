#include "terrain/shapes/area_set.h"

#include <algorithm>
#include <cmath>

namespace tind {

AreaSet::AreaSet(std::vector<Edge> edges) : edges_(std::move(edges)) {
  std::erase_if(edges_, [](const Edge& e) {
    return !(std::isfinite(e.a.x) && std::isfinite(e.a.y) && std::isfinite(e.b.x) &&
             std::isfinite(e.b.y));
  });
  std::stable_sort(edges_.begin(), edges_.end(),
                   [](const Edge& e, const Edge& f) { return e.polygon < f.polygon; });
  if (edges_.empty()) return;
  double north = -HUGE_VAL;
  south_ = HUGE_VAL;
  bounds_.assign(edges_.back().polygon + 1, {HUGE_VAL, HUGE_VAL, -HUGE_VAL, -HUGE_VAL});
  for (Edge& e : edges_) {
    if (e.a.y > e.b.y) std::swap(e.a, e.b);
    GeoRect& box = bounds_[e.polygon];
    box.west = std::min({box.west, e.a.x, e.b.x}), box.east = std::max({box.east, e.a.x, e.b.x});
    box.south = std::min(box.south, e.a.y), box.north = std::max(box.north, e.b.y);
    south_ = std::min(south_, e.a.y), north = std::max(north, e.b.y);
  }
  // Long edges are in many strips: as few strips that edges are in four each on average.
  double heights = 0;
  for (const Edge& e : edges_) heights += e.b.y - e.a.y;
  const double most = 4 * double(edges_.size()) * ((north - south_) / std::max(heights, 1e-300));
  const auto count =
      std::size_t(std::clamp(std::min(double(edges_.size()) / 4, most), 1.0, double(1 << 16)));
  per_strip_ = std::max((north - south_) / double(count), 1e-12);
  strip_start_.assign(count + 1, 0);
  for (const Edge& e : edges_)
    for (std::size_t s = strip_of(e.a.y); s <= strip_of(e.b.y); ++s) ++strip_start_[s + 1];
  for (std::size_t s = 0; s < count; ++s) strip_start_[s + 1] += strip_start_[s];
  in_strip_.resize(strip_start_.back());
  std::vector<std::uint32_t> next(strip_start_.begin(), strip_start_.end() - 1);
  for (std::uint32_t k = 0; k < edges_.size(); ++k)
    for (std::size_t s = strip_of(edges_[k].a.y); s <= strip_of(edges_[k].b.y); ++s)
      in_strip_[next[s]++] = k;
}

std::size_t AreaSet::strip_of(double lat) const {
  const double s = std::floor((lat - south_) / per_strip_);
  return std::size_t(std::clamp(s, 0.0, double(strips() - 1)));
}

/// f(polygon, lon) for the edges that cross the parallel, in order of their polygons, until it
/// returns false.
template <class F>
void AreaSet::each_crossing(double lat, F&& f) const {
  if (edges_.empty() || !(lat >= south_)) return;
  const std::size_t s = strip_of(lat);
  for (std::uint32_t k = strip_start_[s]; k < strip_start_[s + 1]; ++k) {
    const Edge& e = edges_[in_strip_[k]];
    if (!(e.a.y <= lat && lat < e.b.y)) continue;
    if (!f(e.polygon, e.a.x + (lat - e.a.y) / (e.b.y - e.a.y) * (e.b.x - e.a.x))) return;
  }
}

std::uint32_t AreaSet::holding(double lon, double lat) const {
  std::uint32_t current = kNone;
  bool inside = false;
  each_crossing(lat, [&](std::uint32_t polygon, double x) {
    if (polygon != current) {
      if (inside) return false;
      current = polygon;
    }
    inside ^= x > lon;
    return true;
  });
  return inside ? current : kNone;
}

void AreaSet::all_holding(double lon, double lat, std::vector<std::uint32_t>& polygons) const {
  polygons.clear();
  std::uint32_t current = kNone;
  bool inside = false;
  each_crossing(lat, [&](std::uint32_t polygon, double x) {
    if (polygon != current) {
      if (inside) polygons.push_back(current);
      current = polygon, inside = false;
    }
    inside ^= x > lon;
    return true;
  });
  if (inside) polygons.push_back(current);
}

void AreaSet::spans(double lat, std::vector<Span>& spans) const {
  spans.clear();
  std::vector<double> at;
  std::uint32_t current = kNone;
  const auto close = [&] {
    std::sort(at.begin(), at.end());
    for (std::size_t k = 0; k + 1 < at.size(); k += 2)
      if (at[k] < at[k + 1]) spans.push_back({at[k], at[k + 1], current});
    at.clear();
  };
  each_crossing(lat, [&](std::uint32_t polygon, double x) {
    if (polygon != current) close(), current = polygon;
    at.push_back(x);
    return true;
  });
  close();
}

bool AreaSet::crosses(const GeoRect& r) const {
  if (edges_.empty()) return false;
  for (std::size_t s = strip_of(r.south); s <= strip_of(r.north); ++s)
    for (std::uint32_t k = strip_start_[s]; k < strip_start_[s + 1]; ++k) {
      const Edge& e = edges_[in_strip_[k]];
      // Clipped to the rectangle's latitudes: does what is left meet its longitudes?
      const double low = std::max(e.a.y, r.south), high = std::min(e.b.y, r.north);
      if (low > high) continue;
      const double run = e.b.y - e.a.y;
      const auto x_at = [&](double y) { return e.a.x + (y - e.a.y) / run * (e.b.x - e.a.x); };
      const double p = run > 0 ? x_at(low) : e.a.x, q = run > 0 ? x_at(high) : e.b.x;
      if (std::min(p, q) <= r.east && std::max(p, q) >= r.west) return true;
    }
  return false;
}

}  // namespace tind
