#include "terrain/surface/surface.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <tuple>

#include "terrain/base/hash.h"
#include "terrain/surface/void_fill.h"

namespace tind {

namespace {

constexpr double kDegree_m = 111320;

std::span<const GeoRect> extents_of(const DemInfo& info) {
  return info.extents.empty() ? std::span(&info.bounds, 1) : std::span(info.extents);
}

/// So many metres more on each side.
GeoRect grown(GeoRect r, double metres) {
  const double lat =
      std::min(89.0, std::max(std::abs(r.south), std::abs(r.north)) + metres / kDegree_m);
  const double up = metres / kDegree_m, across = up / std::cos(lat * 0.017453292519943295);
  r.west -= across, r.east += across;
  r.south -= up, r.north += up;
  return r;
}

/// Also across the antimeridian.
bool meet(const GeoRect& a, const GeoRect& b) {
  if (a.south > b.north || b.south > a.north) return false;
  for (const double turn : {0.0, 360.0, -360.0})
    if (a.west + turn <= b.east && b.west <= a.east + turn) return true;
  return false;
}

/// What two rectangles share, also across the antimeridian: in the longitudes of the second.
void add_shared(const GeoRect& a, const GeoRect& b, std::vector<GeoRect>& shared) {
  for (const double turn : {0.0, 360.0, -360.0}) {
    const GeoRect r{std::max(a.west + turn, b.west), std::max(a.south, b.south),
                    std::min(a.east + turn, b.east), std::min(a.north, b.north)};
    if (r.west < r.east && r.south < r.north) shared.push_back(r);
  }
}

/// Rectangles that overlap in a row become one: of thousands of files as many as there are rows of
/// them, and every question after a place looks at all. Nothing is lost, and at most a hair won.
void merge_rows(std::vector<GeoRect>& rects) {
  constexpr double kHair = 1e-7;  // degrees
  const auto same = [](double a, double b) { return std::abs(a - b) <= kHair; };
  // Rounded, so that the order is one: neighbours differ in their last digits.
  const auto row_of = [](const GeoRect& r) {
    return std::tuple(std::round(r.south / kHair / 8), std::round(r.north / kHair / 8), r.west);
  };
  std::ranges::sort(rects, {}, row_of);
  std::vector<GeoRect> rows;
  for (const GeoRect& r : rects) {
    GeoRect* const last = rows.empty() ? nullptr : &rows.back();
    if (!last || !same(last->south, r.south) || !same(last->north, r.north) ||
        r.west > last->east) {
      rows.push_back(r);
      continue;
    }
    last->south = std::min(last->south, r.south), last->north = std::max(last->north, r.north);
    last->east = std::max(last->east, r.east);
  }
  rects = std::move(rows);
}

/// The extents of layer k, and of those below it what the layer bends.
std::vector<GeoRect> area_of(const std::vector<SurfaceLayer>& layers, std::size_t k) {
  const SurfaceLayer& layer = layers[k];
  const auto own = extents_of(layer.source->info());
  std::vector<GeoRect> area(own.begin(), own.end());
  if (!(layer.blend_m > 0)) return area;
  for (const GeoRect& extent : own)
    for (std::size_t below = 0; below < k; ++below)
      for (const GeoRect& other : extents_of(layers[below].source->info()))
        add_shared(grown(extent, layer.blend_m), other, area);
  return area;
}

double rounded(double spacing_m) { return std::exp2(std::round(std::log2(spacing_m) * 4) / 4); }

/// `alone`: no other layer. See SurfaceLayer::spacing_m.
Vec2 spacing_of(const DemInfo& info, bool alone) {
  if (alone && info.files.size() <= 1) return {info.spacing_x_m, info.spacing_y_m};
  return {rounded(info.spacing_x_m), rounded(info.spacing_y_m)};
}

void settle_blend(std::vector<SurfaceLayer>& layers, std::size_t k) {
  SurfaceLayer& layer = layers[k];
  const DemInfo& info = layer.source->info();
  const double most = VoidFill::kReach * layer.finest_m();
  if (layer.blend_m < 0) {
    double coarsest = rank_spacing_m(info);
    for (std::size_t below = 0; below < k; ++below) {
      const DemInfo& other = layers[below].source->info();
      const double near = 2 * std::max(rank_spacing_m(info), rank_spacing_m(other));
      const bool meets = std::ranges::any_of(extents_of(info), [&](const GeoRect& a) {
        return std::ranges::any_of(extents_of(other),
                                   [&](const GeoRect& b) { return meet(grown(a, near), b); });
      });
      if (meets) coarsest = std::max(coarsest, rank_spacing_m(other));
    }
    layer.blend_m = 2 * coarsest;
  }
  if (k == 0) layer.blend_m = 0;
  layer.blend_m = std::min(layer.blend_m, most);
}

Result<void> settle_datum(const std::vector<SurfaceLayer>& layers, DemInfo& all) {
  const SurfaceLayer* known = nullptr;
  std::string unknown;
  for (const SurfaceLayer& layer : layers) {
    const DemInfo& info = layer.source->info();
    if (info.datum == VerticalDatum::unknown) {
      unknown += (unknown.empty() ? "" : ", ") + layer.name;
      continue;
    }
    if (known && known->source->info().datum != info.datum)
      return fail(
          Errc::invalid_argument,
          fmt::format("layer {} has heights above {}, layer {} above {}: they cannot be one "
                      "surface; bring them to one datum (--to-datum ellipsoid)",
                      known->name, name(known->source->info().datum), layer.name,
                      name(info.datum)));
    if (!known) known = &layer;
  }
  all.datum = known && unknown.empty() ? known->source->info().datum : VerticalDatum::unknown;
  // Layers above different datums have one only as they were converted.
  all.source_datum = layers[0].source->info().source_datum;
  for (const SurfaceLayer& layer : layers)
    if (layer.source->info().source_datum != all.source_datum) {
      all.source_datum = all.datum;
      break;
    }
  if (known && !unknown.empty())
    all.warnings.push_back(fmt::format(
        "what the heights are above is not known of layer {}, but of {} it is {}: they are taken "
        "as they are, and a step may show where they meet (say it with --from-datum)",
        unknown, known->name, name(known->source->info().datum)));
  return {};
}

DemInfo united(const std::vector<SurfaceLayer>& layers) {
  DemInfo all;
  all.bounds = {HUGE_VAL, HUGE_VAL, -HUGE_VAL, -HUGE_VAL};
  all.crs_kind = CrsKind::geographic;
  all.crs_name = "layers";
  all.has_geotransform = true;
  all.spacing_x_m = all.spacing_y_m = HUGE_VAL;
  std::string prints;
  for (const SurfaceLayer& layer : layers) {
    const DemInfo& info = layer.source->info();
    if (all.driver.empty()) all.driver = info.driver;
    all.files.insert(all.files.end(), info.files.begin(), info.files.end());
    all.warnings.insert(all.warnings.end(), info.warnings.begin(), info.warnings.end());
    for (const GeoRect& r : extents_of(info)) all.extents.push_back(r);
    const GeoRect& b = info.bounds;
    all.bounds = {std::min(all.bounds.west, b.west), std::min(all.bounds.south, b.south),
                  std::max(all.bounds.east, b.east), std::max(all.bounds.north, b.north)};
    all.rounding_m = std::max(all.rounding_m, info.rounding_m);
    const double spacing = rank_spacing_m(info);
    if (spacing < all.spacing_x_m) all.spacing_x_m = all.spacing_y_m = spacing;
    prints += fmt::format("{} {} {} {}\n", layer.name, info.fingerprint, layer.blend_m,
                          layer.max_error_m);
  }
  all.fingerprint = hash128(prints).text();
  return all;
}

}  // namespace

double rank_spacing_m(const DemInfo& info) {
  return std::exp2(std::round(std::log2(info.spacing_x_m * info.spacing_y_m) * 2) / 4);
}

Surface::Surface(std::shared_ptr<const DemSource> source, int) {
  auto parts = std::make_shared<Parts>();
  const Vec2 spacing = spacing_of(source->info(), true);
  parts->layers.push_back({{}, std::move(source), 0, 0, spacing});
  parts_ = std::move(parts);
}

Result<Surface> Surface::of_layers(std::vector<SurfaceLayer> layers) {
  if (layers.empty()) return fail(Errc::invalid_argument, "a surface of no layers");
  auto parts = std::make_shared<Parts>();
  for (SurfaceLayer& layer : layers)
    layer.spacing_m = spacing_of(layer.source->info(), layers.size() == 1);
  if (layers.size() > 1) {
    for (const SurfaceLayer& layer : layers)
      if (layer.source->info().crs_kind == CrsKind::none)
        return fail(Errc::unsupported,
                    layer.source->info().files.front() +
                        " has no coordinate reference system, so its place among the other layers "
                        "is unknown (assign one, e.g. with gdal_edit.py -a_srs EPSG:4326)");
    for (std::size_t k = 0; k < layers.size(); ++k) settle_blend(layers, k);
    parts->info = united(layers);
    if (auto ok = settle_datum(layers, *parts->info); !ok) return std::unexpected(ok.error());
    for (const SurfaceLayer& layer : layers) {
      const DemInfo& info = layer.source->info();
      // In posts the blend is up to 9 % longer: spacing_m is rounded.
      const double near = 1.1 * layer.blend_m + 2.2 * layer.coarsest_m();
      auto& reaches = parts->reaches.emplace_back();
      for (const GeoRect& r : extents_of(info)) reaches.push_back(grown(r, near));
      merge_rows(reaches);
    }
    for (std::size_t k = 0; k < layers.size(); ++k) parts->areas.push_back(area_of(layers, k));
  } else {
    layers[0].blend_m = 0;
  }
  parts->layers = std::move(layers);
  return Surface(std::shared_ptr<const Parts>(std::move(parts)));
}

Result<void> Surface::unchanged() const {
  for (const SurfaceLayer& layer : layers())
    if (auto same = layer.source->unchanged(); !same) return same;
  return {};
}

std::int64_t Surface::post_count() const {
  std::int64_t posts = 0;
  for (const SurfaceLayer& layer : parts_->layers)
    posts += layer.source->info().cols * layer.source->info().rows;
  return posts;
}

bool Surface::is_plain_geographic() const {
  return std::ranges::all_of(parts_->layers, [](const SurfaceLayer& layer) {
    return layer.source->is_plain_geographic();
  });
}

std::span<const GeoRect> Surface::area(std::size_t k) const {
  return parts_->areas.empty() ? extents_of(info()) : std::span(parts_->areas[k]);
}

bool Surface::reaches(std::size_t k, const GeoRect& rect) const {
  if (parts_->reaches.empty()) return true;
  return std::ranges::any_of(parts_->reaches[k], [&](const GeoRect& r) { return meet(rect, r); });
}

}  // namespace tind
