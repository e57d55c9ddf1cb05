#include "terrain/raster/contour_lines.h"

#include <gdal_alg.h>
#include <gdal_priv.h>
#include <ogrsf_frmts.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <filesystem>
#include <limits>
#include <memory>
#include <utility>

#include "terrain/raster/gdal/fixed_date.h"
#include "terrain/raster/gdal/gdal_setup.h"
#include "terrain/raster/gdal/memory_file.h"

namespace tind {
namespace {

constexpr double kNothing = -1e30;  // no height
constexpr double kMostLevels = 10'000;

using Dataset = std::unique_ptr<GDALDataset, decltype([](GDALDataset* d) { GDALClose(d); })>;

struct FormatRow {
  ContourFormat format;
  const char *driver, *extension;
};
constexpr FormatRow kFormats[] = {{ContourFormat::geopackage, "GPKG", ".gpkg"},
                                  {ContourFormat::flatgeobuf, "FlatGeobuf", ".fgb"},
                                  {ContourFormat::geojson, "GeoJSON", ".geojson"}};

const FormatRow& row_of(ContourFormat format) {
  return *std::ranges::find(kFormats, format, &FormatRow::format);
}

/// The posts as a raster of GDAL's, whose pixels' centres they are.
Dataset raster_of(const DemInfo& info, HeightGrid& posts) {
  Dataset raster(GetGDALDriverManager()->GetDriverByName("MEM")->Create(
      "", posts.cols(), posts.rows(), 1, GDT_Float32, nullptr));
  if (!raster) return nullptr;
  const Affine& a = info.post_to_crs;
  const Vec2 corner = a.apply(-0.5, -0.5);
  double transform[] = {corner.x, a.x_col, a.x_row, corner.y, a.y_col, a.y_row};
  raster->SetGeoTransform(transform);
  GDALRasterBand& band = *raster->GetRasterBand(1);
  band.SetNoDataValue(kNothing);
  for (float& z : posts.values())
    if (std::isnan(z)) z = float(kNothing);
  const bool put = band.RasterIO(GF_Write, 0, 0, posts.cols(), posts.rows(), posts.values().data(),
                                 posts.cols(), posts.rows(), GDT_Float32, 0, 0, nullptr) == CE_None;
  return put ? std::move(raster) : nullptr;
}

/// Lines of fields and their height, to whichever format.
OGRLayer* make_layer(GDALDataset& file, const DemInfo& info, ContourFormat format) {
  OGRSpatialReference crs;
  crs.SetAxisMappingStrategy(OAMS_TRADITIONAL_GIS_ORDER);
  if (!info.crs_wkt.empty() && crs.importFromWkt(info.crs_wkt.c_str()) != OGRERR_NONE)
    return nullptr;
  const char* const rfc7946[] = {"RFC7946=YES", nullptr};
  OGRLayer* const layer =
      file.CreateLayer("contours", info.crs_wkt.empty() ? nullptr : &crs, wkbLineString25D,
                       format == ContourFormat::geojson ? const_cast<char**>(rfc7946) : nullptr);
  if (!layer) return nullptr;
  OGRFieldDefn height("height_m", OFTReal);
  return layer->CreateField(&height) == OGRERR_NONE ? layer : nullptr;
}

int CPL_STDCALL tell(double share, const char*, void* to) {
  const Progress& progress = *static_cast<const Progress*>(to);
  progress.at(share);
  return progress.stopped() ? FALSE : TRUE;
}

std::string number(double v) { return CPLSPrintf("%.17g", v); }

/// What GDALContourGenerateEx() is told.
CPLStringList words_of(const ContourOptions& options) {
  CPLStringList words;
  if (options.levels.empty()) {
    words.SetNameValue("LEVEL_INTERVAL", number(options.interval_m).c_str());
    words.SetNameValue("LEVEL_BASE", number(options.base_m).c_str());
  } else {
    std::vector<double> levels = options.levels;
    std::ranges::sort(levels);
    std::string list;
    for (const double level : levels) list += (list.empty() ? "" : ",") + number(level);
    words.SetNameValue("FIXED_LEVELS", list.c_str());
  }
  words.SetNameValue("NODATA", number(kNothing).c_str());
  words.SetNameValue("ELEV_FIELD", "0");
  return words;
}

Result<void> check(const DemInfo& info, const HeightGrid& posts, ContourFormat format,
                   const ContourOptions& options) {
  if (format == ContourFormat::geojson && info.crs_kind == CrsKind::none)
    return fail(Errc::invalid_argument,
                "GeoJSON is in longitude and latitude, and the DEM has no CRS: say it (--crs), or "
                "write .gpkg or .fgb");
  if (!options.levels.empty()) return {};
  double low = std::numeric_limits<double>::infinity(), high = -low;
  for (const float z : posts.values()) {
    if (std::isnan(z)) continue;
    low = std::min(low, double(z)), high = std::max(high, double(z));
  }
  if (high - low > kMostLevels * options.interval_m)
    return fail(Errc::invalid_argument, "an interval of " + number(options.interval_m) +
                                            " m makes more than 10000 levels of " + number(low) +
                                            " to " + number(high) + " m: take a larger one");
  return {};
}

/// What has been written: of some formats nobody knows before.
std::size_t lines_in(const std::string& path) {
  const Dataset file(
      GDALDataset::Open(path.c_str(), GDAL_OF_VECTOR | GDAL_OF_READONLY, gdal::vector_drivers()));
  OGRLayer* const layer = file && file->GetLayerCount() > 0 ? file->GetLayer(0) : nullptr;
  return layer ? std::size_t(std::max<GIntBig>(0, layer->GetFeatureCount())) : 0;
}

}  // namespace

Result<ContourFormat> contour_format(const std::string& path) {
  std::string extension = std::filesystem::path(path).extension().string();
  std::ranges::transform(extension, extension.begin(),
                         [](unsigned char c) { return char(std::tolower(c)); });
  if (extension == ".json") return ContourFormat::geojson;
  for (const FormatRow& row : kFormats)
    if (extension == row.extension) return row.format;
  return fail(Errc::invalid_argument,
              "cannot tell the format of " + path + ": name it .gpkg, .fgb, .geojson or .json");
}

Result<ContourFile> encode_contours(ContourFormat format, const DemInfo& info,
                                    const HeightGrid& posts, const ContourOptions& options,
                                    const Progress& progress) {
  if (auto ok = check(info, posts, format, options); !ok) return std::unexpected(ok.error());
  gdal::register_vectors();
  gdal::Complaints complaints;
  const gdal::FixedDate date;
  HeightGrid heights = posts;
  const Dataset raster = raster_of(info, heights);
  const gdal::MemoryFile memory(row_of(format).extension);
  GDALDriver* const driver = GetGDALDriverManager()->GetDriverByName(row_of(format).driver);
  Dataset file(driver && raster
                   ? driver->Create(memory.name().c_str(), 0, 0, 0, GDT_Unknown, nullptr)
                   : nullptr);
  OGRLayer* const layer = file ? make_layer(*file, info, format) : nullptr;
  ContourFile made;
  bool good = false;
  if (layer) {
    const bool all_at_once = file->StartTransaction() == OGRERR_NONE;
    Progress mine = progress;
    good = GDALContourGenerateEx(raster->GetRasterBand(1), layer, words_of(options).List(), tell,
                                 &mine) == CE_None;
    if (progress.stopped()) return fail(Errc::cancelled, "stopped");
    if (all_at_once) good = file->CommitTransaction() == OGRERR_NONE && good;
  }
  file.reset();  // writes what is left, an index for one
  if (good && !complaints.failed()) {
    made.bytes = memory.bytes();
    made.lines = lines_in(memory.name());
  }
  if (made.bytes.empty())
    return fail(Errc::internal, std::string("cannot make a ") + row_of(format).driver +
                                    " file: " + complaints.text("no reason"));
  return made;
}

}  // namespace tind
