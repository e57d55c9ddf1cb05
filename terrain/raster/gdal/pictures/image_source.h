#pragma once
// Colour from any image, draped over the posts of a DEM.

#include <array>
#include <string>
#include <vector>

#include "terrain/base/result.h"
#include "terrain/raster/dem_source.h"

namespace tind {

using Colour = std::array<float, 3>;  // r g b, 0..1

struct Drape {
  std::vector<Colour> colours;  // one a post, row * cols + col
  double covered = 1;           // share of the posts that have a colour of the image
  bool by_coordinates = false;  // through both CRS; else the image is stretched over the DEM
};

/// Reads `path` (the formats that a DEM may have; one grey, one palette or three or more colour
/// bands; 8 or 16 bits or float 0..1) and gives each post of `dem` its colour, bilinear between
/// pixels. Where both have a CRS, posts are reprojected; otherwise the image's extent is taken to
/// be the DEM's. Posts are white where the image is not: beyond it, and where its mask, alpha band
/// or declared no-data says so. An image much finer than the DEM is averaged down first, so that
/// colours do not alias. Fails (bad_data) when not one post has a colour of it.
Result<Drape> drape_image(const std::string& path, const DemSource& dem);

}  // namespace tind
