#include "terrain/raster/dem_window.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "terrain/base/hash.h"
#include "terrain/geo/ellipsoid.h"

namespace tind {
namespace {

constexpr double kSnap = 1e-6;     // posts: PROJ there and back is not exact
constexpr int kPiecesASide = 256;  // of outlines

/// The smallest box of numbers.
struct Span {
  double low = std::numeric_limits<double>::infinity();
  double high = -std::numeric_limits<double>::infinity();
  void take(double v) { low = std::min(low, v), high = std::max(high, v); }
  std::int64_t first() const { return whole(std::floor(low + kSnap)); }
  std::int64_t last() const { return whole(std::ceil(high - kSnap)); }

 private:
  /// Far beyond all posts there are no numbers for them.
  static std::int64_t whole(double v) { return std::int64_t(std::clamp(v, -1e15, 1e15)); }
};

class DemWindow : public DemSource {
 public:
  DemWindow(std::shared_ptr<const DemSource> source, const PostRect& rect)
      : source_(std::move(source)), rect_(rect), info_(source_->info()) {
    info_.cols = rect.last_col - rect.col + 1, info_.rows = rect.last_row - rect.row + 1;
    Affine& map = info_.post_to_crs;
    const Vec2 first = map.apply(double(rect.col), double(rect.row));
    map.x0 = first.x, map.y0 = first.y;
    info_.wraps_longitude = info_.wraps_longitude && double(info_.cols) >= info_.period_cols;
    cut_covered();
    info_.fingerprint = hash128(info_.fingerprint + " " + std::to_string(rect.col) + " " +
                                std::to_string(rect.row) + " " + std::to_string(info_.cols) + " " +
                                std::to_string(info_.rows))
                            .text();
    if (info_.crs_kind != CrsKind::none) place_on_globe();
  }

  const DemInfo& info() const override { return info_; }
  Result<HeightGrid> read(std::int64_t col, std::int64_t row, int cols, int rows) const override {
    return cut(source_->read(col + rect_.col, row + rect_.row, cols, rows), col, row, 1);
  }
  Result<HeightGrid> read_decimated(std::int64_t col, std::int64_t row, int cols, int rows,
                                    int step) const override {
    return cut(source_->read_decimated(col + rect_.col, row + rect_.row, cols, rows, step), col,
               row, step);
  }
  void to_post(std::span<const Geographic> in, std::span<Vec2> out) const override {
    source_->to_post(in, out);
    const double period = source_->info().wraps_longitude ? info_.period_cols : 0;
    for (Vec2& p : out) {
      p.x -= double(rect_.col), p.y -= double(rect_.row);
      if (period > 0) p.x -= period * std::floor((p.x + kSnap) / period);
    }
  }
  void to_geographic(std::span<const Vec2> in, std::span<Geographic> out) const override {
    std::vector<Vec2> posts(in.begin(), in.end());
    for (Vec2& p : posts) p.x += double(rect_.col), p.y += double(rect_.row);
    source_->to_geographic(posts, out);
  }
  std::vector<UndeclaredNodata> undeclared_nodata() const override {
    return source_->undeclared_nodata();
  }
  Result<void> unchanged() const override { return source_->unchanged(); }
  bool is_plain_geographic() const override { return source_->is_plain_geographic(); }

 private:
  std::shared_ptr<const DemSource> source_;
  PostRect rect_;
  DemInfo info_;

  void cut_covered() {
    std::vector<PostRect> cut;
    for (PostRect r : std::exchange(info_.covered, {})) {
      r = {r.col - rect_.col, r.row - rect_.row, r.last_col - rect_.col, r.last_row - rect_.row};
      // Beyond the rim of a source that goes around are the columns of its other side.
      const auto around = std::int64_t(source_->info().wraps_longitude ? info_.period_cols : 0);
      for (const std::int64_t by : {-around, std::int64_t(0), around}) {
        PostRect part{std::max<std::int64_t>(0, r.col + by), std::max<std::int64_t>(0, r.row),
                      std::min(info_.cols - 1, r.last_col + by),
                      std::min(info_.rows - 1, r.last_row)};
        if (part.col <= part.last_col && part.row <= part.last_row) cut.push_back(part);
        if (around == 0) break;
      }
    }
    info_.covered = std::move(cut);
  }

  void place_on_globe() {
    const double east = double(info_.cols - 1), south = double(info_.rows - 1);
    const Vec2 m{east / 2, south / 2};
    std::vector<Vec2> posts = {{m.x - .5, m.y}, {m.x + .5, m.y}, {m.x, m.y - .5}, {m.x, m.y + .5}};
    for (int i = 0; i <= kPiecesASide; ++i) {
      const double t = double(i) / kPiecesASide;
      posts.insert(posts.end(),
                   {{t * east, 0}, {t * east, south}, {0, t * south}, {east, t * south}});
    }
    std::vector<Geographic> places(posts.size());
    to_geographic(posts, places);
    const auto distance = [&](std::size_t a, std::size_t b) {
      return length(wgs84::to_ecef(places[a], 0) - wgs84::to_ecef(places[b], 0));
    };
    info_.spacing_x_m = distance(0, 1), info_.spacing_y_m = distance(2, 3);

    Span lon, lat;
    for (std::size_t i = 4; i < places.size(); ++i) {
      if (!std::isfinite(places[i].lon) || !std::isfinite(places[i].lat)) continue;
      // Counted from the middle of the window, a rim never jumps by a turn.
      lon.take(places[0].lon + std::remainder(places[i].lon - places[0].lon, 360));
      lat.take(places[i].lat);
    }
    const GeoRect whole = source_->info().bounds;
    GeoRect box{lon.low, std::max(lat.low, whole.south), lon.high, std::min(lat.high, whole.north)};
    if (!(box.west >= -180 && box.east <= 180) || info_.wraps_longitude)
      box.west = -180, box.east = 180;
    // A window with a pole inside reaches farther than its rim: as far as the whole.
    if (reaches_a_pole()) box = {-180, whole.south, 180, whole.north};
    info_.bounds = box;
    info_.extents.clear();
  }

  bool reaches_a_pole() const {
    if (info_.crs_kind != CrsKind::projected) return false;
    const Geographic poles[] = {{0, 90}, {0, -90}};
    Vec2 at[2];
    source_->to_post(poles, at);
    return std::ranges::any_of(at, [&](const Vec2& p) {
      return p.x >= double(rect_.col) && p.x <= double(rect_.last_col) &&
             p.y >= double(rect_.row) && p.y <= double(rect_.last_row);
    });
  }

  /// The source goes on beyond the window; the window does not.
  Result<HeightGrid> cut(Result<HeightGrid> posts, std::int64_t col, std::int64_t row,
                         int step) const {
    if (!posts) return posts;
    for (int j = 0; j < posts->rows(); ++j) {
      const std::int64_t r = row + std::int64_t(j) * step;
      const bool in_rows = r >= 0 && r < info_.rows;
      for (int i = 0; i < posts->cols(); ++i) {
        const std::int64_t c = col + std::int64_t(i) * step;
        const bool in_cols = info_.wraps_longitude || (c >= 0 && c < info_.cols);
        if (!in_rows || !in_cols) posts->at(i, j) = HeightGrid::kVoid;
      }
    }
    return posts;
  }
};

}  // namespace

std::vector<Geographic> outline_of(const GeoRect& r) {
  std::vector<Geographic> places;
  for (int i = 0; i <= kPiecesASide; ++i) {
    const double lon = r.west + r.width() * i / kPiecesASide;
    const double lat = r.south + r.height() * i / kPiecesASide;
    for (const double edge : {r.south, r.north}) places.push_back({lon, edge});
    for (const double edge : {r.west, r.east}) places.push_back({edge, lat});
  }
  return places;
}

Result<PostRect> posts_around(const DemSource& source, std::span<const Geographic> outline) {
  const DemInfo& info = source.info();
  if (info.crs_kind == CrsKind::none)
    return fail(Errc::invalid_argument,
                "the DEM has no CRS, so that it is not known where an area lies in it: say its "
                "CRS (--crs)");
  std::vector<Vec2> posts(outline.size());
  source.to_post(outline, posts);
  Span cols, rows;
  // Around the globe columns go on as the outline's longitudes do, from the first that there is.
  std::optional<std::size_t> first;
  for (std::size_t i = 0; i < posts.size(); ++i) {
    Vec2 p = posts[i];
    if (!std::isfinite(p.x) || !std::isfinite(p.y)) continue;
    if (!first) first = i;
    if (info.wraps_longitude) {
      const double turns = (outline[i].lon - outline[*first].lon) / 360;
      const double there =
          posts[*first].x + std::copysign(turns, info.post_to_crs.x_col * turns) * info.period_cols;
      p.x += std::round((there - p.x) / info.period_cols) * info.period_cols;
    }
    cols.take(p.x), rows.take(p.y);
  }
  PostRect rect{cols.first(), rows.first(), cols.last(), rows.last()};
  const bool somewhere = cols.low <= cols.high;
  if (somewhere) {
    rect.row = std::max<std::int64_t>(rect.row, 0);
    rect.last_row = std::min(rect.last_row, info.rows - 1);
    const bool around =
        info.wraps_longitude && cols.high - cols.low >= info.period_cols - 1 - kSnap;
    if (around) rect.col = 0, rect.last_col = info.cols - 1;
    if (!info.wraps_longitude) {
      rect.col = std::max<std::int64_t>(rect.col, 0);
      rect.last_col = std::min(rect.last_col, info.cols - 1);
    }
  }
  if (!somewhere || rect.col > rect.last_col || rect.row > rect.last_row) {
    const GeoRect& b = info.bounds;
    const auto text = [](double v) {
      std::string s = std::to_string(v);
      return s.substr(0, s.size() - 2);
    };
    return fail(Errc::out_of_range, "the area lies outside of the DEM, which reaches from " +
                                        text(b.west) + "," + text(b.south) + " to " + text(b.east) +
                                        "," + text(b.north) + " (longitude,latitude)");
  }
  return rect;
}

std::shared_ptr<const DemSource> dem_window(std::shared_ptr<const DemSource> source,
                                            const PostRect& rect) {
  return std::make_shared<const DemWindow>(std::move(source), rect);
}

}  // namespace tind
