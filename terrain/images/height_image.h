#pragma once
// Heights as an image: a tile of a web map whose pixels are means of H, for clients of
// terrain-RGB (MapLibre, deck.gl, Mapbox).

#include <stop_token>
#include <vector>

#include "terrain/base/result.h"
#include "terrain/geo/web_mercator.h"
#include "terrain/surface/surface.h"

namespace tind {

/// What clients of 512-pixel tiles expect; the deepest level depends on it.
inline constexpr int kImagePixels = 512;

struct HeightImage {
  int pixels = 0;              // a side
  std::vector<float> heights;  // metres, rows from the north; every pixel has one
  int samples = 1;             // of H a pixel, along each axis
  /// Of all samples of H: the farthest from its pixel, metres. 0 where a pixel has one sample.
  double max_deviation_m = 0;
  double filled_share =
      0;  // of the pixels: none of their samples lies where the source has heights
};

/// The first level whose pixels are no larger than the posts of the finest layer: deeper ones would
/// only repeat it. At least 0, at most web_mercator::kMaxLevel.
int deepest_image_level(const Surface&);

/// Can there be posts in it? Decides which tiles exist, without reading any.
bool has_image(const Surface&, web_mercator::Tile);
/// Whether there are any: the map ends at 85.05 degrees, so of what lies around a pole there are
/// none.
bool has_images(const Surface&);

/// A pixel is the mean of H at n x n places spread evenly over it, those without a height left out:
/// n so that they are as dense as the posts of the finest layer there, at most 8. With n = 1 that
/// is H at the pixel's centre. No place belongs to two pixels, so neighbouring tiles have no seam.
/// Where no place has a height, voids are filled as in tiles of meshes (void_fill.h): a height of 0
/// would be a pit. Beyond the reach of that, outside the source, it is 0.
///
/// Reads all posts of the tile's rectangle, some millions at a time. Errors: those of reading;
/// cancelled.
Result<HeightImage> height_image(const Surface&, web_mercator::Tile, int pixels = kImagePixels,
                                 std::stop_token = {});

}  // namespace tind
