#pragma once
// A tile of a web map as a file: the same bytes on demand and in batch.

#include <stop_token>
#include <string>
#include <variant>

#include "proto/image/height_colours.h"
#include "proto/image/image_file.h"
#include "proto/tile/tile_json.h"
#include "terrain/base/result.h"
#include "terrain/geo/web_mercator.h"
#include "terrain/images/shade_image.h"
#include "terrain/surface/surface.h"

namespace tind {

/// What it shows of a surface.
using ImageContent = std::variant<proto::HeightCode, Shade>;

struct ImageKind {
  ImageContent content;
  proto::ImageFormat format = proto::ImageFormat::png;
};

/// The file, kImagePixels a side. Cost and errors: as height_image() and gradient_image().
/// `beyond_m`, of heights: how far the farthest lies beyond what its colours can say.
/// REQUIRES: has_image().
Result<std::string> image_file(const Surface&, const ImageKind&, web_mercator::Tile,
                               std::stop_token = {}, double* beyond_m = nullptr);

/// What describes them; without where they are.
proto::TileJson image_tile_json(const Surface&, const ImageKind&, const std::string& name,
                                const std::string& attribution);

/// Stands for the surface: as long as it is the same, so are the tiles.
std::string image_version(const Surface&);

}  // namespace tind
