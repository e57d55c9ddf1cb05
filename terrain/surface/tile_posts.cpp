#include "terrain/surface/tile_posts.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <optional>
#include <ranges>

#include "terrain/geo/extent_box.h"
#include "terrain/surface/post_warp.h"

namespace tind {

namespace {

constexpr double kHair = 1e-6;  // tile units: a post on the edge belongs to both tiles
constexpr int kMargin = 2;      // posts around the rectangle, for H between them

PostWindow clipped(const DemInfo& info, double col0, double col1, double row0, double row1) {
  PostWindow w;
  double first = std::floor(std::min(col0, col1)) - kMargin,
         last = std::ceil(std::max(col0, col1)) + kMargin;
  if (!info.wraps_longitude) {
    first = std::max(first, 0.0);
    last = std::min(last, double(info.cols - 1));
  }
  const double top = std::max(std::floor(std::min(row0, row1)) - kMargin, 0.0);
  const double bottom = std::min(std::ceil(std::max(row0, row1)) + kMargin, double(info.rows - 1));
  w.col = std::int64_t(first);
  w.row = std::int64_t(top);
  w.cols = std::int64_t(last - first) + 1;
  w.rows = std::int64_t(bottom - top) + 1;
  if (last < first) w.cols = 0;
  if (bottom < top) w.rows = 0;
  return w;
}

/// Of every turn in which the rectangle holds posts; where none does, the one with most of its
/// margin.
std::vector<PostWindow> plain_windows(const DemInfo& info, const GeoRect& r) {
  constexpr double kHairOfStep = 1e-9;
  const Affine& a = info.post_to_crs;
  std::vector<PostWindow> found, beside;
  const auto holds_column = [&](double from, double to) {
    const double first = std::max(0.0, std::ceil(std::min(from, to) - kHairOfStep));
    return first <= std::min(double(info.cols - 1), std::max(from, to) + kHairOfStep);
  };
  for (const double shift : {0.0, 360.0, -360.0}) {
    const Vec2 nw = a.invert(r.west + shift, r.north), se = a.invert(r.east + shift, r.south);
    PostWindow w = clipped(info, nw.x, se.x, nw.y, se.y);
    w.lon_shift = -shift;
    if (w.empty()) continue;
    if (info.wraps_longitude) return {w};  // its columns have no end: any turn is as good
    (holds_column(nw.x, se.x) ? found : beside).push_back(w);
  }
  for (auto* windows : {&found, &beside})
    std::ranges::stable_sort(*windows, std::greater{}, &PostWindow::cols);
  if (!found.empty() || beside.empty()) return found;
  return {beside.front()};
}

/// The rectangle's outline and inside, seen in posts. Where PROJ cannot say (far from the
/// projection's area), the whole source is the window.
PostWindow projected_window(const DemSource& source, const GeoRect& r) {
  const DemInfo& info = source.info();
  constexpr int kSide = 17;
  // Of the antimeridian, both sides are wanted, not the one that stands for it.
  static const double kEast = std::nextafter(180, 0), kWest = std::nextafter(-180, 0);
  const auto inside = [](double lon) { return lon == 180 ? kEast : lon == -180 ? kWest : lon; };
  std::vector<Geographic> points, far_side;
  for (int j = 0; j < kSide; ++j) {
    const double lat = r.south + r.height() * j / (kSide - 1);
    for (int i = 0; i < kSide; ++i)
      points.push_back({inside(r.west + r.width() * i / (kSide - 1)), lat});
    if (r.west <= -180) far_side.push_back({kEast, lat});
    if (r.east >= 180) far_side.push_back({kWest, lat});
  }
  std::vector<Vec2> posts(points.size());
  source.to_post(points, posts);
  std::vector<Vec2> beyond(far_side.size());
  source.to_post(far_side, beyond);
  for (const Vec2& p : beyond)  // posts that lie on it
    if (p.x >= -kHair && p.y >= -kHair && p.x <= double(info.cols - 1) + kHair &&
        p.y <= double(info.rows - 1) + kHair)
      posts.push_back(p);
  Vec2 low{HUGE_VAL, HUGE_VAL}, high{-HUGE_VAL, -HUGE_VAL};
  bool known = r.height() < 6;  // larger tiles: projections bend too much between the points
  for (const Vec2& p : posts) {
    known = known && std::isfinite(p.x) && std::isfinite(p.y);
    low = {std::min(low.x, p.x), std::min(low.y, p.y)};
    high = {std::max(high.x, p.x), std::max(high.y, p.y)};
  }
  if (!known) return clipped(info, 0, double(info.cols - 1), 0, double(info.rows - 1));
  const double bend = 0.01 * std::max(high.x - low.x, high.y - low.y);
  return clipped(info, low.x - bend, high.x + bend, low.y - bend, high.y + bend);
}

/// Decimated posts are the multiples of `step`, counted from the source's corner.
struct Lattice {
  std::int64_t col, row;
  int cols, rows;

  Lattice(const PostWindow& w, int step)
      : col((w.col + step - 1) / step * step),
        row((w.row + step - 1) / step * step),
        cols(int((w.col + w.cols - 1 - col) / step + 1)),
        rows(int((w.row + w.rows - 1 - row) / step + 1)) {}
  bool empty() const { return cols <= 0 || rows <= 0; }
};

Result<HeightGrid> read_lattice(const DemSource& source, const Lattice& l, int step) {
  return step == 1 ? source.read(l.col, l.row, l.cols, l.rows)
                   : source.read_decimated(l.col, l.row, l.cols, l.rows, step);
}

}  // namespace

std::vector<PostWindow> post_windows(const DemSource& source, const GeoRect& rect) {
  if (!rect.overlaps(source.info().bounds)) {
    const GeoRect& b = source.info().bounds;
    if (rect.west > b.east || rect.east < b.west || rect.south > b.north || rect.north < b.south)
      return {};
  }
  if (source.is_plain_geographic()) return plain_windows(source.info(), rect);
  const PostWindow w = projected_window(source, rect);
  return w.empty() ? std::vector<PostWindow>{} : std::vector{w};
}

PostWindow post_window(const DemSource& source, const GeoRect& rect) {
  const auto windows = post_windows(source, rect);
  return windows.empty() ? PostWindow{} : windows.front();
}

std::vector<PostWindow> windows_beside(const DemSource& source, const GeoRect& rect,
                                       std::int64_t posts) {
  const DemInfo& info = source.info();
  return post_windows(source,
                      grown(rect, double(posts) * std::max(info.spacing_x_m, info.spacing_y_m)));
}

namespace {

/// Do the layer's posts leave no place in the rectangle to layers below? Says no where that is not
/// easily seen: a tile of many posts, the end of the layer, a void near by.
Result<bool> fills(const DemSource& source, const PostWindow& w, const GeoRect& r) {
  constexpr std::int64_t kMost = 1 << 18;  // posts
  constexpr int kSide = 9;
  if (w.empty() || w.cols * w.rows > kMost) return false;
  const DemInfo& info = source.info();
  std::vector<Geographic> outline;
  for (int i = 0; i < kSide; ++i) {
    const double lon = r.west + r.width() * i / (kSide - 1),
                 lat = r.south + r.height() * i / (kSide - 1);
    for (const Geographic p : {Geographic{lon, r.south}, Geographic{lon, r.north},
                               Geographic{r.west, lat}, Geographic{r.east, lat}})
      outline.push_back(p);
  }
  std::vector<Vec2> posts(outline.size());
  source.to_post(outline, posts);
  for (const Vec2& p : posts) {
    const bool in_cols =
        info.wraps_longitude ? std::isfinite(p.x) : p.x >= 1 && p.x <= double(info.cols - 2);
    if (!in_cols || !(p.y >= 1 && p.y <= double(info.rows - 2))) return false;
  }
  const auto heights = source.read(w.col, w.row, int(w.cols), int(w.rows));
  if (!heights) return std::unexpected(heights.error());
  return std::ranges::none_of(heights->values(), [](float z) { return std::isnan(z); });
}

}  // namespace

Result<std::vector<LayerWindow>> surface_windows(const Surface& surface, const GeoRect& rect) {
  std::vector<LayerWindow> windows;
  std::size_t touching = 0;
  for (std::size_t k = surface.layers().size(); k-- > 0;) {
    if (!surface.reaches(k, rect)) continue;
    const DemSource& source = *surface.layers()[k].source;
    const auto of_layer = post_windows(source, rect);
    // What is turned around at the end: the wider one is the first then.
    for (const PostWindow& posts : of_layer | std::views::reverse) windows.push_back({k, posts});
    if (++touching > 1 || surface.only()) continue;
    const auto whole = fills(source, of_layer.empty() ? PostWindow{} : of_layer.front(), rect);
    if (!whole) return std::unexpected(whole.error());
    if (*whole) break;  // what is below has no say
  }
  for (LayerWindow& w : windows) w.alone = touching == 1;
  std::ranges::reverse(windows);
  return windows;
}

std::vector<LayerWindow> parts_of(const LayerWindow& window) {
  // Of layers no wide strips: most parts then lie off the others, and are read as of one DEM.
  constexpr std::int64_t kSide = 768;
  const PostWindow& all = window.posts;
  std::vector<LayerWindow> parts;
  if (all.empty()) return parts;
  const std::int64_t cols = std::min(all.cols, window.alone ? kPartPosts / 2 : kSide);
  const std::int64_t rows = std::max<std::int64_t>(2, kPartPosts / cols);
  for (std::int64_t r = 0; r < all.rows; r += rows)
    for (std::int64_t c = 0; c < all.cols; c += cols) {
      LayerWindow& part = parts.emplace_back(window);
      part.posts.col += c, part.posts.row += r;
      part.posts.cols = std::min(cols, all.cols - c);
      part.posts.rows = std::min(rows, all.rows - r);
    }
  return parts;
}

void TilePosts::count(double u, double v, double z) {
  if (std::isnan(z) || u < -kHair || v < -kHair || u > kTileExtent + kHair ||
      v > kTileExtent + kHair)
    return;
  ++inside_;
  min_m_ = std::min<double>(min_m_, z);
  max_m_ = std::max<double>(max_m_, z);
}

/// Around the posts of a window, generously; nothing where PROJ does not know.
std::optional<GeoRect> rect_of(const DemSource& source, const PostWindow& w) {
  constexpr int kSide = 9;
  std::vector<Vec2> posts;
  for (int j = 0; j < kSide; ++j)
    for (int i = 0; i < kSide; ++i)
      posts.push_back({double(w.col) + double(w.cols - 1) * i / (kSide - 1),
                       double(w.row) + double(w.rows - 1) * j / (kSide - 1)});
  std::vector<Geographic> places(posts.size());
  source.to_geographic(posts, places);
  GeoRect r{HUGE_VAL, HUGE_VAL, -HUGE_VAL, -HUGE_VAL};
  for (const Geographic& p : places) {
    if (!std::isfinite(p.lon) || !std::isfinite(p.lat)) return {};
    const double lon = p.lon - 360 * std::round((p.lon - places[places.size() / 2].lon) / 360);
    r = {std::min(r.west, lon), std::min(r.south, p.lat), std::max(r.east, lon),
         std::max(r.north, p.lat)};
  }
  // Between the places posts may lie a little farther out.
  const double lon = 0.1 * r.width() + 1e-9, lat = 0.1 * r.height() + 1e-9;
  return GeoRect{r.west - lon, r.south - lat, r.east + lon, r.north + lat};
}

/// Could a layer above have a say in the posts of a window? (One below never has.)
bool hidden_or_bent(const Surface& surface, const LayerWindow& w) {
  if (w.layer + 1 == surface.layers().size()) return false;
  const DemSource& source = *surface.layers()[w.layer].source;
  const double most = source.is_plain_geographic() ? 150 : 6;  // degrees, so that it is known
  const auto rect = rect_of(source, w.posts);
  if (!rect || rect->width() > most || rect->height() > most) return true;
  for (std::size_t k = w.layer + 1; k < surface.layers().size(); ++k)
    if (surface.reaches(k, *rect)) return true;
  return false;
}

/// Where posts beside other layers' lie, at the heights that H has there.
Result<void> TilePosts::gather(const HeightField& field, const LayerWindow& window,
                               const GeoRect& rect, std::vector<Vec3>& points) {
  const auto& [layer, w, step, alone] = window;
  const DemSource& source = *field.surface().layers()[layer].source;
  const Lattice posts(w, step);
  if (posts.empty()) return {};
  const auto heights = read_lattice(source, posts, step);
  if (!heights) return std::unexpected(heights.error());
  const double per_lon = kTileExtent / rect.width(), per_lat = kTileExtent / rect.height();
  const auto all = post_positions(source, posts.col, posts.row, posts.cols, posts.rows, step);
  std::vector<Geographic> places;
  std::vector<double> z;
  const std::size_t first = points.size();
  for (std::size_t k = 0; k < all.size(); ++k) {
    if (std::isnan(heights->values()[k])) continue;
    double lon = all[k].lon;  // of a source whose longitudes run otherwise, and on the antimeridian
    lon -= 360 * std::round((lon - (rect.west + rect.east) / 2) / 360);
    const double u = (lon - rect.west) * per_lon, v = (all[k].lat - rect.south) * per_lat;
    if (!(u >= -kHair && v >= -kHair && u <= kTileExtent + kHair && v <= kTileExtent + kHair))
      continue;
    places.push_back(all[k]);
    z.push_back(heights->values()[k]);
    points.push_back({u, v, 0});
  }
  if (!alone && hidden_or_bent(field.surface(), window)) field.raise(layer, places, z);
  if (const auto error = field.error()) return std::unexpected(*error);
  std::size_t kept = first;
  for (std::size_t k = 0; k < z.size(); ++k)
    if (!std::isnan(z[k])) points[kept++] = {points[first + k].x, points[first + k].y, z[k]};
  points.resize(kept);
  return {};
}

Result<TilePosts> TilePosts::read(const HeightField& field, std::span<const LayerWindow> windows,
                                  const GeoRect& rect, double offset,
                                  std::span<const Vec3> beside) {
  const auto layers = field.surface().layers();
  if (windows.empty() && beside.empty()) return read(*layers[0].source, {}, rect, 1, offset);
  if (windows.size() == 1 && beside.empty())
    if (const LayerWindow& w = windows.front(); w.alone || !hidden_or_bent(field.surface(), w))
      return read(*layers[w.layer].source, w.posts, rect, w.step, offset);
  std::vector<Vec3> points;
  for (const LayerWindow& w : windows)
    if (auto done = gather(field, w, rect, points); !done) return std::unexpected(done.error());
  const std::size_t count = points.size();
  points.insert(points.end(), beside.begin(), beside.end());
  TilePosts posts = of_samples(points, offset);
  posts.inside_ = count;
  return posts;
}

TilePosts TilePosts::of_samples(std::span<const Vec3> points, double offset) {
  TilePosts posts;
  for (const Vec3& p : points) {
    posts.min_m_ = std::min(posts.min_m_, p.z);
    posts.max_m_ = std::max(posts.max_m_, p.z);
  }
  posts.scattered_ = ScatteredSamples(points, kTileExtent);
  posts.scattered_.offset = offset;
  return posts;
}

Result<TilePosts> TilePosts::read(const DemSource& source, const PostWindow& w, const GeoRect& rect,
                                  int step, double offset) {
  TilePosts posts;
  posts.grid_.offset = posts.scattered_.offset = offset;
  posts.plain_ = source.is_plain_geographic() && source.info().post_to_crs.x_col > 0 &&
                 source.info().post_to_crs.y_row < 0;
  if (w.empty()) return posts;
  const Lattice lattice(w, step);
  if (lattice.empty()) return posts;
  const auto& [col, row, cols, rows] = lattice;
  auto heights = read_lattice(source, lattice, step);
  if (!heights) return std::unexpected(heights.error());
  posts.heights_ = std::move(*heights);

  const double per_lon = kTileExtent / rect.width(), per_lat = kTileExtent / rect.height();
  if (posts.plain_) {
    const Affine& a = source.info().post_to_crs;
    GridSamples& g = posts.grid_;
    g.cols = cols, g.rows = rows;
    g.x0 = (a.x0 + double(col) * a.x_col + w.lon_shift - rect.west) * per_lon;
    g.y0 = (a.y0 + double(row) * a.y_row - rect.south) * per_lat;
    g.dx = a.x_col * step * per_lon;
    g.dy = -a.y_row * step * per_lat;
    g.z = posts.heights_.values().data();
    for (int j = 0; j < rows; ++j)
      for (int i = 0; i < cols; ++i)
        posts.count(g.x0 + i * g.dx, g.y0 - j * g.dy, posts.heights_.at(i, j));
    return posts;
  }
  const std::vector<Geographic> places = post_positions(source, col, row, cols, rows, step);
  std::vector<Vec3> points;
  for (std::size_t k = 0; k < places.size(); ++k) {
    double lon = places[k].lon;  // a post on the antimeridian is in the tiles of both sides
    if (rect.east == 180 && lon < rect.west) lon += 360;
    if (rect.west == -180 && lon > rect.east) lon -= 360;
    const double u = (lon - rect.west) * per_lon, v = (places[k].lat - rect.south) * per_lat;
    const float z = posts.heights_.values()[k];
    if (std::isnan(z) ||
        !(u >= -kHair && v >= -kHair && u <= kTileExtent + kHair && v <= kTileExtent + kHair))
      continue;
    posts.count(u, v, z);
    points.push_back({u, v, z});
  }
  posts.scattered_ = ScatteredSamples(points, kTileExtent);
  posts.scattered_.offset = offset;
  posts.heights_ = {};
  return posts;
}

TilePosts TilePosts::adapted(const std::function<double(double, double, double)>& f) const {
  TilePosts posts;
  posts.plain_ = plain_;
  posts.min_m_ = min_m_, posts.max_m_ = max_m_, posts.inside_ = inside_;
  if (plain_) {
    posts.heights_ = heights_;
    posts.grid_ = grid_;
    float* z = posts.heights_.values().data();
    posts.grid_.z = z;
    for (std::size_t i = 0; i < grid_.size(); ++i) {
      if (std::isnan(z[i])) continue;
      const Vec3 p = grid_.sample(i);
      z[i] = float(f(p.x, p.y, p.z) - grid_.offset);
    }
    return posts;
  }
  std::vector<Vec3> points;
  for (std::size_t i = 0; i < scattered_.size(); ++i) {
    Vec3 p = scattered_.sample(i);
    p.z = f(p.x, p.y, p.z) - scattered_.offset;
    points.push_back(p);
  }
  posts.scattered_ = ScatteredSamples(points, kTileExtent);
  posts.scattered_.offset = scattered_.offset;
  return posts;
}

}  // namespace tind
