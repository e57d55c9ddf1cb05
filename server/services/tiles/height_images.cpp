#include "server/services/tiles/height_images.h"

#include <fmt/format.h>

#include "server/services/tiles/finished_model.h"
#include "terrain/images/height_image.h"
#include "terrain/images/mesh_image.h"

namespace tind::services {
namespace {

TileProducts::Product represent(std::string_view file, proto::ImageFormat format,
                                std::vector<http::Header> fields = {}) {
  return http::Representation::make(file, {.content_type = media_type(format),
                                           .cache_control = "public, max-age=3600",
                                           .vary = "",
                                           .compress = false,
                                           .fields = std::move(fields)});
}

Result<TileProducts::Product> build(const ImageKind& kind, const ServedDataset& dataset,
                                    TileId address, std::stop_token stop) {
  const auto tile = web_mercator::tile(address.level, address.x, address.y);
  const auto file = image_file(*dataset.source, kind, *tile, std::move(stop));
  if (!file) return fail(dataset.name, file.error());
  return represent(*file, kind.format);
}

Result<TileProducts::Product> build_of_mesh(TileService& tiles, const AskedHeights& asked,
                                            const ServedDataset& dataset, TileId address,
                                            const std::stop_token& stop) {
  const auto tile = web_mercator::tile(address.level, address.x, address.y);
  const auto image = mesh_image(level_tiles(tiles, dataset), *tile, kImagePixels, stop);
  if (!image) return fail(dataset.name, image.error());
  const std::string file =
      proto::encode_image(mesh_pixels(*image, asked.code, dataset.tiles->layer()), asked.format);
  const auto largest = drawn_error_m(*image, asked.code);
  if (!largest) return represent(file, asked.format);
  const std::string error = fmt::format("{}", *largest);
  return represent(
      file, asked.format,
      {{"Tind-Max-Error", error}, {"Access-Control-Expose-Headers", "Tind-Max-Error"}});
}

Result<TileProducts::Product> build_shade(const ServedDataset& dataset, TileId tile,
                                          std::uint32_t detail, std::stop_token stop) {
  return build(AskedShade::of(detail).kind(), dataset, tile, std::move(stop));
}

}  // namespace

AskedHeights AskedHeights::of(std::uint32_t number) {
  return {proto::HeightCode(number / 4), proto::ImageFormat(number / 2 % 2), number % 2 == 1};
}

std::uint32_t AskedShade::number() const {
  std::uint32_t n = std::uint32_t(style);
  n = n * 360 + std::uint32_t(azimuth_deg);
  n = n * 91 + std::uint32_t(altitude_deg);
  n = n * 1001 + std::uint32_t(z_tenths);
  return n * 2 + std::uint32_t(format);
}

AskedShade AskedShade::of(std::uint32_t n) {
  const auto take = [&n](std::uint32_t count) {
    const std::uint32_t value = n % count;
    n /= count;
    return int(value);
  };
  AskedShade asked;
  asked.format = proto::ImageFormat(take(2));
  asked.z_tenths = take(1001);
  asked.altitude_deg = take(91);
  asked.azimuth_deg = take(360);
  asked.style = ShadeStyle(n);
  return asked;
}

HeightImages::HeightImages(TileService& tiles, TileCache& cache, CpuPool& pool)
    : heights_(cache, pool, TileKey::kHeightImages,
               [&tiles](const ServedDataset& dataset, TileId tile, std::uint32_t detail,
                        std::stop_token stop) {
                 const auto asked = AskedHeights::of(detail);
                 return asked.of_mesh ? build_of_mesh(tiles, asked, dataset, tile, stop)
                                      : build(asked.kind(), dataset, tile, std::move(stop));
               }),
      shades_(cache, pool, TileKey::kShades, build_shade) {}

}  // namespace tind::services
