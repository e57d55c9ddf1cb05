#pragma once
// How steep the surface is and where it faces, as images of a web map: hillshade, slope, aspect.

#include <cstdint>
#include <optional>
#include <stop_token>
#include <string>
#include <string_view>
#include <vector>

#include "proto/image/image_file.h"
#include "terrain/base/result.h"
#include "terrain/geo/web_mercator.h"
#include "terrain/surface/surface.h"

namespace tind {

struct GradientImage {
  int pixels = 0;           // a side
  std::vector<float> east;  // metres that H rises per metre to the east; rows from the north
  std::vector<float> north;
  int samples = 1;  // of H a pixel, along each axis

  /// No place of the pixel has a height; both are NaN.
  bool empty(std::size_t pixel) const;
};

/// A pixel is the mean of the gradients of H at n x n places in it, those of height_image(), which
/// are as dense as the posts there as long as n is at most 8: so it is the area's mean of the
/// gradient at full resolution, and a slope that is flat on the whole is flat. A gradient is the
/// difference between the two places beside; beside a void, to the one that there is. Lengths are
/// those on the ellipsoid. Neighbouring tiles have no seam. Cost and errors: as height_image().
Result<GradientImage> gradient_image(const Surface&, web_mercator::Tile, int pixels,
                                     std::stop_token = {});

enum class ShadeStyle : std::uint8_t { hillshade, slope, aspect };

/// "hillshade", "slope", "aspect"; nothing for other words.
std::optional<ShadeStyle> shade_style_named(std::string_view);
std::string_view name(ShadeStyle);

struct Shade {
  ShadeStyle style = ShadeStyle::hillshade;
  // Of hillshade alone.
  double azimuth_deg = 315;  // where the light comes from, clockwise from north
  double altitude_deg = 45;  // above the horizon
  double z_factor = 1;       // by which heights are multiplied
};

/// Cosine of the angle between the light and the surface's normal as a grey, 1 (in its own shadow)
/// to 255 (faces the light), as gdaldem has it. No other hill's shadow.
std::uint8_t hillshade_grey(double rise_east, double rise_north, const Shade&);

/// Degrees from the horizontal; the direction that the slope faces, degrees clockwise from north,
/// 0 <= aspect < 360. REQUIRES of aspect: not both 0.
double slope_deg(double rise_east, double rise_north);
double aspect_deg(double rise_east, double rise_north);

/// hillshade: grey and alpha. slope: grey and alpha; the grey is 255 / 90 of the degrees. aspect:
/// colour and alpha, a full colour whose hue is the aspect: red faces north, green 120, blue 240.
/// Alpha is 0 where there is nothing, or with aspect no slope; else 255. The texts say what it
/// shows.
proto::ImagePixels shade_pixels(const GradientImage&, const Shade&);

}  // namespace tind
