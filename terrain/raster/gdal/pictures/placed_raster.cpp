#include "terrain/raster/gdal/pictures/placed_raster.h"

#include <bit>
#include <cstdint>

#include "terrain/base/existing_file.h"
#include "terrain/raster/gdal/crs/gdal_crs.h"
#include "terrain/raster/gdal/crs/geotransform.h"
#include "terrain/raster/gdal/gdal_setup.h"
#include "terrain/raster/gdal/heights/beside_raster.h"

namespace tind::gdal {

Result<PlacedRaster> open_placed(const std::string& path, const char* what) {
  set_up();
  if (auto there = check_is_file(path); !there) return std::unexpected(there.error());
  if (auto ok = look_beside(path); !ok) return std::unexpected(ok.error());
  const Complaints complaints;
  std::unique_ptr<GDALDataset, PlacedRaster::Close> set(GDALDataset::Open(
      path.c_str(), GDAL_OF_RASTER | GDAL_OF_READONLY, raster_drivers(false, path)));
  if (!set || set->GetRasterCount() == 0)
    return fail(Errc::bad_data, path + ": " + complaints.text(std::string("not ") + what));
  const auto map = pixel_to_crs(*set);
  if (!map) return fail(path, map.error());
  const auto crs = describe(set->GetSpatialRef());
  if (!crs) return fail(path, crs.error());
  double g[6];
  if (!*map || set->GetGeoTransform(g) != CE_None || crs->kind == CrsKind::none)
    return fail(Errc::bad_data,
                path + " does not say where it is: it needs a CRS and a place, as a GeoTIFF has");
  auto frame = Frame::make(*crs, **map, set->GetRasterXSize(), set->GetRasterYSize());
  if (!frame) return fail(path, frame.error());
  std::string place = crs->wkt;
  for (const double v : g) place += " " + std::to_string(std::bit_cast<std::uint64_t>(v));
  return PlacedRaster{std::move(set), std::move(*frame), std::move(place)};
}

}  // namespace tind::gdal
