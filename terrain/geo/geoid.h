#pragma once
// The geoid: how far mean sea level lies from the WGS84 ellipsoid. EGM96, 15' grid.

#include <memory>
#include <string>

#include "terrain/base/result.h"
#include "terrain/geo/coordinates.h"

namespace tind {

/// Ellipsoidal height = orthometric height + undulation. Bilinear over the 15' grid, as the grid's
/// other users do; against the full EGM96 model up to about 1 m in rough places, 0.1 m on average.
/// The file stores steps of 3 mm. Thread-safe after loading; 2 MB.
class Geoid {
 public:
  /// The process's EGM96, loaded at the first call. Looked for, in this order, in
  /// $TIND_DATA/geoids, <folder of the program>/../share/tind/geoids, and the build tree. The error
  /// names the script that makes the file.
  static Result<std::shared_ptr<const Geoid>> egm96();
  /// A grid `name`.pgm in `folder`.
  static Result<std::shared_ptr<const Geoid>> load(const std::string& folder,
                                                   const std::string& name);

  virtual ~Geoid() = default;

  /// Metres; any longitude, latitude -90..90. About 50 ns.
  virtual double undulation(Geographic p) const = 0;
};

}  // namespace tind
