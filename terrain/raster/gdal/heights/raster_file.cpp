// A GeoTIFF is written strip by strip into memory, compressed; an ASCII grid is GDAL's copy of it.

#include "terrain/raster/raster_file.h"

#include <gdal_priv.h>
#include <ogr_spatialref.h>

#include <algorithm>
#include <climits>
#include <cmath>
#include <memory>
#include <optional>

#include "terrain/base/lower_extension.h"
#include "terrain/raster/datums.h"
#include "terrain/raster/gdal/gdal_setup.h"
#include "terrain/raster/gdal/memory_file.h"

namespace tind {
namespace {

/// What stands for no value.
float nothing(RasterPixel pixel) {
  return pixel == RasterPixel::uint8 ? 0 : pixel == RasterPixel::classes ? 255 : -9999;
}
constexpr int kStrip = 256;

using Dataset = std::unique_ptr<GDALDataset, decltype([](GDALDataset* d) { GDALClose(d); })>;

/// PROJ says of what it could not look up in its tables that it does not know it.
std::unexpected<Error> unknown_crs(const std::string& crs) {
  return fail(Errc::io, "PROJ cannot make the CRS " + crs + ": are its tables (proj.db) readable?");
}

/// The vertical CRS of metres above a datum; nothing where there is none.
Result<std::optional<OGRSpatialReference>> vertical_of(const VerticalDatum& datum) {
  const std::string code = datum == VerticalDatum::egm96     ? "EPSG:5773"
                           : datum == VerticalDatum::egm84   ? "EPSG:5798"
                           : datum == VerticalDatum::egm2008 ? "EPSG:3855"
                           : datum.kind() == VerticalDatum::crs && unit_of(datum) == 1
                               ? datum.text()
                               : "";
  OGRSpatialReference crs;
  if (code.empty()) return std::nullopt;
  if (crs.SetFromUserInput(code.c_str()) != OGRERR_NONE) return unknown_crs(code);
  if (crs.IsVertical() && !crs.IsCompound()) return crs;
  const OGR_SRSNode* const part = crs.GetAttrNode("VERT_CS");  // of "EPSG:4269+5703"
  char* wkt = nullptr;
  OGRSpatialReference alone;
  const bool found =
      part && part->exportToWkt(&wkt) == OGRERR_NONE && alone.importFromWkt(wkt) == OGRERR_NONE;
  CPLFree(wkt);
  return found ? std::optional(alone) : std::nullopt;
}

struct RasterCrs {
  OGRSpatialReference crs;
  bool tells_datum = false;
};

/// With the datum that the heights are above, where there is a CRS for it that GeoTIFF can say: of
/// ellipsoidal heights only those of EPSG's geographic systems, else a file would have none at all.
Result<RasterCrs> crs_of(const DemInfo& info, bool heights) {
  RasterCrs out;
  OGRSpatialReference& crs = out.crs;
  crs.SetAxisMappingStrategy(OAMS_TRADITIONAL_GIS_ORDER);
  if (crs.importFromWkt(info.crs_wkt.c_str()) != OGRERR_NONE) return unknown_crs("of the DEM");
  if (!heights) return out;
  OGRSpatialReference made;
  if (info.datum == VerticalDatum::ellipsoid) {
    made = crs;
    out.tells_datum = crs.IsGeographic() && made.PromoteTo3D(nullptr) == OGRERR_NONE &&
                      made.GetAuthorityCode(nullptr);
  } else {
    const auto read = vertical_of(info.datum);
    if (!read) return std::unexpected(read.error());
    if (const auto& vertical = *read) {
      const std::string name = std::string(crs.GetName()) + " + " + vertical->GetName();
      out.tells_datum = made.SetCompoundCS(name.c_str(), &crs, &*vertical) == OGRERR_NONE;
    }
  }
  if (!out.tells_datum) return out;
  crs = made;
  crs.SetAxisMappingStrategy(OAMS_TRADITIONAL_GIS_ORDER);
  return out;
}

Result<void> describe(GDALDataset& file, const DemInfo& info, const RasterContents& contents) {
  bool ok = !contents.voids ||
            file.GetRasterBand(1)->SetNoDataValue(double(nothing(contents.pixel))) == CE_None;
  if (contents.points)  // before the places, which GeoTIFF writes down in another way then
    ok = ok && file.SetMetadataItem(GDALMD_AREA_OR_POINT, GDALMD_AOP_POINT) == CE_None;
  file.GetRasterBand(1)->SetDescription(contents.what);
  file.GetRasterBand(1)->SetUnitType(contents.unit);
  if (info.has_geotransform) {  // posts are centres of pixels
    const Affine& a = info.post_to_crs;
    const Vec2 corner = a.apply(-0.5, -0.5);
    double transform[] = {corner.x, a.x_col, a.x_row, corner.y, a.y_col, a.y_row};
    ok = ok && file.SetGeoTransform(transform) == CE_None;
  }
  bool told = false;
  if (!info.crs_wkt.empty()) {
    const auto place = crs_of(info, contents.heights);
    if (!place) return std::unexpected(place.error());
    ok = ok && file.SetSpatialRef(&place->crs) == CE_None;
    told = place->tells_datum;
  }
  if (contents.heights && !told && info.datum != VerticalDatum::unknown)
    ok = ok && file.SetMetadataItem("VERTICAL_DATUM", name(info.datum).c_str()) == CE_None;
  return ok ? Result<void>() : fail(Errc::internal, "GDAL refuses what is said of the raster");
}

Result<void> put_rows(GDALDataset& file, const DemInfo& info, RasterPixel pixel,
                      const RasterRows& rows) {
  const int cols = int(info.cols);
  for (int row = 0; row < int(info.rows); row += kStrip) {
    const int n = std::min(kStrip, int(info.rows) - row);
    auto strip = rows(row, n);
    if (!strip) return std::unexpected(strip.error());
    for (float& v : strip->values())
      if (std::isnan(v)) v = nothing(pixel);
    if (file.GetRasterBand(1)->RasterIO(GF_Write, 0, row, cols, n, strip->values().data(), cols, n,
                                        GDT_Float32, 0, 0, nullptr) != CE_None)
      return fail(Errc::internal, "GDAL refuses a row");
  }
  return {};
}

GDALDriver* driver_named(const char* name) { return GetGDALDriverManager()->GetDriverByName(name); }

Dataset make_tiff(const std::string& name, const DemInfo& info, const RasterContents& contents) {
  const bool bytes = contents.pixel != RasterPixel::float32;
  const char* const deflate[] = {"COMPRESS=DEFLATE", bytes ? "PREDICTOR=2" : "PREDICTOR=3",
                                 "TILED=YES", "BIGTIFF=IF_SAFER", nullptr};
  const char* const lzw[] = {"COMPRESS=LZW", "BIGTIFF=IF_SAFER", nullptr};
  const char* const* const options = contents.packing == RasterPacking::lzw ? lzw : deflate;
  return Dataset(driver_named("GTiff")->Create(name.c_str(), int(info.cols), int(info.rows), 1,
                                               bytes ? GDT_Byte : GDT_Float32,
                                               const_cast<char**>(options)));
}

Dataset open_again(const std::string& tiff) {
  return Dataset(
      GDALDataset::Open(tiff.c_str(), GDAL_OF_RASTER, gdal::raster_drivers(false, tiff)));
}

/// GDAL's writer of GeoTIFF leaves out, without a word, the CRS that PROJ cannot write down, and
/// one that GeoTIFF has no keys for.
Result<void> says_where(const std::string& tiff, const DemInfo& info) {
  if (info.crs_wkt.empty()) return {};
  const Dataset file = open_again(tiff);
  const OGRSpatialReference* const crs = file ? file->GetSpatialRef() : nullptr;
  OGRSpatialReference wanted;
  if (wanted.importFromWkt(info.crs_wkt.c_str()) != OGRERR_NONE) return unknown_crs("of the DEM");
  if (crs && bool(crs->IsGeographic()) == bool(wanted.IsGeographic()) &&
      bool(crs->IsProjected()) == bool(wanted.IsProjected()))
    return {};
  if (wanted.IsDerivedGeographic())
    return fail(
        Errc::unsupported,
        "neither GeoTIFF nor an ASCII grid can say the CRS of the DEM, whose pole is turned: "
        "warp the DEM first (gdalwarp -t_srs EPSG:4326)");
  return unknown_crs("of the raster");
}

RasterBytes ascii_of(const std::string& tiff) {
  const Dataset from = open_again(tiff);
  const gdal::MemoryFile memory(".asc");
  const char* const options[] = {"SIGNIFICANT_DIGITS=9", nullptr};  // a float32 in full
  const Dataset copy(from ? driver_named("AAIGrid")->CreateCopy(memory.name().c_str(), from.get(),
                                                                FALSE, const_cast<char**>(options),
                                                                nullptr, nullptr)
                          : nullptr);
  return {memory.bytes(), memory.bytes_beside(".prj")};
}

}  // namespace

Result<RasterFormat> raster_format(const std::string& path) {
  const std::string extension = lower_extension(path);
  if (extension == ".tif" || extension == ".tiff") return RasterFormat::geotiff;
  if (extension == ".asc") return RasterFormat::ascii_grid;
  return fail(Errc::invalid_argument,
              "cannot tell the format of the raster " + path + ": name it .tif, .tiff or .asc");
}

Result<void> can_say(RasterFormat format, const DemInfo& info) {
  if (info.cols > INT_MAX || info.rows > INT_MAX)
    return fail(Errc::out_of_range, "the DEM has too many columns or rows for one raster");
  const Affine& a = info.post_to_crs;
  if (format == RasterFormat::ascii_grid &&
      (a.x_row != 0 || a.y_col != 0 || a.y_row > 0 || a.x_col < 0))
    return fail(Errc::invalid_argument,
                "an ASCII grid has its rows from the north, its columns from the west and no "
                "rotation: write .tif");
  return {};
}

Result<RasterBytes> encode_raster(RasterFormat format, const DemInfo& info,
                                  const RasterContents& contents, const RasterRows& rows) {
  if (const auto ok = can_say(format, info); !ok) return std::unexpected(ok.error());
  gdal::set_up();
  gdal::Complaints complaints;
  const gdal::MemoryFile memory(".tif");
  Dataset file = make_tiff(memory.name(), info, contents);
  const auto failed = [&] {
    return fail(Errc::io, "cannot make the raster: " + complaints.text("no reason"));
  };
  if (!file) return failed();
  if (const auto described = describe(*file, info, contents); !described)
    return complaints.failed() ? failed() : std::unexpected(described.error());
  if (const auto put = put_rows(*file, info, contents.pixel, rows); !put)
    return std::unexpected(put.error());
  file.reset();
  if (complaints.failed()) return failed();
  if (const auto placed = says_where(memory.name(), info); !placed)
    return std::unexpected(placed.error());
  RasterBytes made =
      format == RasterFormat::geotiff ? RasterBytes{memory.bytes(), ""} : ascii_of(memory.name());
  if (made.bytes.empty() || complaints.failed()) return failed();
  return made;
}

}  // namespace tind
