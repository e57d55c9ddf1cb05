#pragma once
// The classes of a land-cover raster at places of the globe.

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "terrain/base/result.h"
#include "terrain/geo/coordinates.h"

namespace tind {

struct CoverClass {
  std::uint16_t number = 0;                                // of its pixels
  std::string name;                                        // empty: the raster does not say
  std::optional<std::array<std::uint8_t, 3>> colour = {};  // as pictures have it; likewise

  bool operator==(const CoverClass&) const = default;
};

/// Thread-safe.
class LandCover {
 public:
  /// Reads all of the first band: whole numbers from 0 to 65535, at most 255 different ones; in the
  /// formats that a DEM may have. A mask and declared no-data are where there is no class. Names
  /// and colours are those of its categories, of its colour table, or of its attribute table (RAT),
  /// in the file or in FILE.aux.xml beside it.
  /// Of a raster with a side of more than 16384 pixels every n-th is taken. Takes a byte a pixel.
  /// bad_data: no raster, no classes, or no word of where it is; io: unreadable.
  static Result<std::shared_ptr<const LandCover>> open(const std::string& path);
  virtual ~LandCover() = default;

  /// Of the pixel that a place lies in: which of classes(). Nothing beyond the raster.
  virtual void at(std::span<const Geographic>,
                  std::span<std::optional<std::uint16_t>> out) const = 0;

  /// Those that a pixel has, by number.
  virtual const std::vector<CoverClass>& classes() const = 0;
  /// The same for the same pixels and classes at the same places.
  virtual const std::string& fingerprint() const = 0;
  virtual const GeoRect& bounds() const = 0;
};

}  // namespace tind
