#include "server/services/tiles/height_images.h"

#include <fmt/format.h>

#include "terrain/images/height_image.h"

namespace tind::services {
namespace {

/// What a client who looks into the file learns: the numbers that the picture cannot say.
std::vector<proto::PngText> texts(const HeightImage& image, proto::HeightCode code,
                                  const DemInfo& info) {
  return {{"Encoding", std::string(proto::name(code))},
          {"Vertical datum", name(info.datum)},
          {"Step in metres", fmt::format("{}", proto::height_step_m(code))},
          {"Samples of each pixel", fmt::format("{}", image.samples * image.samples)},
          {"Largest deviation of a sample in metres", fmt::format("{:.6g}", image.max_deviation_m)},
          {"Share of pixels without data", fmt::format("{:.6g}", image.filled_share)}};
}

Result<TileProducts::Product> build(proto::HeightCode code, const ServedDataset& dataset,
                                    TileId address, std::stop_token stop) {
  const auto tile = web_mercator::tile(address.level, address.x, address.y);
  const auto image = height_image(*dataset.source, *tile, kImagePixels, std::move(stop));
  if (!image) return fail(dataset.name, image.error());
  const std::string png = proto::encode_height_png(image->pixels, image->heights, code,
                                                   texts(*image, code, dataset.source->info()));
  return http::Representation::make(png, {.content_type = "image/png",
                                          .cache_control = "public, max-age=3600",
                                          .vary = "",
                                          .compress = false});
}

}  // namespace

HeightImages::HeightImages(TileCache& cache, CpuPool& pool) {
  for (const auto code : {proto::HeightCode::mapbox, proto::HeightCode::terrarium})
    all_[std::size_t(code)] = std::make_unique<TileProducts>(
        cache, pool, std::uint8_t(TileKey::kHeightImages + std::uint8_t(code)),
        [code](const ServedDataset& dataset, TileId tile, std::stop_token stop) {
          return build(code, dataset, tile, std::move(stop));
        });
}

}  // namespace tind::services
