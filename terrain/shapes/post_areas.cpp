#include "terrain/shapes/post_areas.h"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace tind {

namespace {

PostRect clipped(const DemInfo& info, double col0, double col1, double row0, double row1) {
  constexpr double kMargin = 2;
  const double period = info.wraps_longitude ? std::llround(info.period_cols) : 0;
  PostRect r;
  r.col = std::int64_t(std::floor(std::max(std::min(col0, col1) - kMargin, -period)));
  r.last_col = std::int64_t(
      std::ceil(std::min(std::max(col0, col1) + kMargin, double(info.cols - 1) + period)));
  r.row = std::int64_t(std::floor(std::max(std::min(row0, row1) - kMargin, 0.0)));
  r.last_row =
      std::int64_t(std::ceil(std::min(std::max(row0, row1) + kMargin, double(info.rows - 1))));
  return r;
}

bool empty(const PostRect& r) { return r.col > r.last_col || r.row > r.last_row; }

std::vector<PostRect> plain_rects(const DemInfo& info, const GeoRect& degrees) {
  std::vector<PostRect> rects;
  for (const double turn : {0.0, 360.0, -360.0}) {
    const Vec2 nw = info.post_to_crs.invert(degrees.west + turn, degrees.north);
    const Vec2 se = info.post_to_crs.invert(degrees.east + turn, degrees.south);
    const PostRect r = clipped(info, nw.x, se.x, nw.y, se.y);
    if (!empty(r)) rects.push_back(r);
  }
  return rects;
}

}  // namespace

std::vector<PostRect> post_rects(const DemSource& source, const GeoRect& degrees) {
  const DemInfo& info = source.info();
  if (!(degrees.west <= degrees.east)) return {};
  if (source.is_plain_geographic()) return plain_rects(info, degrees);
  // The box, and what of it the DEM has, seen in posts; where that is not known, all of it.
  const GeoRect& b = info.bounds;
  GeoRect r = degrees;
  const bool apart = r.east < b.west || r.west > b.east;
  if (apart && (r.east + 360 < b.west || r.west + 360 > b.east) &&
      (r.east - 360 < b.west || r.west - 360 > b.east))
    return {};
  if (r.south > b.north || r.north < b.south) return {};
  if (!apart) r.west = std::max(r.west, b.west), r.east = std::min(r.east, b.east);
  r.south = std::max(r.south, b.south), r.north = std::min(r.north, b.north);
  constexpr int kSide = 17;
  std::vector<Geographic> places;
  for (int j = 0; j < kSide; ++j)
    for (int i = 0; i < kSide; ++i)
      places.push_back(
          {r.west + r.width() * i / (kSide - 1), r.south + r.height() * j / (kSide - 1)});
  std::vector<Vec2> posts(places.size());
  source.to_post(places, posts);
  Vec2 low{HUGE_VAL, HUGE_VAL}, high{-HUGE_VAL, -HUGE_VAL};
  bool known = r.width() < 6 && r.height() < 6 && !info.wraps_longitude;
  for (const Vec2& p : posts) {
    known = known && std::isfinite(p.x) && std::isfinite(p.y);
    low = {std::min(low.x, p.x), std::min(low.y, p.y)};
    high = {std::max(high.x, p.x), std::max(high.y, p.y)};
  }
  if (!known) return {{0, 0, info.cols - 1, info.rows - 1}};
  const double bend = 0.02 * std::max(high.x - low.x, high.y - low.y);
  const PostRect rect = clipped(info, low.x - bend, high.x + bend, low.y - bend, high.y + bend);
  if (empty(rect)) return {};
  return {rect};
}

std::uint32_t AreaRow::holding(double lon, double lat) {
  if (!by_rows_) return areas_.holding(lon, lat);
  if (lat != lat_) {
    if (!(lat == lat)) return AreaSet::kNone;
    lat_ = lat, at_ = 0;
    areas_.spans(lat, spans_);
    ends_.clear();
    for (const AreaSet::Span& s : spans_) ends_.push_back(s.west), ends_.push_back(s.east);
    std::sort(ends_.begin(), ends_.end());
    ends_.erase(std::unique(ends_.begin(), ends_.end()), ends_.end());
    between_.assign(ends_.size() + 1, AreaSet::kNone);
    next_.resize(ends_.size() + 2);
    std::iota(next_.begin(), next_.end(), std::size_t(0));
    // A stretch is passed by once it has its polygon, so that thousands on top of each other take
    // no longer than thousands beside each other.
    const auto open_from = [this](std::size_t k) {
      while (next_[k] != k) k = next_[k] = next_[next_[k]];
      return k;
    };
    // Spans come polygon by polygon: the first that reaches a stretch has the lowest number.
    for (const AreaSet::Span& s : spans_) {
      const auto behind = [this](double place) {
        return std::size_t(std::upper_bound(ends_.begin(), ends_.end(), place) - ends_.begin());
      };
      const std::size_t to = behind(s.east);
      for (std::size_t k = open_from(behind(s.west)); k < to; k = open_from(k))
        between_[k] = s.polygon, next_[k] = k + 1;
    }
  }
  while (at_ < ends_.size() && ends_[at_] <= lon) ++at_;
  while (at_ > 0 && ends_[at_ - 1] > lon) --at_;
  return between_[at_];
}

}  // namespace tind
