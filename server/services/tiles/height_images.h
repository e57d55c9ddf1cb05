#pragma once
// Tiles of web maps (terrain/images), for /rgb and /shade: one kind of product for heights as
// colours, and one for all pictures of how steep it is.

#include <cstdint>

#include "server/services/tiles/tile_products.h"
#include "server/services/tiles/tile_service.h"
#include "terrain/geo/web_mercator.h"
#include "terrain/images/image_tile.h"

namespace tind::services {

struct AskedHeights {
  proto::HeightCode code = proto::HeightCode::mapbox;
  proto::ImageFormat format = proto::ImageFormat::png;
  bool of_mesh = false;  // of the tiles' in place of the source

  ImageKind kind() const { return {code, format}; }
  /// Different of any two.
  std::uint32_t number() const {
    return std::uint32_t(code) * 4 + std::uint32_t(format) * 2 + std::uint32_t(of_mesh);
  }
  static AskedHeights of(std::uint32_t number);
};

/// A shade in numbers that are few enough to be kept by: degrees whole, the factor in tenths.
struct AskedShade {
  ShadeStyle style = ShadeStyle::hillshade;
  int azimuth_deg = 315, altitude_deg = 45, z_tenths = 10;
  proto::ImageFormat format = proto::ImageFormat::png;

  ImageKind kind() const {
    return {Shade{style, double(azimuth_deg), double(altitude_deg), z_tenths / 10.}, format};
  }
  /// Different of any two. REQUIRES: azimuth 0..359, altitude 0..90, z_tenths 0..1000.
  std::uint32_t number() const;
  static AskedShade of(std::uint32_t number);
};

class HeightImages {
 public:
  HeightImages(TileService& tiles, TileCache& cache, CpuPool& pool);

  /// Their details are AskedHeights::number() and AskedShade::number().
  TileProducts& heights() { return heights_; }
  TileProducts& shades() { return shades_; }

  /// Products are kept by addresses of the tiles' own kind; these are told apart by their variant.
  static TileId address(web_mercator::Tile t) { return {t.level, t.x, t.y}; }

 private:
  TileProducts heights_, shades_;
};

}  // namespace tind::services
