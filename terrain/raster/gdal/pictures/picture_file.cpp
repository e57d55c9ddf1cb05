#include "terrain/raster/picture_file.h"

#include <gdal_priv.h>
#include <ogr_spatialref.h>

#include <algorithm>
#include <climits>
#include <memory>

#include "terrain/raster/gdal/gdal_setup.h"
#include "terrain/raster/gdal/memory_file.h"

namespace tind {
namespace {

constexpr int kStrip = 256;
constexpr int kChannels = 4;

using Dataset = std::unique_ptr<GDALDataset, decltype([](GDALDataset* d) { GDALClose(d); })>;

Dataset make_tiff(const std::string& name, const DemInfo& info) {
  const char* const options[] = {"COMPRESS=DEFLATE", "PREDICTOR=2", "TILED=YES",
                                 "PHOTOMETRIC=RGB",  "ALPHA=YES",   "INTERLEAVE=PIXEL",
                                 "BIGTIFF=IF_SAFER", nullptr};
  auto* const driver = GetGDALDriverManager()->GetDriverByName("GTiff");
  return Dataset(driver->Create(name.c_str(), int(info.cols), int(info.rows), kChannels, GDT_Byte,
                                const_cast<char**>(options)));
}

/// Posts are centres of pixels.
bool place(GDALDataset& file, const DemInfo& info) {
  bool ok = true;
  if (info.has_geotransform) {
    const Affine& a = info.post_to_crs;
    const Vec2 corner = a.apply(-0.5, -0.5);
    double transform[] = {corner.x, a.x_col, a.x_row, corner.y, a.y_col, a.y_row};
    ok = file.SetGeoTransform(transform) == CE_None;
  }
  if (info.crs_wkt.empty()) return ok;
  OGRSpatialReference crs;
  crs.SetAxisMappingStrategy(OAMS_TRADITIONAL_GIS_ORDER);
  return ok && crs.importFromWkt(info.crs_wkt.c_str()) == OGRERR_NONE &&
         file.SetSpatialRef(&crs) == CE_None;
}

Result<void> put_rows(GDALDataset& file, const DemInfo& info, const PictureRows& rows) {
  const int cols = int(info.cols);
  for (int row = 0; row < int(info.rows); row += kStrip) {
    const int n = std::min(kStrip, int(info.rows) - row);
    auto strip = rows(row, n);
    if (!strip) return std::unexpected(strip.error());
    if (file.RasterIO(GF_Write, 0, row, cols, n, strip->data(), cols, n, GDT_Byte, kChannels,
                      nullptr, kChannels, GSpacing(kChannels) * cols, 1, nullptr) != CE_None)
      return fail(Errc::internal, "GDAL refuses a row");
  }
  return {};
}

}  // namespace

Result<std::string> encode_picture_tiff(const DemInfo& info, const PictureRows& rows) {
  if (info.cols > INT_MAX || info.rows > INT_MAX)
    return fail(Errc::out_of_range, "the DEM has too many columns or rows for one raster");
  gdal::set_up();
  gdal::Complaints complaints;
  const gdal::MemoryFile memory(".tif");
  Dataset file = make_tiff(memory.name(), info);
  const bool placed = file && place(*file, info);
  if (placed)
    if (const auto put = put_rows(*file, info, rows); !put) return std::unexpected(put.error());
  file.reset();
  std::string bytes = placed && !complaints.failed() ? memory.bytes() : std::string();
  if (bytes.empty() || complaints.failed())
    return fail(Errc::internal, "cannot make the picture: " + complaints.text("no reason"));
  return bytes;
}

}  // namespace tind
