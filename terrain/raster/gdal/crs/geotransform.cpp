#include "terrain/raster/gdal/crs/geotransform.h"

#include <gdal_priv.h>

#include <cmath>

namespace tind::gdal {

Result<std::optional<Affine>> pixel_to_crs(GDALDataset& set) {
  double g[6] = {0, 1, 0, 0, 0, 1};
  if (set.GetGeoTransform(g) != CE_None) return std::nullopt;
  // Some drivers give this for a file that says nothing. With rows going down, -1, it is a place.
  if (g[0] == 0 && g[1] == 1 && g[2] == 0 && g[3] == 0 && g[4] == 0 && g[5] == 1)
    return std::nullopt;
  const double det = g[1] * g[5] - g[2] * g[4];
  if (!std::isfinite(det) || det == 0 || !std::isfinite(g[0]) || !std::isfinite(g[3]))
    return fail(Errc::bad_data, "its geotransform is singular");
  return Affine{g[0] + 0.5 * (g[1] + g[2]), g[1], g[2], g[3] + 0.5 * (g[4] + g[5]), g[4], g[5]};
}

}  // namespace tind::gdal
