#include "server/cli/pictures/explain_picture.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "server/cli/pictures/colours.h"
#include "terrain/geo/ellipsoid.h"
#include "terrain/mesh/scan_triangle.h"

namespace tind::cli {

namespace {

constexpr int kHeight = 1024, kNarrowest = 128;
constexpr double kEnd = 32767;
constexpr Pixel kPale = {232, 232, 228}, kFilled = {246, 216, 110}, kInk = {20, 24, 32};

/// The mesh's heights at the pixels' middles.
HeightGrid rasterised(const CheckedTile& tile, int width, int height) {
  HeightGrid grid(width, height);
  std::ranges::fill(grid.values(), std::nanf(""));
  const auto at = [&](std::uint32_t i) {
    // y up with row 0 at 0, as posts lie in their frame
    return Vec3{tile.u[i] / kEnd * width - 0.5, (tile.v[i] / kEnd - 1) * height + 0.5,
                tile.height(i)};
  };
  for (const auto& [a, b, c] : tile.triangles)
    scan_triangle(at(a), at(b), at(c), 0, height, width, [&](const PostSpan& span) {
      for (int x = span.first; x <= span.last; ++x) grid.at(x, span.row) = float(span.height(x));
      return true;
    });
  return grid;
}

class Canvas {
 public:
  Canvas(const TileExplanation& story, Vec2 pixel_m, int width)
      : story_(story), pixel_m_(pixel_m), picture_(width, kHeight, kPale) {}

  /// `relief` gives the shade; where `truth` is known its difference from the mesh is the colour.
  void ground(const HeightGrid& relief, const HeightGrid& mesh, const HeightGrid* truth) {
    const double scale = story_.posts ? std::max(1e-9, story_.posts->max_error_m) : 1;
    for (int y = 0; y < picture_.height; ++y)
      for (int x = 0; x < picture_.width; ++x) {
        Pixel colour = kPale;
        if (truth) {
          const double error = double(mesh.at(x, y)) - double(truth->at(x, y));
          const double share = error / scale;  // squared: colours in proportion to the error
          colour =
              std::isnan(error) ? kFilled : mix(kPale, difference(share * std::abs(share)), 0.85);
        }
        picture_.at(x, y) = lit(colour, light_on(normal(relief, x, y)));
      }
  }

  void edges() {
    for (const auto& t : story_.mesh.triangles)
      for (int k = 0; k < 3; ++k) {
        const std::uint32_t a = t[std::size_t(k)], b = t[std::size_t((k + 1) % 3)];
        if (a < b || on_border(a, b)) line(place(a), place(b));
      }
  }

  void ring(Geographic p) {
    const double cx = (p.lon - story_.rect.west) / story_.rect.width() * picture_.width;
    const double cy = (story_.rect.north - p.lat) / story_.rect.height() * picture_.height;
    constexpr double kRadius = 11;
    for (int y = int(cy - kRadius) - 3; y <= int(cy + kRadius) + 3; ++y)
      for (int x = int(cx - kRadius) - 3; x <= int(cx + kRadius) + 3; ++x) {
        const double off = std::abs(std::hypot(x + 0.5 - cx, y + 0.5 - cy) - kRadius);
        blend(x, y, {255, 214, 0}, std::clamp(3.2 - off, 0.0, 1.0));
        blend(x, y, kInk, std::clamp(1.6 - off, 0.0, 1.0));
      }
  }

  Picture take() { return std::move(picture_); }

 private:
  Vec2 place(std::uint32_t i) const {
    return {story_.mesh.u[i] / kEnd * picture_.width,
            (1 - story_.mesh.v[i] / kEnd) * picture_.height};
  }

  bool on_border(std::uint32_t a, std::uint32_t b) const {
    const auto both = [](std::int32_t x, std::int32_t y) {
      return x == y && (x == 0 || x == int(kEnd));
    };
    return both(story_.mesh.u[a], story_.mesh.u[b]) || both(story_.mesh.v[a], story_.mesh.v[b]);
  }

  /// From differences over the pixels around, as far as there are heights.
  Vec3 normal(const HeightGrid& g, int x, int y) const {
    const auto slope = [&](int x0, int y0, int x1, int y1, double metres) {
      const double rise = double(g.at(x1, y1)) - double(g.at(x0, y0));
      return std::isnan(rise) || metres <= 0 ? 0 : rise / metres;
    };
    const int w = std::max(0, x - 1), e = std::min(g.cols() - 1, x + 1);
    const int n = std::max(0, y - 1), s = std::min(g.rows() - 1, y + 1);
    return {-slope(w, y, e, y, (e - w) * pixel_m_.x), -slope(x, s, x, n, (s - n) * pixel_m_.y), 1};
  }

  void blend(int x, int y, const Pixel& ink, double share) {
    if (x < 0 || y < 0 || x >= picture_.width || y >= picture_.height) return;
    picture_.at(x, y) = mix(picture_.at(x, y), ink, share);
  }

  /// One pixel wide, its ink shared between the two pixels it runs between.
  void line(Vec2 a, Vec2 b) {
    constexpr double kDark = 0.6;
    const bool steep = std::abs(b.y - a.y) > std::abs(b.x - a.x);
    if (steep) std::swap(a.x, a.y), std::swap(b.x, b.y);
    if (a.x > b.x) std::swap(a, b);
    const double slope = b.x > a.x ? (b.y - a.y) / (b.x - a.x) : 0;
    for (int x = int(a.x); x <= int(b.x); ++x) {
      const double across = a.y + slope * (std::clamp(x + 0.5, a.x, b.x) - a.x) - 0.5;
      const int y = int(std::floor(across));
      const double share = across - y;
      blend(steep ? y : x, steep ? x : y, kInk, kDark * (1 - share));
      blend(steep ? y + 1 : x, steep ? x : y + 1, kInk, kDark * share);
    }
  }

  const TileExplanation& story_;
  Vec2 pixel_m_;
  Picture picture_;
};

}  // namespace

Result<Picture> explain_picture(const TileExplanation& story, const Surface* source) {
  const double lat = (story.rect.south + story.rect.north) / 2;
  const Vec2 degree = wgs84::metres_per_degree(lat);
  const int width = std::max(kNarrowest, int(std::lround(kHeight * degree.x / degree.y)));
  Canvas canvas(story,
                {story.rect.width() * degree.x / width, story.rect.height() * degree.y / kHeight},
                width);
  const HeightGrid mesh = rasterised(story.mesh, width, kHeight);
  if (source) {
    const auto truth = heights_over(*source, story.rect, width, kHeight);
    if (!truth) return std::unexpected(truth.error());
    canvas.ground(*truth, mesh, &*truth);
  } else {
    canvas.ground(mesh, mesh, nullptr);
  }
  canvas.edges();
  if (story.posts && story.posts->posts > 0) canvas.ring(story.posts->worst.place);
  return canvas.take();
}

}  // namespace tind::cli
