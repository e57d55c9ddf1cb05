// Places are ordered by the square of posts that they lie in; the posts around those of one square
// are read at once. Of layers, each place is asked of the layer that decides it; only where that is
// bent to others does the surface answer itself.

#include "terrain/analysis/heights_at.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <numeric>

#include "terrain/geo/longitude.h"
#include "terrain/raster/interpolate.h"
#include "terrain/raster/post_place.h"
#include "terrain/shapes/surface_shapes.h"

namespace tind {
namespace {

/// Posts along the sides of a square whose places are read together.
constexpr std::int64_t kSquare = 128;
/// Places that layers are asked for together.
constexpr std::size_t kTogether = 1024;

/// A place among the posts of one DEM.
struct Asked {
  std::size_t place;  // its number
  Vec2 post;
  std::int64_t col() const { return std::int64_t(std::floor(post.x)); }
  std::int64_t row() const { return std::int64_t(std::floor(post.y)); }
  std::pair<std::int64_t, std::int64_t> square() const {
    return {row() / kSquare, col() / kSquare};
  }
};

/// The posts around some places of one square.
struct Window {
  std::int64_t col, row;
  HeightGrid posts;

  double at(std::int64_t c, std::int64_t r) const { return posts.at(int(c - col), int(r - row)); }
};

Result<Window> read_window(const DemSource& source, std::span<const Asked> asked, int beyond) {
  std::int64_t west = asked[0].col(), east = west, north = asked[0].row(), south = north;
  for (const Asked& a : asked) {
    west = std::min(west, a.col()), east = std::max(east, a.col());
    north = std::min(north, a.row()), south = std::max(south, a.row());
  }
  const std::int64_t col = west - beyond, row = north - beyond;
  auto posts =
      source.read(col, row, int(east - west) + 2 + 2 * beyond, int(south - north) + 2 + 2 * beyond);
  if (!posts) return std::unexpected(posts.error());
  return Window{col, row, std::move(*posts)};
}

double bilinear(const Window& w, const Asked& a) {
  const std::int64_t c = a.col(), r = a.row();
  return height_between(w.at(c, r), w.at(c + 1, r), w.at(c, r + 1), w.at(c + 1, r + 1),
                        a.post.x - double(c), a.post.y - double(r));
}

/// The shares of four posts in a row, from the one before the place's own; NaN counts only where
/// its share is not 0.
std::array<double, 4> cubic_shares(double t) {
  const double t2 = t * t, t3 = t2 * t;
  return {-0.5 * t + t2 - 0.5 * t3, 1 - 2.5 * t2 + 1.5 * t3, 0.5 * t + 2 * t2 - 1.5 * t3,
          -0.5 * t2 + 0.5 * t3};
}

double cubic(const Window& w, const Asked& a) {
  const std::int64_t c = a.col(), r = a.row();
  const auto across = cubic_shares(a.post.x - double(c)), down = cubic_shares(a.post.y - double(r));
  double sum = 0;
  for (int j = 0; j < 4; ++j)
    for (int i = 0; i < 4; ++i)
      if (const double share = across[i] * down[j]; share != 0)
        sum += share * w.at(c - 1 + i, r - 1 + j);
  return std::isnan(sum) ? bilinear(w, a) : sum;
}

double nearest(const Window& w, const Asked& a) {
  return w.at(std::int64_t(std::floor(a.post.x + 0.5)), std::int64_t(std::floor(a.post.y + 0.5)));
}

double height_in(const Window& w, const Asked& a, Interpolation how) {
  switch (how) {
    case Interpolation::nearest:
      return nearest(w, a);
    case Interpolation::cubic:
      return cubic(w, a);
    case Interpolation::bilinear:
      break;
  }
  return bilinear(w, a);
}

/// Of one DEM: `take` is told each number of `wanted` and what is there.
template <class Take>
Result<void> ask_dem(const DemSource& source, std::span<const Geographic> places,
                     std::span<const std::size_t> wanted, Interpolation how,
                     const std::stop_token& stop, const Take& take) {
  if (wanted.empty()) return {};
  std::vector<Geographic> where;
  for (const std::size_t i : wanted) where.push_back(places[i]);
  std::vector<Vec2> posts(where.size());
  source.to_post(where, posts);
  std::vector<Asked> asked;
  for (std::size_t n = 0; n < wanted.size(); ++n) {
    if (const auto at = place_among_posts(source.info(), posts[n]))
      asked.push_back({wanted[n], *at});
    else
      take(wanted[n], HeightAt{});
  }
  std::ranges::sort(asked, {}, [](const Asked& a) { return std::pair(a.square(), a.place); });
  for (std::size_t begin = 0; begin < asked.size();) {
    if (stop.stop_requested()) return fail(Errc::cancelled, "stopped");
    std::size_t end = begin + 1;
    while (end < asked.size() && asked[end].square() == asked[begin].square()) ++end;
    const std::span<const Asked> together(&asked[begin], end - begin);
    const auto window = read_window(source, together, how == Interpolation::cubic ? 1 : 0);
    if (!window) return std::unexpected(window.error());
    for (const Asked& a : together) {
      const double z = height_in(*window, a, how);
      take(a.place, std::isnan(z) ? HeightAt{Coverage::void_, 0} : HeightAt{Coverage::value, z});
    }
    begin = end;
  }
  return {};
}

/// From the top down: each place by the first layer that has a height there.
Result<void> ask_layers(const Surface& surface, std::span<const Geographic> places,
                        Interpolation how, const std::stop_token& stop,
                        std::span<SurfaceHeight> out) {
  std::vector<std::size_t> open(places.size());
  std::iota(open.begin(), open.end(), std::size_t(0));
  for (std::size_t k = surface.layers().size(); k-- > 0 && !open.empty();) {
    const auto take = [&](std::size_t i, const HeightAt& found) {
      if (found.coverage == Coverage::value || out[i].height.coverage == Coverage::outside)
        out[i] = {found, found.coverage == Coverage::value ? k : 0};
    };
    const auto done = ask_dem(*surface.layers()[k].source, places, open, how, stop, take);
    if (!done) return done;
    std::erase_if(open, [&](std::size_t i) { return out[i].height.coverage == Coverage::value; });
  }
  return {};
}

/// H itself, where layers have a height: bent at their rims.
Result<void> blend(const Surface& surface, std::span<const Geographic> places,
                   const std::stop_token& stop, std::span<SurfaceHeight> out) {
  const HeightField field(surface);
  std::vector<double> heights(kTogether);
  std::vector<int> layers(kTogether);
  for (std::size_t begin = 0; begin < places.size(); begin += kTogether) {
    if (stop.stop_requested()) return fail(Errc::cancelled, "stopped");
    const std::size_t n = std::min(kTogether, places.size() - begin);
    field.at(places.subspan(begin, n), std::span(heights).first(n), std::span(layers).first(n));
    if (const auto error = field.error()) return std::unexpected(*error);
    for (std::size_t i = 0; i < n; ++i) {
      SurfaceHeight& at = out[begin + i];
      if (layers[i] >= 0)
        at = {{Coverage::value, heights[i]}, std::size_t(layers[i])};
      else if (at.height.coverage == Coverage::value)
        at = {{Coverage::void_, 0}, 0};
    }
  }
  return {};
}

/// Between posts the shore is where the polygon says.
void level(const SurfaceShapes& shapes, std::span<const Geographic> places,
           std::span<SurfaceHeight> out) {
  for (std::size_t i = 0; i < places.size(); ++i) {
    if (out[i].height.coverage == Coverage::outside) continue;
    const Geographic place = within_first_turn(places[i]);
    const auto height = shapes.level_at(place);
    if (height && !shapes.outside(place)) out[i].height = {Coverage::value, *height};
  }
}

}  // namespace

Result<std::vector<SurfaceHeight>> heights_at(const Surface& surface,
                                              std::span<const Geographic> places, Interpolation how,
                                              const std::stop_token& stop) {
  if (const DemSource* dem = surface.only(); dem && dem->info().crs_kind == CrsKind::none)
    return fail(Errc::invalid_argument, dem->info().files[0] +
                                            ": has no CRS, so it has no heights "
                                            "at longitudes and latitudes");
  std::vector<SurfaceHeight> out(places.size());
  const bool blended = !surface.only() && how == Interpolation::bilinear;
  if (auto done = ask_layers(surface, places, how, stop, out); !done)
    return std::unexpected(done.error());
  if (blended)
    if (auto done = blend(surface, places, stop, out); !done) return std::unexpected(done.error());
  if (const SurfaceShapes* shapes = surface.shapes()) level(*shapes, places, out);
  return out;
}

Result<double> highest_ground(const Surface* surface, std::span<const Geographic> places,
                              const std::stop_token& stop) {
  if (!surface) return 0;
  const auto heights = heights_at(*surface, places, Interpolation::bilinear, stop);
  if (!heights) return std::unexpected(heights.error());
  double highest = -HUGE_VAL;
  for (const SurfaceHeight& at : *heights)
    if (at.height.coverage == Coverage::value) highest = std::max(highest, at.height.height_m);
  return highest == -HUGE_VAL ? 0 : highest;
}

}  // namespace tind
