#pragma once
// Whether a DEM has a place on the globe: without one there are no tiles, images or
// engines' heightmaps of it.

#include "terrain/base/result.h"
#include "terrain/raster/dem_source.h"

namespace tind {

/// unsupported, with what to do: it has no coordinate reference system.
inline Result<void> check_on_globe(const DemInfo& info) {
  if (info.crs_kind != CrsKind::none) return {};
  return fail(Errc::unsupported, info.files.front() +
                                     " has no coordinate reference system, so its place on the "
                                     "globe is unknown: it can be simplified, but not tiled "
                                     "(assign one, e.g. gdal_edit.py -a_srs EPSG:4326)");
}

}  // namespace tind
