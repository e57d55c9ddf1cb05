// What tiles lose of a draped image's colours, by method: between the image and what a client draws
// of the vertices' colours, as light, at 100 x 100 places of every tile, wherever the DEM is.
//
//   tile_colours_bench [DEM IMAGE]    rmnp-dem.tif rmnp-rgb.tif, then autzen's of the shared data

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <mutex>

#include "terrain/base/parallel.h"
#include "terrain/pyramid/make/make_tile.h"
#include "terrain/raster/image_colours.h"
#include "terrain/simplify/common/samples.h"
#include "terrain/simplify/method_text.h"
#include "terrain/tile/level_colours.h"
#include "tests/support/bench.h"

namespace tind {
namespace {

using test::give_up;

constexpr int kThreads = 2;

struct Sums {
  double squares = 0, places = 0;
  std::uint64_t triangles = 0, tiles = 0, by_bounded = 0;

  void add(const Sums& o) {
    squares += o.squares, places += o.places;
    triangles += o.triangles, tiles += o.tiles, by_bounded += o.by_bounded;
  }
  double rms() const { return std::sqrt(squares / std::max(1.0, places) / 3); }
};

Sums of_tile(const TileModel& tile, const GeoRect& dem, const ImageColours& image) {
  constexpr int kSide = 100;
  constexpr double kStep = double(kTileExtent) / kSide;
  const GeoRect rect = tiling::rect(tile.id);
  const std::vector<float> zero(kSide * kSide, 0);
  const GridSamples samples{kSide, kSide, kStep / 2,  kTileExtent - kStep / 2,
                            kStep, kStep, zero.data()};
  std::vector<Geographic> corners, places;
  for (const Vec3& v : tile.mesh.vertices) corners.push_back(place_of(rect, v));
  for (std::size_t i = 0; i < samples.size(); ++i)
    places.push_back(place_of(rect, samples.sample(i)));
  const auto shown = level_colours(corners, tile.id.level, image);
  const auto wanted = level_colours(places, tile.id.level, image);
  Sums s{.triangles = tile.mesh.triangles.size(), .tiles = 1};
  if (shown.empty() || wanted.empty()) return s;
  std::vector<bool> seen(samples.size());
  for (const Triangle& t : tile.mesh.triangles) {
    const Vec3 &a = tile.mesh.vertices[t[0]], &b = tile.mesh.vertices[t[1]],
               &c = tile.mesh.vertices[t[2]];
    const double area = orient2d(a, b, c);
    samples.scan(a, b, c, [&](double x, double y, double, std::size_t i) {
      if (seen[i] || !dem.contains(places[i])) return true;
      seen[i] = true;
      const Vec3 p{x, y, 0};
      const double u = orient2d(p, b, c) / area, v = orient2d(a, p, c) / area;
      for (std::size_t k = 0; k < 3; ++k) {
        const double d =
            u * shown[t[0]][k] + v * shown[t[1]][k] + (1 - u - v) * shown[t[2]][k] - wanted[i][k];
        s.squares += d * d;
      }
      ++s.places;
      return true;
    });
  }
  return s;
}

Sums of_tiles(const Surface& surface, const ImageColours& image, const TileSetOptions& options) {
  const auto range = scan_heights(surface);
  if (!range) give_up(range.error().what);
  const auto plan = TilePlan::make(surface, *range, options);
  if (!plan) give_up(plan.error().what);
  const TileOrder order = plan->order();
  Sums all;
  std::mutex mutex;
  parallel_for(order.size(), kThreads, [&](std::size_t i) {
    TileCost cost;
    const auto tile = model_tile(surface, *plan, order[i], {}, &cost);
    if (!tile) give_up(tile.error().what);
    Sums one = of_tile(*tile, surface.info().bounds, image);
    one.by_bounded = cost.by_bounded;
    const std::lock_guard lock(mutex);
    all.add(one);
  });
  return all;
}

struct Case {
  const char* method;
  bool coloured;
  double factor;  // of all errors: as many triangles as with colours, spent on heights
};

constexpr Case kCases[] = {{"bounded", false, 1},
                           {"attribute-qem", false, 1},
                           {"attribute-qem", false, 0.9},
                           {"attribute-qem", false, 0.8},
                           {"attribute-qem attribute-weight=0", true, 1},
                           {"attribute-qem attribute-weight=0.5", true, 1},
                           {"attribute-qem", true, 1},
                           {"attribute-qem attribute-weight=2", true, 1}};

void bench(const std::string& dem, const std::string& picture) {
  auto source = DemSource::open(std::vector{dem});
  if (!source) give_up(source.error().what);
  const Surface surface(std::move(*source));
  const auto image = ImageColours::open(picture);
  if (!image) give_up(image.error().what);
  fmt::print("\n{}, {}\n\n", std::filesystem::path(dem).filename().string(),
             std::filesystem::path(picture).filename().string());
  fmt::print(
      "| method | image | errors | tiles | triangles | colour RMS | by bounded | s |\n"
      "|---|---|---|---|---|---|---|---|\n");
  for (const Case& one : kCases) {
    TileSetOptions options;
    options.method = *method_from_text(one.method);
    if (one.coloured) options.colours = *image;
    options.error_factor = one.factor;
    options.max_error_m = one.factor * surface.layers()[0].finest_m() / 32;
    Sums s;
    const double seconds = test::seconds_of([&] { s = of_tiles(surface, **image, options); });
    fmt::print("| {} | {} | x {} | {} | {} | {:.4f} | {} | {:.1f} |\n", one.method,
               one.coloured ? "yes" : "no", one.factor, s.tiles, s.triangles, s.rms(), s.by_bounded,
               seconds);
    std::fflush(stdout);
  }
}

}  // namespace
}  // namespace tind

int main(int argc, char** argv) {
  using tind::test::default_dem;
  if (argc > 2) {
    tind::bench(argv[1], argv[2]);
  } else {
    tind::bench(default_dem("rmnp-dem.tif"), default_dem("rmnp-rgb.tif"));
    tind::bench(default_dem("autzen_minz_3ft_epsg2994.tif"),
                default_dem("autzen_rgb_3ft_epsg2994.tif"));
  }
  return 0;
}
