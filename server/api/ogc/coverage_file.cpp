#include "server/api/ogc/coverage_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "proto/coverage_json.h"
#include "proto/image/png.h"
#include "server/api/crs_name.h"
#include "server/api/ogc/collection_json.h"
#include "terrain/raster/datums.h"
#include "terrain/raster/raster_file.h"

namespace tind::api::ogc {
namespace {

Vec2 pixel_of(const CoverageWindow& w) { return {w.box.width() / w.cols, w.box.height() / w.rows}; }

/// As a DEM whose posts are the middles of the pixels.
DemInfo info_of(const AskedCrs& crs, const CoverageHeights& coverage) {
  const CoverageWindow& w = coverage.window;
  const Vec2 pixel = pixel_of(w);
  DemInfo info;
  info.cols = w.cols, info.rows = w.rows;
  info.has_geotransform = true;
  info.post_to_crs = {w.box.west + pixel.x / 2, pixel.x, 0, w.box.north - pixel.y / 2, 0, -pixel.y};
  info.crs_wkt = crs.wkt();
  info.datum = coverage.datum;
  return info;
}

Result<CoverageFile> raster(RasterFormat format, const AskedCrs& crs,
                            const CoverageHeights& coverage) {
  RasterContents contents;
  contents.what = "height";
  contents.voids = std::ranges::any_of(coverage.heights, [](float h) { return std::isnan(h); });
  const int cols = coverage.window.cols;
  auto made = encode_raster(
      format, info_of(crs, coverage), contents, [&](int row, int rows) -> Result<HeightGrid> {
        HeightGrid strip(cols, rows);
        const auto from = coverage.heights.begin() + std::int64_t(row) * cols;
        std::copy(from, from + std::int64_t(rows) * cols, strip.values().begin());
        return strip;
      });
  if (!made) return std::unexpected(made.error());
  return CoverageFile{std::move(made->bytes), format == RasterFormat::geotiff
                                                  ? "image/tiff; application=geotiff"
                                                  : "text/plain; charset=utf-8"};
}

CoverageFile png(const AskedCrs& crs, const CoverageHeights& coverage) {
  constexpr double kFirst = 1, kLast = 65535;
  double low = HUGE_VAL, high = -HUGE_VAL;
  for (const float h : coverage.heights)
    if (!std::isnan(h)) low = std::min(low, double(h)), high = std::max(high, double(h));
  const double step = high > low ? (high - low) / (kLast - kFirst) : 1;
  std::vector<std::uint16_t> samples;
  samples.reserve(coverage.heights.size());
  for (const float h : coverage.heights)
    samples.push_back(std::isnan(h) ? 0 : std::uint16_t(std::lround((h - low) / step + kFirst)));
  const CrsBox& b = coverage.window.box;
  const std::string said =
      low > high ? "0: no height" : fmt::format("{} + {} x (sample - 1); 0: no height", low, step);
  const std::vector<proto::PngText> texts = {
      {"height_m", said},
      {"datum", name(coverage.datum)},
      {"crs", crs.name()},
      {"bounds",
       fmt::format("{},{},{},{} (west, south, east, north)", b.west, b.south, b.east, b.north)}};
  constexpr int kEffort = 6;
  return {
      proto::encode_grey16_png(coverage.window.cols, coverage.window.rows, samples, texts, kEffort),
      "image/png"};
}

CoverageFile covjson(const AskedCrs& crs, const CoverageHeights& coverage) {
  const CoverageWindow& w = coverage.window;
  const Vec2 half{pixel_of(w).x / 2, pixel_of(w).y / 2};
  // Shortest digits of floats, not of what they are as doubles.
  std::vector<double> values;
  values.reserve(coverage.heights.size());
  for (const float h : coverage.heights) values.push_back(std::round(double(h) * 1000) / 1000);
  proto::CoverageJson c;
  c.x = {w.box.west + half.x, w.box.east - half.x, w.cols};
  c.y = {w.box.north - half.y, w.box.south + half.y, w.rows};
  c.crs = crs_uri(crs.name());
  c.geographic = crs.geographic();
  c.east_first = crs.east_first();
  c.parameter = height_parameter(name(coverage.datum));
  c.values = values;
  return {proto::encode_coverage_json(c), "application/prs.coverage+json"};
}

}  // namespace

Result<CoverageFile> coverage_file(CoverageFormat format, const AskedCrs& crs,
                                   const CoverageHeights& coverage) {
  switch (format) {
    case CoverageFormat::tif:
      return raster(RasterFormat::geotiff, crs, coverage);
    case CoverageFormat::asc:
      return raster(RasterFormat::ascii_grid, crs, coverage);
    case CoverageFormat::png:
      return png(crs, coverage);
    case CoverageFormat::covjson:
      break;
  }
  return covjson(crs, coverage);
}

}  // namespace tind::api::ogc
