#pragma once
// The colours of a georeferenced image at places of the globe, in any resolution.

#include <array>
#include <memory>
#include <optional>
#include <span>
#include <string>

#include "terrain/base/result.h"
#include "terrain/geo/coordinates.h"

namespace tind {

/// Thread-safe.
class ImageColours {
 public:
  using Linear =
      std::array<float, 3>;  // red, green, blue of light, 0..1: not as pictures have them

  /// Reads all of the image (the formats that a DEM may have; one grey, one palette, or three or
  /// more bands; 8 or 16 bits, or float 0..1), of one with a side of more than 8192 pixels the
  /// means of several, and halves it again and again. A mask, an alpha band and declared no-data
  /// are where the image is not. Takes 5.3 bytes a pixel. bad_data: no image, or one that does not
  /// say where it is; io: unreadable.
  static Result<std::shared_ptr<const ImageColours>> open(const std::string& path);
  virtual ~ImageColours() = default;

  /// By a size of pixels on the ground: of the halved images that with the finest pixels that are
  /// no finer, bilinear between them. Nothing beyond the image.
  virtual void at(std::span<const Geographic>, double pixel_m,
                  std::span<std::optional<Linear>>) const = 0;

  /// The same for the same pixels at the same places.
  virtual const std::string& fingerprint() const = 0;
  virtual const GeoRect& bounds() const = 0;
};

}  // namespace tind
