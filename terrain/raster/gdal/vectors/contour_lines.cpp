#include "terrain/raster/contour_lines.h"

#include <gdal_alg.h>
#include <gdal_priv.h>
#include <ogrsf_frmts.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <limits>
#include <memory>
#include <optional>
#include <utility>

#include "terrain/base/lower_extension.h"
#include "terrain/raster/gdal/crs/gdal_crs.h"
#include "terrain/raster/gdal/fixed_date.h"
#include "terrain/raster/gdal/gdal_setup.h"
#include "terrain/raster/gdal/memory_file.h"
#include "terrain/raster/gdal/vectors/geojson_shapes.h"

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

/// What a file of heights holds.
struct LayerKind {
  const char* name;
  OGRwkbGeometryType type;
  std::vector<const char*> fields;
  const char* geojson_decimals;  // null: as RFC 7946 has them, 7
};
const LayerKind& lines_kind() {
  static const LayerKind kKind = {"contours", wkbLineString25D, {"height_m"}, nullptr};
  return kKind;
}
const LayerKind& areas_kind() {
  static const LayerKind kKind = {"bands", wkbPolygon, {"height_m", "error_m"}, "9"};
  return kKind;
}

OGRLayer* make_layer(GDALDataset& file, OGRSpatialReference crs, ContourFormat format,
                     const LayerKind& kind) {
  CPLStringList rfc7946;
  rfc7946.SetNameValue("RFC7946", "YES");
  if (kind.geojson_decimals) rfc7946.SetNameValue("COORDINATE_PRECISION", kind.geojson_decimals);
  OGRLayer* const layer = file.CreateLayer(
      kind.name, crs.IsLocal() && format != ContourFormat::geopackage ? nullptr : &crs, kind.type,
      format == ContourFormat::geojson ? rfc7946.List() : nullptr);
  if (!layer) return nullptr;
  for (const char* const name : kind.fields) {
    OGRFieldDefn field(name, OFTReal);
    if (layer->CreateField(&field) != OGRERR_NONE) return nullptr;
  }
  return layer;
}

/// Takes features in the DEM's CRS, and hands them on to a layer of GeoJSON as that has them: left
/// to GDAL's driver, a height at the antimeridian becomes a latitude, and some lines go around the
/// world.
class GeojsonLayer final : public OGRLayer {
 public:
  GeojsonLayer(OGRLayer& to, const gdal::GeojsonShapes& shapes) : to_(to), shapes_(shapes) {}

  OGRFeatureDefn* GetLayerDefn() override { return to_.GetLayerDefn(); }
  int TestCapability(const char* what) override { return EQUAL(what, OLCSequentialWrite); }
  void ResetReading() override {}
  OGRFeature* GetNextFeature() override { return nullptr; }

 private:
  OGRErr ICreateFeature(OGRFeature* feature) override {
    const OGRGeometry& from = *feature->GetGeometryRef();
    const bool is_area = wkbFlatten(from.getGeometryType()) == wkbPolygon;
    auto made = is_area ? shapes_.area(*from.toPolygon()) : shapes_.line(*from.toLineString());
    if (!made) {
      CPLError(CE_Failure, CPLE_AppDefined, "%s", made.error().what.c_str());
      return OGRERR_FAILURE;
    }
    if ((*made)->IsEmpty()) return OGRERR_NONE;
    feature->SetGeometryDirectly(made->release());
    return to_.CreateFeature(feature);
  }

  OGRLayer& to_;
  const gdal::GeojsonShapes& shapes_;
};

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

Result<void> check_crs(const DemInfo& info, ContourFormat format) {
  if (format == ContourFormat::geojson && info.crs_kind == CrsKind::none)
    return fail(Errc::invalid_argument,
                "GeoJSON is in longitude and latitude, and the DEM has no CRS: say it (--crs), or "
                "write .gpkg or .fgb");
  return {};
}

Result<void> check_count(const ContourOptions& options, double low, double high) {
  if (options.levels.empty() && high - low > kMostLevels * options.interval_m)
    return fail(Errc::invalid_argument, "an interval of " + number(options.interval_m) +
                                            " m makes more than 10000 levels of " + number(low) +
                                            " to " + number(high) + " m: take a larger one");
  // A step that is rounding beside the heights, or beside where it counts from, is none.
  const double largest = std::max({std::abs(low), std::abs(high), std::abs(options.base_m)});
  if (options.levels.empty() && options.interval_m < 1e-12 * largest)
    return fail(Errc::invalid_argument, "an interval of " + number(options.interval_m) +
                                            " m is nothing beside heights and a base of up to " +
                                            number(largest) + " m");
  return {};
}

Result<void> check(const DemInfo& info, const HeightGrid& posts, ContourFormat format,
                   const ContourOptions& options) {
  if (auto ok = check_crs(info, format); !ok) return ok;
  double low = std::numeric_limits<double>::infinity(), high = -low;
  for (const float z : posts.values()) {
    if (std::isnan(z)) continue;
    low = std::min(low, double(z)), high = std::max(high, double(z));
  }
  if (!(low <= high)) return fail(Errc::bad_data, "no post has a height");
  return check_count(options, low, high);
}

/// In the DEM's CRS; one of the first and the last place, as OGR has rings.
std::unique_ptr<OGRPolygon> polygon_of(const ContourArea& area, const DemInfo& info) {
  auto polygon = std::make_unique<OGRPolygon>();
  for (const std::vector<Vec2>& places : area.rings) {
    auto ring = std::make_unique<OGRLinearRing>();
    for (const Vec2& place : places) {
      const Vec2 at = info.post_to_crs.apply(place.x, place.y);
      ring->addPoint(at.x, at.y);
    }
    ring->closeRings();
    polygon->addRingDirectly(ring.release());
  }
  return polygon;
}

bool put_areas(OGRLayer& layer, std::span<const ContourArea> areas, const DemInfo& info,
               double error_m) {
  for (const ContourArea& area : areas) {
    OGRFeature feature(layer.GetLayerDefn());
    feature.SetField(0, area.height_m);
    feature.SetField(1, error_m);
    feature.SetGeometryDirectly(polygon_of(area, info).release());
    if (layer.CreateFeature(&feature) != OGRERR_NONE) return false;
  }
  return true;
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
  const std::string extension = lower_extension(path);
  if (extension == ".json") return ContourFormat::geojson;
  for (const FormatRow& row : kFormats)
    if (extension == row.extension) return row.format;
  return fail(Errc::invalid_argument,
              "cannot tell the format of " + path + ": name it .gpkg, .fgb, .geojson or .json");
}

Result<std::vector<double>> contour_heights(const ContourOptions& options, double low_m,
                                            double high_m) {
  if (auto ok = check_count(options, low_m, high_m); !ok) return std::unexpected(ok.error());
  std::vector<double> heights;
  if (options.levels.empty()) {
    const auto multiple = [&](double k) { return options.base_m + k * options.interval_m; };
    for (double k = std::ceil((low_m - options.base_m) / options.interval_m); multiple(k) <= high_m;
         ++k)
      heights.push_back(multiple(k));
    return heights;
  }
  for (const double height : options.levels)
    if (height >= low_m && height <= high_m) heights.push_back(height);
  std::ranges::sort(heights);
  heights.erase(std::unique(heights.begin(), heights.end()), heights.end());
  return heights;
}

namespace {

/// One layer, which `fill` fills, as a file's bytes.
template <class Fill>
Result<ContourFile> encode_layer(ContourFormat format, const DemInfo& info, const LayerKind& kind,
                                 const Progress& progress, Fill fill) {
  gdal::register_vectors();
  std::optional<gdal::GeojsonShapes> shapes;
  if (format == ContourFormat::geojson) {
    auto made = gdal::GeojsonShapes::make(info);
    if (!made) return std::unexpected(made.error());
    shapes = std::move(*made);
  }
  const auto crs = gdal::crs_of_layer(shapes ? "EPSG:4326" : info.crs_wkt);
  if (!crs) return std::unexpected(crs.error());
  gdal::Complaints complaints;
  const gdal::FixedDate date;
  const gdal::MemoryFile memory(row_of(format).extension);
  GDALDriver* const driver = GetGDALDriverManager()->GetDriverByName(row_of(format).driver);
  Dataset file(driver ? driver->Create(memory.name().c_str(), 0, 0, 0, GDT_Unknown, nullptr)
                      : nullptr);
  OGRLayer* const layer = file ? make_layer(*file, *crs, format, kind) : nullptr;
  ContourFile made;
  bool good = false;
  if (layer) {
    const bool all_at_once = file->StartTransaction() == OGRERR_NONE;
    if (shapes) {
      GeojsonLayer on_globe(*layer, *shapes);
      good = fill(on_globe);
    } else {
      good = fill(*layer);
    }
    if (progress.stopped()) return fail(Errc::cancelled, "stopped");
    if (all_at_once) good = file->CommitTransaction() == OGRERR_NONE && good;
  }
  file.reset();  // writes what is left, an index for one
  if (good && !complaints.failed()) {
    made.bytes = memory.bytes();
    made.lines = lines_in(memory.name());
  }
  if (made.bytes.empty())
    return fail(complaints.code(), std::string("cannot make a ") + row_of(format).driver +
                                       " file: " + complaints.text("no reason") +
                                       (format == ContourFormat::geojson
                                            ? "; .gpkg and .fgb hold them in the DEM's own CRS"
                                            : ""));
  return made;
}

}  // namespace

Result<ContourFile> encode_contours(ContourFormat format, const DemInfo& info,
                                    const HeightGrid& posts, const ContourOptions& options,
                                    const Progress& progress) {
  if (auto ok = check(info, posts, format, options); !ok) return std::unexpected(ok.error());
  gdal::register_vectors();
  HeightGrid heights = posts;
  const Dataset raster = raster_of(info, heights);
  return encode_layer(format, info, lines_kind(), progress, [&](OGRLayer& layer) {
    Progress mine = progress;
    return raster && GDALContourGenerateEx(raster->GetRasterBand(1), &layer,
                                           words_of(options).List(), tell, &mine) == CE_None;
  });
}

Result<ContourFile> encode_contour_areas(ContourFormat format, const DemInfo& info,
                                         std::span<const ContourArea> areas, double error_m) {
  if (auto ok = check_crs(info, format); !ok) return std::unexpected(ok.error());
  return encode_layer(format, info, areas_kind(), {},
                      [&](OGRLayer& layer) { return put_areas(layer, areas, info, error_m); });
}

}  // namespace tind
