#pragma once
// What can be said of a dataset: one row a setting, for a [[dataset]] table of the configuration
// and, where it makes sense for all, for the daemon's own flags, environment and file. What a table
// says wins over what the daemon says.

#include <functional>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "terrain/base/result.h"
#include "terrain/pyramid/plan/tile_set_options.h"
#include "terrain/raster/dem_source.h"
#include "terrain/shapes/shape_files.h"

namespace tind::services {

/// What a dataset is opened with.
struct DatasetOptions {
  DemOptions dem;
  TileSetOptions tiles;
  ShapeFiles shapes;                                  // its lines and its water
  std::string attribution;                            // empty: as its tiles say
  std::string drape = {};                             // an image
  std::string land_cover = {};                        // a raster of classes
  std::map<std::string, std::string> dem_words = {};  // what `dem` was made of: name and text
};

/// One row: how it is called, what it means, how it is set.
struct DatasetSetting {
  std::string name;  // "max-error"; in a file max_error
  std::string help;
  std::string initial = {};  // what holds where nobody says anything; empty: as the files say
  bool is_number = false;    // in TOML without quotes
  bool is_switch = false;    // true or false; a flag without a value
  bool is_list = false;      // takes several with commas between, in TOML also as a list
  bool is_path = false;      // names files: in a table relative to its folder, '\n' between several
  bool for_all = true;       // also a setting of the daemon
  bool of_dem = false;       // says how the DEM is opened
  bool (*may_be_path)(std::string_view) = nullptr;  // of a text that can name a file, or else
  std::function<Result<void>(DatasetOptions&, std::string_view)> set;
};

const std::vector<DatasetSetting>& dataset_settings();
/// nullptr where there is none of that name.
const DatasetSetting* dataset_setting(std::string_view name);

/// Is it said of how a DEM is opened?
bool is_of_dem(std::string_view name);

/// Settings as somebody gave them: texts by name.
using SettingTexts = std::map<std::string, std::string, std::less<>>;

/// `every`: what the daemon says; `own`: what the dataset's table says. The first setting that is
/// wrong is the error.
Result<DatasetOptions> dataset_options(const SettingTexts& every, const SettingTexts& own);

/// The files of geoids that settings name. Of layers, too, whose settings are called as in a file:
/// from_datum.
std::vector<std::string> named_geoids(const SettingTexts&);
/// All files that settings name beside the DEM's own: geoids, lines and areas, images. Of settings
/// that are wrong, the geoids.
std::vector<std::string> named_files(const SettingTexts& every, const SettingTexts& own);

/// Reads "true", "12" ...: what set() of the rows here and of the daemon's settings is made of.
Result<bool> parse_switch(std::string_view);
template <class Number>
Result<Number> parse_number(std::string_view, Number low, Number high);

}  // namespace tind::services
