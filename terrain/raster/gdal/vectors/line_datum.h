#pragma once
// What the heights of lines are above, by the word of their file, beside what those of a DEM are
// above.

#include <optional>
#include <string>
#include <vector>

#include "terrain/base/result.h"
#include "terrain/geo/vertical_datum.h"
#include "terrain/raster/dem_source.h"

class OGRSpatialReference;

namespace tind {

/// As the CRS of one layer states it.
struct StatedDatum {
  VerticalDatum datum;     // unknown: PROJ does not know it
  std::string vertical;    // its vertical CRS by name; empty: the ellipsoid of a CRS of three axes
  std::string zero;        // the datum of that by name, the same for metres and for feet
  bool downwards = false;  // it counts depths
  /// EPSG:4979: GDAL says so of GeoJSON that says nothing, and what was made of it says it, too.
  bool perhaps_unsaid = false;
  friend bool operator==(const StatedDatum&, const StatedDatum&) = default;
};

/// Nothing where the CRS says nothing of heights. `json`: the layer is GeoJSON, of which GDAL says
/// EPSG:4979 wherever it has three coordinates, whatever they are above. Errc::io where PROJ's
/// database cannot be read.
Result<std::optional<StatedDatum>> stated_datum(const OGRSpatialReference*, bool json);

/// Whether own heights of `path` may be used beside those of a DEM: they are not converted. Fails
/// (invalid_argument) where both say what they are above, and it is not the same; gives a line for
/// people where one of them does not say it.
Result<std::vector<std::string>> compare_datums(const std::string& path,
                                                const std::vector<StatedDatum>&, const DemInfo&);

}  // namespace tind
