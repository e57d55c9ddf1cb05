#pragma once
// The geoid: how far mean sea level lies from the WGS84 ellipsoid. EGM96, 15' grid.

#include <memory>
#include <string>

#include "terrain/base/result.h"
#include "terrain/geo/coordinates.h"

namespace tind {

/// Ellipsoidal height = orthometric height + undulation. Bilinear over the 15' grid, as PROJ does.
/// Against the grid: 1.5 mm (the file counts in steps of 3 mm). Against the full EGM96 model: 0.055
/// m at worst over NGA's six test points; GeographicLib states 0.040 m RMS, 1.152 m at worst.
/// Thread-safe; 2 MB.
class Geoid {
 public:
  /// A grid `name`.pgm in `folder`. An installation's is in its Environment.
  static Result<std::shared_ptr<const Geoid>> load(const std::string& folder,
                                                   const std::string& name);

  virtual ~Geoid() = default;

  /// Metres; any longitude, latitude -90..90. About 50 ns.
  virtual double undulation(Geographic p) const = 0;
};

}  // namespace tind
