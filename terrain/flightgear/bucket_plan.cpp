#include "terrain/flightgear/bucket_plan.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <tuple>

#include "terrain/base/hash.h"
#include "terrain/geo/longitude.h"
#include "terrain/shapes/surface_shapes.h"
#include "terrain/surface/post_warp.h"

namespace tind::flightgear {
namespace {

constexpr double kPatchPosts = 512;  // a side, at most
constexpr double kUnitShare = 0.25;  // of the error, for a unit of its grid: ground may be steep
constexpr int kMostParts = 64;       // 217 m of an eighth of a degree

/// The extents of layer k: rectangles within +-180 and +-90.
std::span<const GeoRect> extents(const Surface& surface, std::size_t k) { return surface.area(k); }

}  // namespace

bool has_bucket(const Surface& surface, BucketId id) {
  const GeoRect r = rect(id);
  for (std::size_t k = 0; k < surface.layers().size(); ++k)
    for (const GeoRect& extent : extents(surface, k))
      if (extent.overlaps(r)) return true;
  return false;
}

Result<BucketPlan> BucketPlan::make(const Surface& surface, const BucketOptions& options,
                                    const Environment& environment) {
  if (!(options.max_error_m >= 0))
    return fail(Errc::invalid_argument, "the error of buckets must be 0 or more");
  for (const SurfaceLayer& layer : surface.layers())
    if (layer.source->info().crs_kind == CrsKind::none)
      return fail(Errc::unsupported, layer.source->info().files.front() +
                                         " has no CRS: say which one it has with --crs");
  BucketPlan plan(surface);
  plan.options_ = options;
  double finest = HUGE_VAL, strictest = HUGE_VAL;
  for (const SurfaceLayer& layer : surface.layers()) {
    finest = std::min(finest, layer.finest_m());
    strictest = std::min(strictest, plan.budget_of(layer));
  }
  const auto too_coarse = [&](int parts) {
    const double side_m = 111320.0 / 8 / parts;
    return side_m / finest > kPatchPosts || side_m / kTileExtent > kUnitShare * strictest;
  };
  while (too_coarse(plan.parts_) && plan.parts_ < kMostParts) plan.parts_ *= 2;
  if (surface.info().datum == VerticalDatum::ellipsoid) {
    auto sea = datum_surface(VerticalDatum::egm96, surface.info().bounds, {}, environment);
    if (!sea) return std::unexpected(sea.error());
    plan.sea_ = *sea;
  }
  std::string said = fmt::format("{} {} {} {} {}", kEpoch, surface.info().fingerprint,
                                 options.max_error_m, int(options.effort), plan.parts_);
  for (const SurfaceLayer& layer : surface.layers())
    said += fmt::format(" {} {} {}", layer.source->info().fingerprint, layer.blend_m,
                        layer.max_error_m);
  if (const SurfaceShapes* shapes = surface.shapes())
    said += " " + shapes->digest() + " " + shapes->level_digest();
  if (plan.sea_) said += " " + plan.sea_->way();
  plan.digest_ = hash128(said).text();
  return plan;
}

std::vector<BucketId> BucketPlan::buckets() const {
  std::set<std::tuple<Folder, BucketId>> all;
  for (std::size_t k = 0; k < surface_.layers().size(); ++k)
    for (const GeoRect& e : extents(surface_, k)) {
      const int last = std::min(kRows - 1, int(std::ceil((e.north + 90) * 8)) - 1);
      for (int row = std::max(0, int(std::floor((e.south + 90) * 8))); row <= last; ++row) {
        const int width = width_of_row(row);
        const int east = std::min(2880, int(std::ceil((e.east + 180) * 8)));
        for (int x = int(std::floor((e.west + 180) * 8 / width)) * width; x < east; x += width)
          all.insert({folder_of({row, x}), {row, x}});
      }
    }
  std::vector<BucketId> ids;
  ids.reserve(all.size());
  for (const auto& [folder, id] : all) ids.push_back(id);
  return ids;
}

double BucketPlan::budget_of(const SurfaceLayer& layer) const {
  if (layer.max_error_m > 0) return layer.max_error_m;
  if (options_.max_error_m > 0) return options_.max_error_m;
  return std::sqrt(layer.spacing_m.x * layer.spacing_m.y) / 32;
}

double BucketPlan::budget_m(const GeoRect& r) const {
  double strictest = HUGE_VAL, loosest = 0;
  for (std::size_t k = 0; k < surface_.layers().size(); ++k) {
    const double budget = budget_of(surface_.layers()[k]);
    loosest = std::max(loosest, budget);
    if (surface_.only() || surface_.reaches(k, r)) strictest = std::min(strictest, budget);
  }
  return std::min(strictest, loosest);
}

double BucketPlan::spacing_m(const GeoRect& r) const {
  double finest = HUGE_VAL, coarsest = 0;
  for (std::size_t k = 0; k < surface_.layers().size(); ++k) {
    const double spacing = surface_.layers()[k].finest_m();
    coarsest = std::max(coarsest, spacing);
    if (surface_.only() || surface_.reaches(k, r)) finest = std::min(finest, spacing);
  }
  return std::min(finest, coarsest);
}

void BucketPlan::take_to_sea(std::span<const Geographic> places, std::span<double> heights) const {
  if (!sea_) return;
  std::vector<Geographic> asked;
  for (const Geographic& p : places) asked.push_back(within_first_turn(p));
  std::vector<double> undulations(asked.size());
  sea_->undulations(asked, undulations);
  for (std::size_t i = 0; i < heights.size(); ++i) heights[i] -= undulations[i];
}

}  // namespace tind::flightgear
