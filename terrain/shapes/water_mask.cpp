#include "terrain/shapes/water_mask.h"

#include <algorithm>
#include <cmath>

namespace tind {

namespace {

constexpr int kSide = 256;
constexpr int kParallels = 8;  // a row
constexpr int kPlaces = 4;     // a cell, each way

/// Shares of cells, row by row from the north.
using Cover = std::vector<float>;

/// Adds what of a row the spans cover, where they overlap once. In cells from the west.
void add_row(std::vector<AreaSet::Span>& spans, const GeoRect& r, float share, float* row) {
  const double per_cell = kSide / r.width();
  std::sort(spans.begin(), spans.end(),
            [](const auto& a, const auto& b) { return a.west < b.west; });
  double done = 0;
  for (const AreaSet::Span& s : spans) {
    const double from = std::max((s.west - r.west) * per_cell, done);
    const double to = std::min((s.east - r.west) * per_cell, double(kSide));
    if (!(from < to)) continue;
    done = to;
    const int first = int(from), last = std::min(int(to), kSide - 1);
    for (int i = first; i <= last; ++i)
      row[i] += share * float(std::min(to, i + 1.0) - std::max(from, double(i)));
  }
}

void cover_by_areas(const AreaSet& areas, const GeoRect& r, Cover& cover) {
  if (areas.empty()) return;
  if (!areas.crosses(r)) {  // all or nothing
    if (areas.holding((r.west + r.east) / 2, (r.south + r.north) / 2) != AreaSet::kNone)
      cover.assign(cover.size(), 1);
    return;
  }
  std::vector<AreaSet::Span> spans;
  for (int k = 0; k < kSide * kParallels; ++k) {
    areas.spans(r.north - r.height() * (k + 0.5) / (kSide * kParallels), spans);
    add_row(spans, r, 1.0f / kParallels, &cover[std::size_t(k / kParallels) * kSide]);
  }
}

/// Where the places of a rectangle lie in a raster: asked of PROJ on a lattice, linear in between.
class PlaceLattice {
 public:
  PlaceLattice(const DemSource& source, const GeoRect& r) : posts_(std::size_t(kNodes * kNodes)) {
    std::vector<Geographic> places;
    for (int j = 0; j < kNodes; ++j)
      for (int i = 0; i < kNodes; ++i)
        places.push_back(
            {r.west + r.width() * i / (kNodes - 1), r.north - r.height() * j / (kNodes - 1)});
    source.to_post(places, posts_);
    const double period = source.info().period_cols;
    for (std::size_t k = 0; period > 0 && k < posts_.size(); ++k) {  // no jump from one to the next
      const std::size_t before = k % kNodes ? k - 1 : k >= kNodes ? k - kNodes : k;
      const double turns = std::round((posts_[k].x - posts_[before].x) / period);
      if (std::isfinite(turns)) posts_[k].x -= turns * period;
    }
  }
  /// At shares of the way to the east and to the south.
  Vec2 at(double x, double y) const {
    x *= kNodes - 1, y *= kNodes - 1;
    const int i = std::min(int(x), kNodes - 2), j = std::min(int(y), kNodes - 2);
    const auto node = [&](int di, int dj) {
      return posts_[std::size_t(j + dj) * kNodes + std::size_t(i + di)];
    };
    const double fx = x - i, fy = y - j;
    const auto mix = [&](double nw, double ne, double sw, double se) {
      return (nw * (1 - fx) + ne * fx) * (1 - fy) + (sw * (1 - fx) + se * fx) * fy;
    };
    return {mix(node(0, 0).x, node(1, 0).x, node(0, 1).x, node(1, 1).x),
            mix(node(0, 0).y, node(1, 0).y, node(0, 1).y, node(1, 1).y)};
  }

 private:
  static constexpr int kNodes = 65;
  std::vector<Vec2> posts_;
};

/// The posts of a raster that a rectangle needs, thinned where they are many more than its places.
struct MaskPosts {
  HeightGrid posts;
  std::int64_t col = 0, row = 0, step = 1;
  double turn = 0;  // columns after which a place comes again; 0: none does

  bool water(Vec2 post) const {
    return water_at(post) ||
           (turn > 0 && (water_at({post.x - turn, post.y}) || water_at({post.x + turn, post.y})));
  }

 private:
  bool water_at(Vec2 post) const {
    const double c = std::round((post.x - double(col)) / double(step)),
                 r = std::round((post.y - double(row)) / double(step));
    if (!(c >= 0 && r >= 0 && c < posts.cols() && r < posts.rows())) return false;
    const float z = posts.at(int(c), int(r));
    return !std::isnan(z) && z != 0;
  }
};

Result<MaskPosts> posts_around(const DemSource& source, const PlaceLattice& places) {
  constexpr double kMost = 2 * kSide * kPlaces;  // posts a side
  Vec2 low{HUGE_VAL, HUGE_VAL}, high{-HUGE_VAL, -HUGE_VAL};
  for (int j = 0; j <= 64; ++j)
    for (int i = 0; i <= 64; ++i) {
      const Vec2 p = places.at(i / 64.0, j / 64.0);
      if (!std::isfinite(p.x) || !std::isfinite(p.y)) continue;
      low = {std::min(low.x, p.x), std::min(low.y, p.y)};
      high = {std::max(high.x, p.x), std::max(high.y, p.y)};
    }
  MaskPosts found;
  const DemInfo& info = source.info();
  if (!info.wraps_longitude && info.period_cols > 0) {
    // The turn that lies nearest; where the raster reaches into another, too, all of it is needed.
    const double middle = (low.x + high.x) / 2, width = high.x - low.x;
    const double turns = std::round((double(info.cols - 1) / 2 - middle) / info.period_cols);
    low.x += turns * info.period_cols, high.x += turns * info.period_cols;
    if (double(info.cols) + width >= info.period_cols) low.x = 0, high.x = double(info.cols - 1);
    found.turn = info.period_cols;
  }
  if (!info.wraps_longitude)
    low.x = std::max(low.x, -1.0), high.x = std::min(high.x, double(info.cols));
  low.y = std::max(low.y, -1.0), high.y = std::min(high.y, double(info.rows));
  if (!(low.x <= high.x && low.y <= high.y)) return found;
  while (std::max(high.x - low.x, high.y - low.y) / double(found.step) > kMost) found.step *= 2;
  const auto first = [&](double v) {
    return std::int64_t(std::floor(v / double(found.step))) * found.step;
  };
  found.col = first(low.x), found.row = first(low.y);
  const int cols = int((std::int64_t(std::ceil(high.x)) - found.col) / found.step) + 2;
  const int rows = int((std::int64_t(std::ceil(high.y)) - found.row) / found.step) + 2;
  auto read = found.step == 1
                  ? source.read(found.col, found.row, cols, rows)
                  : source.read_decimated(found.col, found.row, cols, rows, int(found.step));
  if (!read) return std::unexpected(read.error());
  found.posts = std::move(*read);
  return found;
}

Result<void> cover_by_raster(const DemSource& source, const GeoRect& r, Cover& cover) {
  const GeoRect& b = source.info().bounds;
  if (r.west > b.east || r.east < b.west || r.south > b.north || r.north < b.south) return {};
  const PlaceLattice places(source, r);
  const auto posts = posts_around(source, places);
  if (!posts) return std::unexpected(posts.error());
  constexpr int kAll = kSide * kPlaces;
  std::vector<float> shares(cover.size(), 0);
  for (int j = 0; j < kAll; ++j)
    for (int i = 0; i < kAll; ++i)
      if (posts->water(places.at((i + 0.5) / kAll, (j + 0.5) / kAll)))
        shares[std::size_t(j / kPlaces) * kSide + std::size_t(i / kPlaces)] +=
            1.0f / (kPlaces * kPlaces);
  // Of several waters the one that covers more of a cell counts there.
  for (std::size_t k = 0; k < cover.size(); ++k) cover[k] = std::max(cover[k], shares[k]);
  return {};
}

}  // namespace

Result<std::vector<std::uint8_t>> water_mask(const WaterSource& water, const GeoRect& r) {
  Cover cover(std::size_t(kSide) * kSide, 0);
  cover_by_areas(water.areas, r, cover);
  for (const auto& raster : water.rasters)
    if (auto done = cover_by_raster(*raster, r, cover); !done)
      return fail("the water mask", done.error());
  std::vector<std::uint8_t> mask(cover.size());
  for (std::size_t k = 0; k < cover.size(); ++k)
    mask[k] = std::uint8_t(std::lround(std::clamp(cover[k], 0.0f, 1.0f) * 255));
  if (std::ranges::all_of(mask, [&](std::uint8_t m) { return m == mask[0]; }) &&
      (mask[0] == 0 || mask[0] == 255))
    mask.resize(1);
  return mask;
}

}  // namespace tind
