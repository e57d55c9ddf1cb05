// What is known without reading posts is printed first. Then the heights: of all posts, or, where
// that would take minutes and nobody asked for it, of blocks spread over the DEM.

#include "server/cli/commands/info/info_dem.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "server/api/accuracy_json.h"
#include "server/cli/commands/commands.h"
#include "server/cli/commands/info/info_layers.h"
#include "server/cli/program/dem_strips.h"
#include "server/cli/program/progress_bar.h"
#include "server/log/printable.h"
#include "terrain/base/result.h"
#include "terrain/pyramid/plan/level_plan.h"
#include "terrain/raster/dem_source.h"
#include "terrain/raster/height_grid.h"

namespace tind::cli {
namespace {

/// Of a direction from an axis, to either end of it: -90 to 90, counter-clockwise.
double turn_deg(double across, double along) {
  return std::atan(across / along) * 180 / 3.14159265358979323846;
}

using Json = nlohmann::ordered_json;

/// What is known of the heights.
struct Heights {
  HeightRange range;       // of the posts that were read
  std::int64_t posts = 0;  // read
  bool all = true;         // the DEM has no others

  std::int64_t voids() const { return posts - std::int64_t(range.valid); }
  double void_share() const { return double(voids()) / double(posts); }
};

Result<Heights> sampled(const DemSource& dem) {
  Heights heights{{HUGE_VAL, -HUGE_VAL, 0}, 0, false};
  const auto done = for_sample_blocks(dem, [&](const HeightGrid& block) {
    heights.posts += std::int64_t(block.size());
    heights.range.add(block.values());
  });
  if (!done) return std::unexpected(done.error());
  return heights;
}

Result<Heights> heights_of(const DemSource& dem, const InfoDemOptions& options) {
  const DemInfo& info = dem.info();
  if (!options.stats && info.cols > kStreamPosts / info.rows) return sampled(dem);
  ProgressBar bar("heights", progress_style(options.progress));
  const auto range = read_height_range(dem, bar.progress());
  if (!range) return std::unexpected(range.error());
  return Heights{*range, info.cols * info.rows, true};
}

const char* text(CrsKind kind) {
  switch (kind) {
    case CrsKind::geographic:
      return "geographic";
    case CrsKind::projected:
      return "projected";
    case CrsKind::none:
      break;
  }
  return "none";
}

Json to_json(const DemSource& dem, const Heights& heights) {
  const DemInfo& info = dem.info();
  const Affine& m = info.post_to_crs;
  Json j;
  j["kind"] = "dem";
  j["files"] = info.files;
  j["driver"] = info.driver;
  j["cols"] = info.cols;
  j["rows"] = info.rows;
  j["has_geotransform"] = info.has_geotransform;
  j["post_to_crs"] = {m.x0, m.x_col, m.x_row, m.y0, m.y_col, m.y_row};
  j["crs"] = {{"kind", text(info.crs_kind)},
              {"name", info.crs_name},
              {"unit_m", info.crs_unit_m},
              {"wkt", info.crs_wkt},
              {"accuracy_m", info.crs_accuracy_m ? Json(*info.crs_accuracy_m) : Json()},
              {"to_wgs84", info.crs_way}};
  if (info.crs_kind != CrsKind::none) {
    const GeoRect& b = info.bounds;
    j["bounds"] = {b.west, b.south, b.east, b.north};
  }
  j["wraps_longitude"] = info.wraps_longitude;
  j["period_cols"] = info.period_cols;
  j["plain_geographic"] = info.crs_kind != CrsKind::none && dem.is_plain_geographic();
  j["spacing_m"] = {info.spacing_x_m, info.spacing_y_m};
  j["z_unit_m"] = info.z_unit_m;
  j["source_datum"] = name(info.source_datum);
  j["datum"] = name(info.datum);
  j["vertical_crs"] = info.vertical_crs;
  j["datum_way"] = info.datum_way;
  j["rounding_m"] = info.rounding_m;
  if (info.accuracy) j["accuracy"] = api::accuracy_json(*info.accuracy);
  j["warnings"] = info.warnings;
  j["fingerprint"] = info.fingerprint;
  const auto add = [](Json& to, const Heights& h) {
    to["min_height_m"] = h.range.valid == 0 ? Json() : Json(h.range.min_m);
    to["max_height_m"] = h.range.valid == 0 ? Json() : Json(h.range.max_m);
    to["voids"] = h.voids();
    to["void_share"] = h.void_share();
  };
  j["undeclared_nodata"] = Json::array();
  for (const UndeclaredNodata& one : dem.undeclared_nodata())
    j["undeclared_nodata"].push_back({{"value", one.value}, {"posts", one.posts}});
  j["statistics"] = heights.all ? "all posts" : "sample";
  if (heights.all) {
    add(j, heights);
  } else {
    // Under the names of the exact figures nothing stands that is not exact.
    for (const char* key : {"min_height_m", "max_height_m", "voids", "void_share"}) j[key] = Json();
    j["sample"]["posts"] = heights.posts;
    add(j["sample"], heights);
  }
  return j;
}

/// How well its places are known, where that is not exactly.
std::string crs_remark(const DemInfo& info) {
  if (!info.crs_accuracy_m) return " (on WGS84 not known how exactly)";
  if (*info.crs_accuracy_m == 0) return {};
  return fmt::format(" (on WGS84 to {:.3g} m: {})", *info.crs_accuracy_m, info.crs_way);
}

std::string datum_remark(const DemInfo& info) {
  if (info.datum != info.source_datum)
    return logging::printable(
        fmt::format(" (from {}, by {})", name(info.source_datum), info.datum_way));
  if (info.vertical_crs.empty())
    return info.datum == VerticalDatum::unknown ? " (say what it is with --from-datum)" : "";
  return " (file: '" + logging::printable(info.vertical_crs) + "')";
}

/// All but the heights' range and the voids.
std::string facts(const DemInfo& info, const Json& content) {
  const Affine& m = info.post_to_crs;
  std::string out =
      fmt::format("DEM        {} ({})\n",
                  logging::printable(fmt::format("{}", fmt::join(info.files, ", "))), info.driver);
  out += fmt::format("posts      {} x {}, {:.4g} x {:.4g} m apart\n", info.cols, info.rows,
                     info.spacing_x_m, info.spacing_y_m);
  if (info.has_geotransform)
    out += fmt::format("first post {:.10g}, {:.10g}; step {:.10g}, {:.10g}\n", m.x0, m.y0, m.x_col,
                       m.y_row);
  if (info.has_geotransform && (m.x_row != 0 || m.y_col != 0))
    out += fmt::format(
        "turned     rows run {:.4g} degrees off the CRS's first axis, columns {:.4g} off "
        "its second\n",
        turn_deg(m.y_col, m.x_col), turn_deg(-m.x_row, m.y_row));
  out += fmt::format("CRS        {}\n", info.crs_kind == CrsKind::none
                                            ? "none: can be simplified, but not tiled"
                                            : logging::printable(info.crs_name + crs_remark(info)));
  if (info.crs_kind != CrsKind::none)
    out += fmt::format("bounds     {:.6f} {:.6f} {:.6f} {:.6f} (west south east north){}\n",
                       info.bounds.west, info.bounds.south, info.bounds.east, info.bounds.north,
                       info.wraps_longitude ? ", around the globe" : "");
  out += fmt::format("numbers    {}\n", content_text(content));
  out += fmt::format("unit       {} m, {}\n", info.z_unit_m,
                     info.rounding_m == 0
                         ? std::string("stored exactly")
                         : fmt::format("rounded by at most {:.3g} m", info.rounding_m));
  out += fmt::format("datum      {}{}\n", logging::printable(name(info.datum)), datum_remark(info));
  if (info.accuracy) out += fmt::format("accuracy   {}, as stated\n", text(*info.accuracy));
  return out + fmt::format("content    {}\n", info.fingerprint);
}

std::string to_text(const Heights& h) {
  const std::string range = h.range.valid == 0
                                ? std::string("none")
                                : fmt::format("{:.8g} .. {:.8g} m", h.range.min_m, h.range.max_m);
  if (h.all)
    return fmt::format("heights    {}\nvoids      {} ({} %)\n", range, h.voids(),
                       percent_text(h.void_share(), 4));
  return fmt::format(
      "heights    {} in a sample of {} posts (--stats reads all of them)\n"
      "voids      {} % of the sample\n",
      range, h.posts, percent_text(h.void_share(), 4));
}

}  // namespace

std::string percent_text(double share, int digits) {
  std::string text = fmt::format("{:.{}g}", 100 * share, digits);
  while (share < 1 && text == "100") text = fmt::format("{:.{}g}", 100 * share, ++digits);
  return text;
}

Result<Json> info_dem(const DemSource& dem, const DemOptions& read, const InfoDemOptions& options) {
  if (!options.quiet) warn_of(dem.info());
  const auto content = content_json(dem.info().files.front(), read);
  if (!content) return content;
  if (!options.json) {
    std::printf("%s", facts(dem.info(), *content).c_str());
    std::fflush(stdout);
  }
  const auto heights = heights_of(dem, options);
  if (!heights) return std::unexpected(heights.error());
  if (!options.quiet) warn_of_nodata(dem);
  if (options.json) {
    Json j = to_json(dem, *heights);
    j["content"] = *content;
    return j;
  }
  std::printf("%s", to_text(*heights).c_str());
  return Json();
}

}  // namespace tind::cli
