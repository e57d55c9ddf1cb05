// Post <-> geographic: an affine map, then (unless the CRS is WGS84 longitude and latitude) PROJ.
// The rest is longitudes: rasters run 0..360, cross the antimeridian, or go around the globe with
// a column too many or too few.

#include "terrain/raster/gdal/crs/gdal_frame.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "terrain/geo/ellipsoid.h"
#include "terrain/geo/longitude.h"

namespace tind::gdal {
namespace {

/// A whole turn in columns must be whole to this, or the raster does not close around the globe.
/// (A 5' globe whose step is rounded to 6 digits is off by 0.04.)
constexpr double kWholePeriod = 0.05;

/// The value of a + k * period in [from, from + period), exactly `a` where that is in it.
double wrapped(double a, double from, double period) {
  const double turns = std::floor((a - from) / period);
  return turns == 0 ? a : a - turns * period;
}

/// -180 <= lon < 180.
double normal(double lon) { return wrapped(lon, -180, 360); }

/// Posts along the edge of a part of the raster, of the whole 512 a side: densely enough that a
/// bulge between two is under a decimetre for rasters of a hundred kilometres.
std::vector<Vec2> rim(const PostRect& part, double share) {
  const int per_side = std::clamp(int(std::ceil(512 * share)), 16, 512);
  const auto west = double(part.col), north = double(part.row);
  const double width = double(part.last_col) - west, height = double(part.last_row) - north;
  std::vector<Vec2> posts;
  const auto add = [&](double x, double y) { posts.push_back({west + x, north + y}); };
  for (int i = 0; i < per_side; ++i) add(width * i / per_side, 0);
  for (int i = 0; i < per_side; ++i) add(width, height * i / per_side);
  for (int i = per_side; i > 0; --i) add(width * i / per_side, height);
  for (int i = per_side; i >= 0; --i) add(0, height * i / per_side);
  return posts;
}

/// Unwrapped west and east, any size, to -180..180: two rectangles where they cross +-180.
std::vector<GeoRect> within_a_turn(double west, double east, double south, double north) {
  constexpr double kTouch = 1e-9;
  const double shift = -360 * std::floor((west + kTouch + 180) / 360);
  west = std::max(west + shift, -180.0);
  east += shift;
  if (east <= 180 + kTouch) return {{west, south, std::min(east, 180.0), north}};
  return {{west, south, 180, north}, {-180, south, east - 360, north}};
}

/// A turn that moves no post of the raster by a millionth of a step is a rounding of who wrote it:
/// a raster is upright, or it is not.
Affine without_noise(Affine map, std::int64_t cols, std::int64_t rows) {
  constexpr double kNoise = 1e-6;
  if (std::abs(map.x_row) * double(rows) > kNoise * std::abs(map.x_col) ||
      std::abs(map.y_col) * double(cols) > kNoise * std::abs(map.y_row))
    return map;
  map.x_row = map.y_col = 0;
  return map;
}

}  // namespace

Result<Frame> Frame::make(const CrsFacts& crs, const Affine& post_to_crs, std::int64_t cols,
                          std::int64_t rows) {
  Frame frame;
  frame.map_ = without_noise(post_to_crs, cols, rows);
  frame.cols_ = cols;
  frame.rows_ = rows;
  frame.kind_ = crs.kind;
  frame.unit_m_ = crs.unit_m;
  frame.find_period(crs);
  if (crs.turn > 0) frame.full_turn_ = crs.turn;
  const bool upright = frame.map_.x_row == 0 && frame.map_.y_col == 0;
  frame.plain_ = crs.plain_wgs84 && upright;
  if (crs.kind != CrsKind::none && !frame.plain_) {
    auto made = ToGeographic::make(crs.wkt, post_to_crs.apply(double(cols) / 2, double(rows) / 2));
    if (!made) return std::unexpected(made.error());
    frame.transform_ = std::move(*made);
  }
  return frame;
}

void Frame::find_period(const CrsFacts& crs) {
  if (crs.kind != CrsKind::geographic || map_.x_row != 0 || map_.y_col != 0) return;
  turn_ = crs.turn;
  period_ = turn_ / std::abs(map_.x_col);
  const double whole = std::round(period_);
  wraps_ = whole > 1 && std::abs(period_ - whole) <= kWholePeriod && double(cols_) >= whole - 1;
  if (!wraps_) return;
  period_ = whole;
  map_.x_col = std::copysign(turn_ / whole, map_.x_col);
}

void Frame::to_post(std::span<const Geographic> in, std::span<Vec2> out) const {
  for (std::size_t i = 0; i < in.size(); ++i) out[i] = {in[i].lon, in[i].lat};
  if (kind_ == CrsKind::projected)  // 180 is -180
    for (Vec2& p : out.first(in.size())) p.x = p.x == 180 ? -180 : p.x;
  if (transform_) transform_->to_crs(out.first(in.size()));
  // Without wrapping, a longitude means the turn that lies nearest to the raster's middle.
  const double from = wraps_ ? 0 : (double(cols_) - 1 - period_) / 2;
  // Where columns are no longitudes, that is decided before there are columns.
  const bool turned = kind_ == CrsKind::geographic && period_ == 0;
  const double middle = map_.apply(double(cols_ - 1) / 2, double(rows_ - 1) / 2).x;
  for (Vec2& p : out.first(in.size())) {
    if (turned) p.x = nearest_turn(p.x, middle, full_turn_);
    p = map_.invert(p.x, p.y);
    if (period_ > 0 && std::isfinite(p.x)) p.x = wrapped(p.x, from, period_);
  }
  if (kind_ == CrsKind::projected) reach_antimeridian(in, out);
}

void Frame::to_pixel(std::span<const Geographic> in, std::span<Vec2> out) const {
  to_post(in, out);
  if (!wraps_) return;
  for (Vec2& p : out.first(in.size()))
    if (p.x >= double(cols_) - 0.5) p.x -= period_;
}

/// Many projections cut the globe at the antimeridian: it is at both ends of a raster of the whole
/// globe (then the end of -180 counts, so that a place has one height), or at the end of 180 only.
void Frame::reach_antimeridian(std::span<const Geographic> in, std::span<Vec2> out) const {
  std::vector<std::size_t> beside;
  std::vector<Vec2> places;
  for (std::size_t i = 0; i < in.size(); ++i)
    if (std::abs(in[i].lon) == 180 && !holds(out[i])) {
      beside.push_back(i);
      places.push_back({180, in[i].lat});
    }
  if (beside.empty()) return;
  transform_->to_crs(places);
  for (std::size_t k = 0; k < beside.size(); ++k)
    if (const Vec2 p = map_.invert(places[k].x, places[k].y); holds(p)) out[beside[k]] = p;
}

bool Frame::holds(Vec2 post) const {
  constexpr double kOut = 0.5 + 1e-6;  // a post reaches half the way to the next
  return post.x >= -kOut && post.y >= -kOut && post.x <= double(cols_ - 1) + kOut &&
         post.y <= double(rows_ - 1) + kOut;
}

void Frame::to_geographic(std::span<const Vec2> in, std::span<Geographic> out) const {
  std::vector<Vec2> crs(in.size());
  for (std::size_t i = 0; i < in.size(); ++i) crs[i] = map_.apply(in[i].x, in[i].y);
  if (transform_) transform_->to_geographic(crs);
  for (std::size_t i = 0; i < in.size(); ++i) out[i] = {normal(crs[i].x), crs[i].y};
}

Geographic Frame::geographic(Vec2 post) const {
  Geographic p;
  to_geographic({&post, 1}, {&p, 1});
  return p;
}

bool Frame::touches_globe(const PostRect& part) const {
  if (kind_ == CrsKind::none) return true;
  const bool all = part == PostRect{0, 0, cols_ - 1, rows_ - 1};
  const int side = all ? 17 : 5;  // there may be thousands of parts
  const auto cols = double(part.last_col - part.col), rows = double(part.last_row - part.row);
  constexpr double kMostTurns = 4;  // longitudes that are still degrees
  std::vector<Vec2> posts;
  for (int j = 0; j < side; ++j)
    for (int i = 0; i < side; ++i)
      posts.push_back(
          {double(part.col) + cols * i / (side - 1), double(part.row) + rows * j / (side - 1)});
  std::vector<Geographic> places(posts.size());
  to_geographic(posts, places);
  for (std::size_t i = 0; i < posts.size(); ++i) {
    const double x = map_.apply(posts[i].x, posts[i].y).x;
    const bool far = kind_ == CrsKind::geographic && !(std::abs(x) <= kMostTurns * full_turn_);
    if (!far && std::isfinite(places[i].lon) && std::abs(places[i].lat) <= 90) return true;
  }
  return false;
}

std::pair<Vec2, Vec2> Frame::coordinates(const PostRect& part) const {
  Vec2 least = map_.apply(double(part.col), double(part.row)), most = least;
  for (const std::int64_t col : {part.col, part.last_col})
    for (const std::int64_t row : {part.row, part.last_row}) {
      const Vec2 corner = map_.apply(double(col), double(row));
      least = {std::min(least.x, corner.x), std::min(least.y, corner.y)};
      most = {std::max(most.x, corner.x), std::max(most.y, corner.y)};
    }
  return {least, most};
}

bool Frame::fits_globe(const PostRect& part) const {
  if (kind_ != CrsKind::geographic) return true;
  // Grids of the whole globe have posts on both sides of a pole, and columns twice.
  const double step = std::abs(map_.y_row) + std::abs(map_.y_col);
  const double beyond = pole() + std::clamp(2 * step, full_turn_ / 360, full_turn_ / 24);
  const auto [least, most] = coordinates(part);
  return least.y >= -beyond && most.y <= beyond && most.x - least.x <= 1.5 * full_turn_;
}

GeoRect Frame::bounds() const {
  const std::vector<GeoRect> all = extents({0, 0, cols_ - 1, rows_ - 1});
  return all.size() == 1 ? all[0] : GeoRect{-180, all[0].south, 180, all[0].north};
}

std::vector<GeoRect> Frame::extents(const PostRect& part) const {
  constexpr GeoRect kGlobe{-180, -90, 180, 90};
  if (kind_ == CrsKind::none) return {kGlobe};
  const auto cols = double(part.last_col - part.col), rows = double(part.last_row - part.row);
  // Of a part it depends on nothing else: another file beside it does not move it by a hair.
  constexpr double kWhole = 16384;
  const bool all = part == PostRect{0, 0, cols_ - 1, rows_ - 1};
  const std::vector<Vec2> posts = rim(part, all ? 1 : std::max(cols, rows) / kWhole);
  std::vector<Geographic> places(posts.size());
  to_geographic(posts, places);
  double lon = places[0].lon, west = lon, east = lon, south = 90, north = -90;
  for (const Geographic& p : places) {
    if (!std::isfinite(p.lon) || !std::isfinite(p.lat)) return {kGlobe};
    lon += normal(p.lon - lon);  // continue around the rim without jumps of 360
    west = std::min(west, lon);
    east = std::max(east, lon);
    south = std::min(south, p.lat);
    north = std::max(north, p.lat);
  }
  for (const double pole : {-90.0, 90.0}) {
    if (kind_ != CrsKind::projected) break;
    const Geographic p{0, pole};
    Vec2 post;
    to_post({&p, 1}, {&post, 1});
    if (!(post.x >= double(part.col) && post.y >= double(part.row) &&
          post.x <= double(part.last_col) && post.y <= double(part.last_row)))
      continue;
    (pole < 0 ? south : north) = pole;
    west = -180, east = 180;
  }
  south = std::max(south, -90.0);
  north = std::min(north, 90.0);
  const bool around = wraps_ && cols + 2 >= period_;  // one column may be missing
  if (around || east - west >= 360) return {{-180, south, 180, north}};
  return within_a_turn(west, east, south, north);
}

Vec2 Frame::spacing_m() const {
  if (kind_ == CrsKind::none)
    return {std::hypot(map_.x_col, map_.y_col) * unit_m_,
            std::hypot(map_.x_row, map_.y_row) * unit_m_};
  const Vec2 centre{(double(cols_) - 1) / 2, (double(rows_) - 1) / 2};
  const auto distance = [&](Vec2 a, Vec2 b) {
    return length(wgs84::to_ecef(geographic(a), 0) - wgs84::to_ecef(geographic(b), 0));
  };
  return {distance({centre.x - 0.5, centre.y}, {centre.x + 0.5, centre.y}),
          distance({centre.x, centre.y - 0.5}, {centre.x, centre.y + 0.5})};
}

}  // namespace tind::gdal
