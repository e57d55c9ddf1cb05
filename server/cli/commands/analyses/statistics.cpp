// tind statistics: what a DEM is like inside each polygon of a file.

#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <type_traits>
#include <variant>

#include "proto/csv.h"
#include "proto/json_text.h"
#include "server/cli/commands/commands.h"
#include "server/cli/options/dem_input.h"
#include "server/cli/options/output_options.h"
#include "server/cli/options/output_paths.h"
#include "server/cli/options/plane_scale.h"
#include "server/cli/options/polygon_input.h"
#include "server/cli/options/tin_input.h"
#include "server/cli/program/progress_bar.h"
#include "terrain/analysis/zonal.h"
#include "terrain/base/file_io.h"
#include "terrain/raster/gdal/vectors/vector_source.h"

namespace tind::cli {

namespace {

struct Arguments {
  DemInput dem;
  std::string polygons, output, progress = "auto";
  double base_m = 0;
  bool json = false;
};

struct Row {
  std::size_t feature;
  ZonalStatistics s;
};

struct Made {
  std::vector<Row> rows;
  VectorAttributes attributes;
  AreaScale scale;  // of all polygons
};

Result<Made> make(const Arguments& a) {
  auto dem = open_dem(a.dem);
  if (!dem) return std::unexpected(dem.error());
  const auto areas = read_areas(a.polygons, **dem);
  if (!areas) return std::unexpected(areas.error());
  auto attributes = read_attributes(a.polygons);
  if (!attributes) return std::unexpected(attributes.error());
  ProgressBar bar("statistics", progress_style(a.progress));
  Made all;
  all.attributes = std::move(*attributes);
  std::vector<Row>& rows = all.rows;
  PostRings rings;
  for (const NamedArea& area : *areas) {
    rings.insert(rings.end(), area.rings.begin(), area.rings.end());
    const auto made = zonal_statistics(*dem, area.rings, a.base_m);
    if (!made) return std::unexpected(made.error());
    rows.push_back({area.feature, *made});
    bar.at(double(rows.size()) / double(areas->size()));
  }
  warn_of_nodata(**dem);
  all.scale = area_scale(**dem, rings);
  warn_of_areas(all.scale, (*dem)->info());
  return all;
}

/// Nothing where there is no post to speak of.
std::optional<double> of_posts(const ZonalStatistics& s, double value) {
  return s.posts > 0 ? std::optional(value) : std::nullopt;
}

struct Column {
  const char* name;
  std::optional<double> (*value)(const ZonalStatistics&);
};
constexpr Column kColumns[] = {
    {"min_m", [](const ZonalStatistics& s) { return of_posts(s, s.min_m); }},
    {"max_m", [](const ZonalStatistics& s) { return of_posts(s, s.max_m); }},
    {"mean_m", [](const ZonalStatistics& s) { return of_posts(s, s.mean_m); }},
    {"std_m", [](const ZonalStatistics& s) { return of_posts(s, s.std_m); }},
    {"median_m", [](const ZonalStatistics& s) { return of_posts(s, s.median_m); }},
    {"area_m2", [](const ZonalStatistics& s) { return std::optional(s.area_m2); }},
    {"void_area_m2", [](const ZonalStatistics& s) { return std::optional(s.void_area_m2); }},
    {"surface_mean_m",
     [](const ZonalStatistics& s) {
       return s.area_m2 > 0 ? std::optional(s.surface_mean_m) : std::nullopt;
     }},
    {"volume_m3", [](const ZonalStatistics& s) { return std::optional(s.volume_m3); }}};

/// What the file says of a feature, as JSON: null where it says nothing.
nlohmann::ordered_json json_of(const VectorAttributes::Value& value) {
  return std::visit(
      [](const auto& v) -> nlohmann::ordered_json {
        if constexpr (std::is_same_v<decltype(v), const std::monostate&>)
          return nullptr;
        else
          return v;
      },
      value);
}

const VectorAttributes::Value& value_of(const Made& made, const Row& row, std::size_t k) {
  static const VectorAttributes::Value nothing;
  const auto& all = made.attributes.of_feature;  // (a file may have shrunk meanwhile)
  return row.feature < all.size() ? all[row.feature][k] : nothing;
}

/// A name that is no column's yet.
std::string column_of(const std::string& attribute) {
  const auto taken = [&](std::string_view name) { return attribute == name; };
  const bool ours = std::ranges::any_of(kColumns, taken, &Column::name) || taken("feature") ||
                    taken("posts") || taken("voids") || taken("beyond_dem");
  return csv::field(ours ? "properties." + attribute : attribute);
}

std::string csv_text(const Made& made) {
  std::string text = "feature,posts,voids";
  for (const Column& column : kColumns) text += std::string(",") + column.name;
  text += ",beyond_dem";
  for (const std::string& name : made.attributes.names) text += "," + column_of(name);
  text += "\n";
  for (const Row& row : made.rows) {
    text += fmt::format("{},{},{}", row.feature, row.s.posts, row.s.voids);
    for (const Column& column : kColumns) {
      const auto value = column.value(row.s);
      text += value ? fmt::format(",{:.6f}", *value) : ",";
    }
    text += row.s.beyond ? ",true" : ",false";
    for (std::size_t k = 0; k < made.attributes.names.size(); ++k) {
      const auto json = json_of(value_of(made, row, k));
      text += ",";
      if (json.is_string())
        text += csv::field(json.get_ref<const std::string&>());
      else if (!json.is_null())
        text += json::to_text(json);
    }
    text += "\n";
  }
  return text;
}

std::string json_text(const Arguments& a, const Made& made) {
  nlohmann::ordered_json list = nlohmann::ordered_json::array();
  for (const Row& row : made.rows) {
    nlohmann::ordered_json one = {
        {"feature", row.feature}, {"posts", row.s.posts}, {"voids", row.s.voids}};
    for (const Column& column : kColumns) {
      const auto value = column.value(row.s);
      one[column.name] = value ? nlohmann::ordered_json(*value) : nlohmann::ordered_json();
    }
    one["beyond_dem"] = row.s.beyond;
    nlohmann::ordered_json properties = nlohmann::ordered_json::object();
    for (std::size_t k = 0; k < made.attributes.names.size(); ++k)
      properties[made.attributes.names[k]] = json_of(value_of(made, row, k));
    one["properties"] = std::move(properties);
    list.push_back(std::move(one));
  }
  const nlohmann::ordered_json all = {{"base_m", a.base_m},
                                      {"area_scale", area_scale_json(made.scale)},
                                      {"polygons", std::move(list)}};
  return json::to_text(all, 2) + "\n";
}

int run(const Arguments& a) {
  std::vector<std::string> inputs = inputs_of(a.dem);
  inputs.push_back(a.polygons);
  if (a.json && !a.output.empty() && !a.output.ends_with(".json"))
    return complain(
        {Errc::invalid_argument,
         "--json is for standard output; a file has what its name says: name it .json"});
  const bool device = a.output.starts_with("/dev/");
  if (!a.output.empty() && !device && !a.output.ends_with(".csv") && !a.output.ends_with(".json"))
    return complain({Errc::invalid_argument, a.output + ": name the table .csv or .json"});
  if (const int code = check_outputs({a.output}, inputs); code != kOk) return code;
  const auto made = make(a);
  if (!made) return complain_of(a.dem, made.error());
  const bool as_json = a.json || a.output.ends_with(".json");
  const std::string text = as_json ? json_text(a, *made) : csv_text(*made);
  if (a.output.empty()) {
    std::fwrite(text.data(), 1, text.size(), stdout);
    return kOk;
  }
  if (const auto ok = write_whole_file(a.output, text); !ok) return complain(ok.error());
  fmt::print("{}: {} polygons\n", a.output, made->rows.size());
  return kOk;
}

}  // namespace

void add_statistics(Command program, int& exit) {
  auto a = std::make_shared<Arguments>();
  Command app = program.add_subcommand(
      "statistics", "Heights, areas and volumes inside each polygon of a file (zonal statistics)");
  app.add_option("input", a->dem.files, dem_or_tin_help()).required();
  app.add_option("--polygons", a->polygons, "a vector file; a row for each feature with polygons")
      .required();
  app.add_option("--base", a->base_m, "volumes are between the surface and this height, metres")
      .range(-1e6, 1e6)
      .shown();
  app.add_option("-o,--output", a->output, ".csv or .json; without it CSV on standard output");
  add_tin_options(app, a->dem);
  add_dem_options(app, a->dem);
  add_window_options(app, a->dem);
  add_json_flag(app, a->json);
  add_progress_option(app, a->progress);
  app.footer("Example: tind statistics alps.tif --polygons parcels.gpkg -o parcels.csv");
  app.on_run([a, &exit] { exit = run(*a); });
}

}  // namespace tind::cli
