#include "terrain/analysis/viewshed.h"

#include <algorithm>
#include <cmath>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "terrain/base/parallel.h"
#include "terrain/geo/geodesic_path.h"
#include "terrain/raster/dem_window.h"

namespace tind {
namespace {

/// The rays of one viewshed. Thread-safe.
class Rays {
 public:
  Rays(const DemSource& dem, const HeightGrid& posts, const ViewshedOptions& options, double eye_m)
      : dem_(dem), posts_(posts), options_(options), eye_m_(eye_m) {}

  Result<void> row(int r, std::span<float> out) const {
    std::vector<Vec2> at;
    at.reserve(std::size_t(posts_.cols()));
    for (int c = 0; c < posts_.cols(); ++c) at.push_back({double(c), double(r)});
    std::vector<Geographic> places(at.size());
    dem_.to_geographic(at, places);
    for (int c = 0; c < posts_.cols(); ++c) {
      if (posts_.is_void(c, r) || !in_reach(places[std::size_t(c)])) continue;
      const auto seen = visibility(places[std::size_t(c)], posts_.at(c, r));
      if (!seen) return std::unexpected(seen.error());
      out[std::size_t(c)] = float(int(*seen));
    }
    return {};
  }

 private:
  bool in_reach(Geographic p) const {
    if (!std::isfinite(options_.radius_m)) return true;
    const Geographic way[] = {options_.observer.place, p};
    return GeodesicPath(way).length_m() <= options_.radius_m;
  }
  Result<Visibility> visibility(Geographic place, double ground_m) const {
    const SightRay ray(options_.observer.place, eye_m_, place,
                       ground_m + options_.target_above_ground_m, options_.rules.refraction);
    const double nothing = std::numeric_limits<double>::quiet_NaN();
    // Around the globe the first column follows the last.
    const std::int64_t around =
        dem_.info().wraps_longitude ? std::llround(dem_.info().period_cols) : 0;
    const auto post = [&](std::int64_t c, std::int64_t r) {
      if (around > 0) c = (c % around + around) % around;
      return c >= 0 && r >= 0 && c < posts_.cols() && r < posts_.rows()
                 ? double(posts_.at(int(c), int(r)))
                 : nothing;
    };
    const auto clearance = clearance_along(dem_, ray, options_.rules, post, true);
    if (!clearance) return std::unexpected(clearance.error());
    return visibility_of(*clearance, options_.rules.all_m());
  }

  const DemSource& dem_;
  const HeightGrid& posts_;
  const ViewshedOptions& options_;
  const double eye_m_;
};

Viewshed counted(HeightGrid visibility) {
  Viewshed out{std::move(visibility), 0, 0, 0};
  for (const float v : out.visibility.values()) {
    out.hidden += v == float(int(Visibility::hidden));
    out.visible += v == float(int(Visibility::visible));
    out.depends += v == float(int(Visibility::depends));
  }
  return out;
}

}  // namespace

Result<std::shared_ptr<const DemSource>> dem_around(std::shared_ptr<const DemSource> dem,
                                                    const ViewshedOptions& options) {
  // Around what is farther than that, outlines fold over the poles.
  if (!(options.radius_m <= kLongestSight_m)) return dem;
  const Geographic p = options.observer.place;
  const Vec2 degree = wgs84::metres_per_degree(std::clamp(p.lat, -89.0, 89.0));
  // A part more: a circle's east and west are not on its middle's latitude.
  const double high = 1.01 * options.radius_m / degree.y;
  const Vec2 narrow = wgs84::metres_per_degree(std::min(std::abs(p.lat) + high, 89.9));
  const double wide = std::min(1.01 * options.radius_m / narrow.x, 180.0);
  const auto rect = posts_around(*dem, outline_of({p.lon - wide, std::max(p.lat - high, -90.0),
                                                   p.lon + wide, std::min(p.lat + high, 90.0)}));
  if (!rect) return std::unexpected(rect.error());
  return dem_window(std::move(dem), *rect);
}

Result<Viewshed> viewshed(const DemSource& dem, const HeightGrid& posts,
                          const ViewshedOptions& options, const Progress& progress) {
  // The observer stands on ground, and sees himself.
  const auto here = line_of_sight(dem, options.observer, options.observer, options.rules);
  if (!here) return std::unexpected(here.error());
  const Rays rays(dem, posts, options, here->eye_m);
  HeightGrid out(posts.cols(), posts.rows());
  int done = 0;
  std::mutex mutex;
  std::optional<Error> error;
  parallel_for(std::size_t(posts.rows()), options.threads, [&](std::size_t r) {
    if (progress.stopped()) return;
    const auto made = rays.row(int(r), out.row(int(r)));
    const std::lock_guard lock(mutex);
    if (!made && !error) error = made.error();
    if (++done % std::max(1, posts.rows() / 200) == 0) progress.at(double(done) / posts.rows());
  });
  if (progress.stopped()) return fail(Errc::cancelled, "stopped");
  if (error) return std::unexpected(*error);
  return counted(std::move(out));
}

RasterContents viewshed_contents() {
  return {.heights = false,
          .what = "0 hidden, 1 visible, 2 depends on the uncertainty",
          .unit = "",
          .pixel = RasterPixel::classes};
}

}  // namespace tind
