#pragma once
// What tiles of a web map are made of, whatever that is: for who makes all of them.

#include <atomic>
#include <functional>
#include <memory>
#include <stop_token>
#include <string>

#include "proto/image/image_file.h"
#include "proto/tile/tile_json.h"
#include "terrain/base/result.h"
#include "terrain/geo/web_mercator.h"
#include "terrain/images/image_tile.h"
#include "terrain/store/tile_set.h"

namespace tind {

struct ImageSource {
  proto::ImageFormat format = proto::ImageFormat::png;
  proto::TileJson description;  // without a name, and where they are
  std::string version;          // as long as it is the same, so are the images
  std::function<bool(web_mercator::Tile)> has;
  /// kImagePixels a side; the bytes that a daemon sends. Thread-safe. REQUIRES: has.
  std::function<Result<std::string>(web_mercator::Tile, const std::stop_token&)> file;
  /// Of all files that were made: how far a height lay beyond what its colours can say.
  std::shared_ptr<std::atomic<double>> beyond_m = std::make_shared<std::atomic<double>>(0);
};

/// Of the DEMs themselves. Cost and errors: as image_file().
ImageSource images_of(const Surface&, const ImageKind&);

/// Of the meshes of tiles (mesh_image.h). Decoded tiles are kept, a few hundred at a time, so that
/// images that show the same ones make them once. Errors: theirs.
ImageSource images_of(std::shared_ptr<const TileSet>, proto::HeightCode, proto::ImageFormat);

}  // namespace tind
