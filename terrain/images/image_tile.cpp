#include "terrain/images/image_tile.h"

#include <fmt/format.h>

#include <algorithm>

#include "terrain/base/hash.h"
#include "terrain/geo/extent_box.h"
#include "terrain/images/height_image.h"
#include "terrain/surface/stated_accuracy.h"

namespace tind {
namespace {

/// What a client who looks into the file learns: the numbers that the picture cannot say.
std::vector<proto::PngText> texts(const HeightImage& image, proto::HeightCode code,
                                  const DemInfo& info) {
  return {
      {"Encoding", std::string(proto::name(code))},
      {"Vertical datum", name(info.datum)},
      {"Step in metres", fmt::format("{}", proto::height_step_m(code))},
      {"Samples of each pixel", fmt::format("{}", image.samples * image.samples)},
      {"Largest deviation of a sample in metres",
       fmt::format("{:.6g}", image.max_deviation_m + proto::beyond_range_m(image.heights, code))},
      {"Share of pixels without data", fmt::format("{:.6g}", image.filled_share)}};
}

/// Where the deepest level shows most: of layers the finest has a say there. On the map.
std::vector<GeoRect> finest_extents(const Surface& surface, double most_lat) {
  const auto finest = std::ranges::min_element(surface.layers(), {}, &SurfaceLayer::finest_m);
  const DemInfo& info = finest->source->info();
  std::vector<GeoRect> rects = info.extents.empty() ? std::vector{info.bounds} : info.extents;
  for (GeoRect& r : rects) {
    r.south = std::clamp(r.south, -most_lat, most_lat);
    r.north = std::clamp(r.north, -most_lat, most_lat);
  }
  return rects;
}

struct MakePixels {
  const Surface& surface;
  const web_mercator::Tile tile;
  const std::stop_token stop;
  double* const beyond_m;

  Result<proto::ImagePixels> operator()(proto::HeightCode code) const {
    const auto image = height_image(surface, tile, kImagePixels, stop);
    if (!image) return std::unexpected(image.error());
    if (beyond_m) *beyond_m = proto::beyond_range_m(image->heights, code);
    return proto::ImagePixels{.width = image->pixels,
                              .height = image->pixels,
                              .channels = 3,
                              .samples = proto::height_colours(image->heights, code),
                              .texts = texts(*image, code, surface.info())};
  }
  Result<proto::ImagePixels> operator()(const Shade& shade) const {
    const auto image = gradient_image(surface, tile, kImagePixels, stop);
    if (!image) return std::unexpected(image.error());
    return shade_pixels(*image, shade);
  }
};

}  // namespace

Result<std::string> image_file(const Surface& surface, const ImageKind& kind,
                               web_mercator::Tile tile, std::stop_token stop, double* beyond_m) {
  const auto pixels =
      std::visit(MakePixels{surface, tile, std::move(stop), beyond_m}, kind.content);
  if (!pixels) return std::unexpected(pixels.error());
  return proto::encode_image(*pixels, kind.format);
}

proto::TileJson image_tile_json(const Surface& surface, const ImageKind& kind,
                                const std::string& name, const std::string& attribution) {
  const GeoRect& b = surface.info().bounds;
  const double most = web_mercator::rect({0, 0, 0}).north;
  proto::TileJson json{.name = name,
                       .tiles = {},
                       .maxzoom = deepest_image_level(surface),
                       .bounds = {b.west, std::clamp(b.south, -most, most), b.east,
                                  std::clamp(b.north, -most, most)},
                       .tile_size = kImagePixels,
                       .encoding = {},
                       .format = name_of(kind.format),
                       .attribution = attribution,
                       .words = {},
                       .numbers = {}};
  const Geographic center = place_in(finest_extents(surface, most));
  json.center = {center.lon, center.lat};
  if (const auto* code = std::get_if<proto::HeightCode>(&kind.content)) {
    json.encoding = proto::name(*code);
    json.words = {{"datum", tind::name(surface.info().datum)}};
    json.accuracy = stated_accuracy(surface);
    json.numbers = {{"height_step_m", proto::height_step_m(*code)}};
  } else {
    json.words = {{"style", std::string(tind::name(std::get<Shade>(kind.content).style))}};
  }
  return json;
}

std::string image_version(const Surface& surface) {
  return hash128(surface.info().fingerprint).text().substr(0, 12);
}

}  // namespace tind
