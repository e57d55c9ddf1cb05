#include "server/services/datasets/dataset_settings.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <charconv>

#include "terrain/base/enum_names.h"
#include "terrain/base/lower_case.h"
#include "terrain/geo/tiling_scheme.h"
#include "terrain/pyramid/plan/tile_method.h"
#include "terrain/raster/datums.h"
#include "terrain/raster/dem_options_text.h"
#include "terrain/simplify/method_text.h"

namespace tind::services {
namespace {

// --- the DEM -------------------------------------------------------------------------------------

DatasetSetting of_dem(const DemOptionText& text) {
  std::string name = text.name;
  std::ranges::replace(name, '_', '-');
  DatasetSetting row{.name = name, .help = text.help, .set = {}};
  row.is_list = name == "nodata";
  row.of_dem = true;
  if (name == "from-datum") row.initial = "unknown";
  if (name == "to-datum") row.initial = "ellipsoid";
  if (name.ends_with("-datum")) row.may_be_path = names_geoid_file;
  row.set = [key = std::string(text.name)](DatasetOptions& options, std::string_view value) {
    return set_dem_option(key, value, options.dem);
  };
  return row;
}

DatasetSetting allow_vrt() {
  return {.name = "allow-vrt",
          .help = "accept VRT files, which can name any other file",
          .initial = "false",
          .is_switch = true,
          .of_dem = true,
          .set = [](DatasetOptions& options, std::string_view value) -> Result<void> {
            const auto on = parse_switch(value);
            if (!on) return std::unexpected(on.error());
            options.dem.allow_vrt = *on;
            return {};
          }};
}

/// Who opens the files has chosen by then (catalog_keeper.cpp): here it is only looked at.
DatasetSetting sandbox() {
  return {
      .name = "sandbox",
      .help =
          "whether locked-down processes of their own open and read the DEMs' files: auto "
          "(with what the kernel has; DEMs on other machines the daemon reads itself), on (with "
          "all or not at all), off (the daemon does)",
      .initial = "auto",
      .set = [](DatasetOptions&, std::string_view value) -> Result<void> {
        if (value == "auto" || value == "on" || value == "off") return {};
        return fail(Errc::invalid_argument, "must be one of auto, on, off");
      }};
}

// --- its tiles -----------------------------------------------------------------------------------

DatasetSetting number(std::string name, std::string help, double TileSetOptions::*field, double low,
                      double high) {
  return {.name = std::move(name),
          .help = std::move(help),
          .initial = fmt::format("{}", TileSetOptions{}.*field),
          .is_number = true,
          .set = [=](DatasetOptions& options, std::string_view value) -> Result<void> {
            const auto parsed = parse_number(value, low, high);
            if (!parsed) return std::unexpected(parsed.error());
            options.tiles.*field = *parsed;
            return {};
          }};
}

template <NamedEnum E>
DatasetSetting choice(const std::string& name, const std::string& help, E TileSetOptions::*field) {
  return {.name = name,
          .help = fmt::format("{}: {}", help, fmt::join(enum_names<E>(), ", ")),
          .initial = name_of(TileSetOptions{}.*field),
          .set = [field](DatasetOptions& options, std::string_view value) -> Result<void> {
            const auto chosen = enum_named<E>(lower_case(value));
            if (!chosen)
              return fail(Errc::invalid_argument,
                          fmt::format("must be one of {}", fmt::join(enum_names<E>(), ", ")));
            options.tiles.*field = *chosen;
            return {};
          }};
}

/// "qem", "edge-cost alpha=0.5": bounded has its effort and side in settings of their own.
DatasetSetting method() {
  return {.name = "method",
          .help =
              "who makes the tiles' meshes, with options of its own after the name, as in "
              "'edge-cost alpha=0.5'; tind methods lists them",
          .initial = method_text(TileSetOptions{}.method),
          .set = [](DatasetOptions& options, std::string_view value) -> Result<void> {
            const auto method = tile_method_from_text(lower_case(value));
            if (!method) return std::unexpected(method.error());
            options.tiles.method = *method;
            return {};
          }};
}

// --- its lines and its water ---------------------------------------------------------------------

/// Of one dataset: another's are elsewhere.
DatasetSetting shape_files(const std::string& name, std::string help) {
  DatasetSetting row{.name = name, .help = std::move(help), .set = {}};
  row.is_list = row.is_path = true;
  row.for_all = false;
  row.set = [name](DatasetOptions& options, std::string_view value) -> Result<void> {
    while (!value.empty()) {
      const std::string_view path = value.substr(0, value.find('\n'));
      if (auto set = set_shape_option(options.shapes, name, path); !set) return set;
      value.remove_prefix(std::min(path.size() + 1, value.size()));
    }
    return {};
  };
  return row;
}

DatasetSetting line_heights() {
  return {.name = "line-heights",
          .help =
              "heights of breaklines and level polygons: their own where they have any (line), "
              "or the DEM's (dem)",
          .initial = "line",
          .for_all = false,
          .set = [](DatasetOptions& options, std::string_view value) {
            return set_shape_option(options.shapes, "line_heights", value);
          }};
}

/// "A-B" or "A".
Result<void> set_levels(DatasetOptions& options, std::string_view text) {
  const std::string_view low = text.substr(0, text.find('-'));
  const std::string_view high = low.size() == text.size() ? low : text.substr(low.size() + 1);
  const auto first = parse_number<int>(low, 0, tiling::kMaxLevel);
  const auto last = parse_number<int>(high, 0, tiling::kMaxLevel);
  if (!first || !last || *last < *first)
    return fail(Errc::invalid_argument,
                fmt::format("must be A-B with 0 <= A <= B <= {}", tiling::kMaxLevel));
  options.tiles.first_level = *first;
  options.tiles.last_level = *last;
  return {};
}

// --- the table -----------------------------------------------------------------------------------

std::vector<DatasetSetting> make_table() {
  std::vector<DatasetSetting> table;
  for (const DemOptionText& text : dem_option_texts()) table.push_back(of_dem(text));
  table.push_back(allow_vrt());
  table.push_back(sandbox());
  table.push_back(number("max-error",
                         "largest error at the deepest level, metres; 0: 1/32 of the post spacing",
                         &TileSetOptions::max_error_m, 0, 1e6));
  table.push_back(number("error-factor", "scales the error that each coarser level may have",
                         &TileSetOptions::error_factor, 1e-3, 1e3));
  table.push_back(
      choice("side", "where tiles lie as seen from the DEM's posts", &TileSetOptions::side));
  table.push_back(method());
  table.push_back(
      choice("effort", "how hard to look for fewer triangles", &TileSetOptions::effort));
  table.push_back(
      {.name = "levels", .help = "only these levels, A-B", .for_all = false, .set = set_levels});
  table.push_back(shape_files("breaklines", "lines that stay edges of tiles: vector files"));
  table.push_back(shape_files("flatten", "polygons that are level in all tiles: vector files"));
  table.push_back(shape_files("boundary", "only posts in these polygons count: vector files"));
  table.push_back(shape_files(
      "water", "what the tiles' water masks show: polygons of vector files, or rasters"));
  table.push_back(line_heights());
  table.push_back({.name = "drape",
                   .help = "an image that says where it is (GeoTIFF): colours of the vertices of "
                           "its 3D Tiles; by method attribute-qem they lie where its edges are",
                   .is_path = true,
                   .for_all = false,
                   .set = [](DatasetOptions& options, std::string_view value) -> Result<void> {
                     options.drape = value;
                     return {};
                   }});
  table.push_back({.name = "land-cover",
                   .help = "a raster of classes that says where it is (GeoTIFF): features of the "
                           "triangles of its 3D Tiles",
                   .is_path = true,
                   .for_all = false,
                   .set = [](DatasetOptions& options, std::string_view value) -> Result<void> {
                     options.land_cover = value;
                     return {};
                   }});
  table.push_back({.name = "attribution",
                   .help = "who is to be named with it",
                   .for_all = false,
                   .set = [](DatasetOptions& options, std::string_view value) -> Result<void> {
                     constexpr std::size_t kMost = 2000;  // it is in every layer.json
                     if (value.size() > kMost)
                       return fail(Errc::invalid_argument,
                                   fmt::format("must have at most {} bytes", kMost));
                     options.attribution = value;
                     return {};
                   }});
  return table;
}

Result<void> apply(const SettingTexts& texts, DatasetOptions& options) {
  for (const auto& [name, text] : texts) {
    const DatasetSetting* const row = dataset_setting(name);
    if (!row) return fail(Errc::invalid_argument, "there is no setting " + name);
    if (auto done = row->set(options, text); !done) return fail(name, done.error());
  }
  return {};
}

}  // namespace

const std::vector<DatasetSetting>& dataset_settings() {
  static const std::vector<DatasetSetting> table = make_table();
  return table;
}

bool is_of_dem(std::string_view name) {
  const DatasetSetting* const row = dataset_setting(name);
  return row && row->of_dem;
}

const DatasetSetting* dataset_setting(std::string_view name) {
  const auto row = std::ranges::find(dataset_settings(), name, &DatasetSetting::name);
  return row == dataset_settings().end() ? nullptr : &*row;
}

Result<DatasetOptions> dataset_options(const SettingTexts& every, const SettingTexts& own) {
  DatasetOptions options;
  options.dem.to_datum = TargetDatum::ellipsoid;
  if (auto done = apply(every, options); !done) return std::unexpected(done.error());
  // Said of all it is a wish; said of one dataset it must be possible.
  if (options.dem.to_datum == TargetDatum::ellipsoid)
    options.dem.to_datum = TargetDatum::ellipsoid_if_known;
  if (auto done = apply(own, options); !done) return std::unexpected(done.error());
  for (const SettingTexts* said : {&every, &own})
    for (const auto& [name, text] : *said)
      if (is_of_dem(name)) options.dem_words[name] = text;
  return options;
}

std::vector<std::string> named_geoids(const SettingTexts& texts) {
  std::vector<std::string> files;
  for (const auto& [name, text] : texts)
    if ((name.ends_with("-datum") || name.ends_with("_datum")) && names_geoid_file(text))
      files.push_back(text);
  return files;
}

std::vector<std::string> named_files(const SettingTexts& every, const SettingTexts& own) {
  std::vector<std::string> files = named_geoids(every);
  for (const std::string& file : named_geoids(own)) files.push_back(file);
  const auto options = dataset_options(every, own);
  if (!options) return files;
  const ShapeFiles& shapes = options->shapes;
  for (const auto* list : {&shapes.breaklines, &shapes.flatten, &shapes.boundary, &shapes.water})
    files.insert(files.end(), list->begin(), list->end());
  for (const std::string& file : {options->drape, options->land_cover})
    if (!file.empty()) files.push_back(file);
  return files;
}

Result<bool> parse_switch(std::string_view value) {
  if (value != "true" && value != "false")
    return fail(Errc::invalid_argument, "must be true or false");
  return value == "true";
}

template <class Number>
Result<Number> parse_number(std::string_view value, Number low, Number high) {
  Number parsed{};
  const char* const end = value.data() + value.size();
  const auto [stop, error] = std::from_chars(value.data(), end, parsed);
  if (error != std::errc() || stop != end || !(parsed >= low && parsed <= high))
    return fail(Errc::invalid_argument, fmt::format("must be a number from {} to {}", low, high));
  return parsed;
}
template Result<int> parse_number(std::string_view, int, int);
template Result<double> parse_number(std::string_view, double, double);

}  // namespace tind::services
