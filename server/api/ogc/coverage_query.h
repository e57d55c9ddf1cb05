#pragma once
// The parameters of /collections/{id}/coverage: which window, in which system, how many pixels.

#include <array>
#include <expected>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "server/api/ogc/asked_crs.h"
#include "server/api/ogc/post_grid.h"
#include "server/http/message/problem.h"
#include "server/http/message/request_parser.h"
#include "server/http/operation.h"
#include "terrain/base/enum_names.h"

namespace tind::api::ogc {

enum class CoverageFormat { tif, png, asc, covjson };

/// Of one answer. Text takes ten bytes a pixel.
inline constexpr double kMostPixels = 4 << 20, kMostTextPixels = 1 << 20;

struct CoverageQuery {
  CoverageFormat format = CoverageFormat::tif;
  std::string bbox_crs = "CRS84", crs = "CRS84";
  std::optional<std::array<double, 4>> bbox;                    // as written, in bbox_crs
  std::optional<std::pair<double, double>> subset_x, subset_y;  // east and north, in bbox_crs
  int width = 0, height = 0;                                    // 0: not said
  std::string datum;
};

/// What it takes and answers: the rows by which it is read.
http::Operation coverage_operation();

/// Every problem names its parameter. `subset` and `scale-size` (or scaleSize, as GDAL 3.6 has it)
/// name axes: Lon, Long, E or X, and Lat, N or Y.
std::expected<CoverageQuery, std::vector<http::ParameterProblem>> read_coverage_query(
    std::string_view query, const http::Fields&);

/// What is asked for, in the system of the answer; edges of pixels.
struct CoverageWindow {
  CrsBox box;
  int cols = 1, rows = 1;
  Vec2 pixel_m;  // on the ground, in its middle
};

/// Without bbox: all of the dataset. Without a size: as fine as the posts, but at most 2^20 pixels;
/// with one of the two, pixels as long as they are wide. `bbox_grid`, `grid`: the dataset's, in the
/// two systems. The problem names the parameter.
std::expected<CoverageWindow, http::ParameterProblem> coverage_window(
    const CoverageQuery&, const AskedCrs& bbox_crs, const AskedCrs& crs, const DatasetFacts&,
    const PostGrid& bbox_grid, const PostGrid& grid);

/// All of a DEM in its own system, where neither window nor size is asked for: its grid, so that
/// pixels are posts. Nothing where that is another, turned, or of more than 2^20 posts.
/// REQUIRES: `crs` is the DEM's own.
std::optional<CoverageWindow> own_grid(const CoverageQuery&, const AskedCrs& crs, const DemInfo&);

}  // namespace tind::api::ogc

namespace tind {
template <>
struct EnumNames<api::ogc::CoverageFormat> {
  using Format = api::ogc::CoverageFormat;
  static constexpr const char* kWhat = "format";
  static constexpr std::pair<Format, const char*> kAll[] = {{Format::tif, "tif"},
                                                            {Format::png, "png"},
                                                            {Format::asc, "asc"},
                                                            {Format::covjson, "covjson"}};
};
}  // namespace tind
