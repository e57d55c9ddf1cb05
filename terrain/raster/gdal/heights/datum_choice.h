#pragma once
// What the heights of a raster are above, and how they get above what they shall be.

#include <memory>
#include <string>
#include <vector>

#include "terrain/base/result.h"
#include "terrain/raster/datums.h"
#include "terrain/raster/dem_source.h"
#include "terrain/raster/gdal/heights/gdal_file.h"

namespace tind {

struct DatumChoice {
  VerticalDatum source, result;
  std::shared_ptr<const DatumSurface> from, to;  // null: the ellipsoid
  bool shifts = false;                           // else both are null and heights stay
  std::vector<std::string> warnings;
  std::string overruled;  // as DemInfo has it

  /// For people: "egm2008-5.pgm, cubic"; empty where heights stay.
  std::string way() const;
  /// What a fingerprint needs of the grids; empty for EGM96 to the ellipsoid.
  std::string identity() const;
};

/// What was said counts before what the file says. invalid_argument where heights are to be
/// converted, but nobody knows what they are above; not_found where a grid is missing: with
/// `ellipsoid_if_known`, and a datum that only the file states, that is a warning and they stay.
Result<DatumChoice> choose_datum(const gdal::FileFacts&, const GeoRect& bounds, const DemOptions&);

}  // namespace tind
