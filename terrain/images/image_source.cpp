#include "terrain/images/image_source.h"

#include <mutex>
#include <optional>
#include <utility>

#include "terrain/base/lru.h"
#include "terrain/encode/quantized_mesh_tile.h"
#include "terrain/images/height_image.h"
#include "terrain/images/mesh_image.h"

namespace tind {
namespace {

/// Tiles as somebody asked for them lately, each made by the first who asks; others wait for it.
class DecodedTiles {
 public:
  explicit DecodedTiles(std::shared_ptr<const TileSet> tiles) : tiles_(std::move(tiles)) {}

  Result<TileModel> tile(TileId id, const std::stop_token& stop) {
    const std::shared_ptr<Slot> slot = slot_of(id);
    const std::lock_guard lock(slot->mutex);
    if (!slot->model) {
      const auto made = tiles_->tile(id, stop);
      if (!made) return std::unexpected(made.error());  // of which nothing is kept
      auto model = decode_tile(id, made->bytes);
      if (!model) return fail(id.text(), model.error());
      slot->model = std::move(*model);
    }
    return *slot->model;
  }
  const TileSet& tiles() const { return *tiles_; }

 private:
  static constexpr std::size_t kKept = 256;
  struct Slot {
    std::mutex mutex;
    std::optional<TileModel> model;
  };
  const std::shared_ptr<const TileSet> tiles_;
  std::mutex mutex_;  // of the slots, not of what is in them
  Lru<TileId, std::shared_ptr<Slot>> slots_{kKept};

  std::shared_ptr<Slot> slot_of(TileId id) {
    const std::lock_guard lock(mutex_);
    if (const auto* const found = slots_.find(id)) return *found;
    auto slot = std::make_shared<Slot>();
    slots_.insert(id, slot);
    return slot;
  }
};

void raise(std::atomic<double>& most, double value) {
  for (double known = most; value > known && !most.compare_exchange_weak(known, value);) {
  }
}

}  // namespace

ImageSource images_of(const Surface& surface, const ImageKind& kind) {
  const auto beyond = std::make_shared<std::atomic<double>>(0);
  return {.format = kind.format,
          .description = image_tile_json(surface, kind, "", ""),
          .version = image_version(surface),
          .has = [surface](web_mercator::Tile tile) { return has_image(surface, tile); },
          .file =
              [surface, kind, beyond](web_mercator::Tile tile, const std::stop_token& stop) {
                double here = 0;
                auto file = image_file(surface, kind, tile, stop, &here);
                raise(*beyond, here);
                return file;
              },
          .beyond_m = beyond};
}

ImageSource images_of(std::shared_ptr<const TileSet> tiles, proto::HeightCode code,
                      proto::ImageFormat format) {
  const proto::LayerJson& layer = tiles->layer();
  const auto kept = std::make_shared<DecodedTiles>(std::move(tiles));
  const auto beyond = std::make_shared<std::atomic<double>>(0);
  return {.format = format,
          .description = mesh_tile_json(layer, code, format, ""),
          .version = layer.version,
          .has = [kept](web_mercator::Tile t) { return has_mesh_image(kept->tiles().layer(), t); },
          .file = [kept, code, format, beyond](web_mercator::Tile tile,
                                               const std::stop_token& stop) -> Result<std::string> {
            const LevelTiles ask{
                [&](TileId id) { return kept->tiles().available(id); },
                [&](TileId id, const std::stop_token& stopped) { return kept->tile(id, stopped); }};
            const auto image = mesh_image(ask, tile, kImagePixels, stop);
            if (!image) return std::unexpected(image.error());
            raise(*beyond, proto::beyond_range_m(image->heights, code));
            return proto::encode_image(mesh_pixels(*image, code, kept->tiles().layer()), format);
          },
          .beyond_m = beyond};
}

}  // namespace tind
