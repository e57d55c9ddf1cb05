#pragma once
// What clients of tiles see, as an image of heights: the certified mesh in place of the DEM, for
// clients of terrain-RGB.

#include <optional>
#include <stop_token>
#include <string>
#include <vector>

#include "proto/image/height_colours.h"
#include "proto/image/image_file.h"
#include "proto/tile/layer_json.h"
#include "proto/tile/tile_json.h"
#include "terrain/base/result.h"
#include "terrain/geo/web_mercator.h"
#include "terrain/tile/level_heights.h"

namespace tind {

struct MeshImage {
  int pixels = 0;              // a side
  std::vector<float> heights;  // metres in the datum of the tiles, rows from the north
  std::vector<int> levels;     // of the tiles that it shows, ascending
  /// No post of these tiles is farther from the mesh; nothing where one of them does not state it.
  std::optional<double> max_error_m = 0;
  double outside_share = 0;  // of the pixels: no tile lies there, and the height is 0
};

/// A pixel is the height at its centre of the mesh that a client draws which draws tiles of the
/// image's own level (level_heights()): their nominal error is about a pixel on the equator, and
/// CesiumJS takes them where it looks at as many pixels. Voids are as the mesh fills them.
///
/// Asks for the tiles that lie there, six at most. Errors: theirs; cancelled.
Result<MeshImage> mesh_image(const LevelTiles&, web_mercator::Tile, int pixels,
                             const std::stop_token& = {});

/// Does an image of these tiles lie there? To the level at which theirs end, where a tile of the
/// image's own level lies within the bounds; where tiles end above that, as a coarse layer's do
/// around a fine one, also where the deepest one does. An image exists where one below it does.
/// O(levels^2 * ranges of a level), mostly O(ranges).
bool has_mesh_image(const proto::LayerJson&, web_mercator::Tile);

/// max_error_m of what the colours say: more where they cannot say a height.
std::optional<double> drawn_error_m(const MeshImage&, proto::HeightCode);

/// As a file has it; the texts say the errors.
proto::ImagePixels mesh_pixels(const MeshImage&, proto::HeightCode, const proto::LayerJson&);

/// What describes them; without where they are.
proto::TileJson mesh_tile_json(const proto::LayerJson&, proto::HeightCode, proto::ImageFormat,
                               const std::string& name);

}  // namespace tind
