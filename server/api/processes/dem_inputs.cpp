#include "server/api/processes/dem_inputs.h"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <utility>

#include "server/services/datasets/dataset_file.h"
#include "terrain/base/caught.h"
#include "terrain/geo/tiling_scheme.h"
#include "terrain/raster/datums.h"

namespace tind::api {
namespace {

using Ordered = nlohmann::ordered_json;

constexpr std::size_t kLongestWord = 64;

/// Which layer of the DEM. Nothing (and a problem) where it cannot be told.
void read_layer(DemOfJob& dem, Members& inputs, Problems& problems) {
  const services::ServedDataset& dataset = *dem.dataset;
  const Json* const json = inputs.member("layer");
  const auto layers = dataset.source->layers();
  if (dataset.recipes.size() != layers.size())
    return problems.add("dataset", "is none whose DEM a job can open");
  std::string names;
  for (std::size_t k = 0; k < layers.size(); ++k) {
    const bool only = !json && layers.size() == 1;
    if (only || (json && json->is_string() && *json == layers[k].name)) {
      dem.recipe = &dataset.recipes[k];
      dem.info = &layers[k].source->info();
      return;
    }
    names += (names.empty() ? "" : ", ") + layers[k].name;
  }
  problems.add("layer",
               json ? "must be one of " + names
                    : "missing: the dataset has several (" + names + "), and a job is of one");
}

/// Why the DEM's heights cannot be above it, without a word of where grids are looked for; empty:
/// they can, or what would tell cannot be read just now: then the job says so.
std::string why_not_above(const VerticalDatum& datum, const DemInfo& info,
                          const Environment& environment) {
  if (datum == info.source_datum) return {};
  if (info.source_datum == VerticalDatum::unknown)
    return "cannot be chosen: what this DEM's heights are above is not known; leave it out";
  for (const VerticalDatum& one : {info.source_datum, datum})
    if (const auto surface = datum_surface(one, info.bounds, info.crs_wkt, environment);
        !surface && !may_pass(surface.error()))
      return "cannot be this one: the server has no grid of it that reaches there; take another, "
             "or source";
  return {};
}

/// What a daemon is told of the DEM and of its tiles, as a file that it would read.
std::string table_of(const DemOfJob& dem) {
  services::DatasetSpec spec{.name = dem.dataset->name, .files = dem.recipe->files};
  spec.own = services::setting_texts(*dem.dataset->options);
  spec.own.insert(dem.recipe->words.begin(), dem.recipe->words.end());
  // Where nobody says it, it holds where the datum is known; said, it must be.
  if (const auto to = spec.own.find("to-datum"); to != spec.own.end() && to->second == "ellipsoid")
    spec.own.erase(to);
  return services::print_dataset_file(spec);
}

/// Why a level of its tiles says nothing certain of the DEM; empty: it does.
std::string why_no_level(const DemOfJob& dem) {
  if (!dem.dataset->tiles || !dem.dataset->options)
    return "is of tiles, which this dataset has not";
  if (dem.dataset->source->layers().size() > 1)
    return "is for datasets of one DEM: tiles of several layers are not about this one alone";
  if (dem.dataset->source->shapes())
    return "is for datasets without lines and water: tiles with these are not the DEM's alone";
  return {};
}

}  // namespace

DemOfJob read_dem(const App& app, Members& inputs, Problems& problems) {
  DemOfJob dem;
  const Json* const named = inputs.member("dataset", Members::Need::must);
  if (named && named->is_string()) dem.dataset = app.catalog.find(named->get<std::string>());
  if (named && !dem.dataset)
    problems.add("dataset", "there is no such dataset; /datasets lists all");
  else if (dem.dataset && !dem.dataset->source)
    problems.add("dataset", "is a store of tiles without its DEM");
  if (dem.dataset && dem.dataset->source)
    read_layer(dem, inputs, problems);
  else
    (void)inputs.member("layer");  // known, whatever it says
  return dem;
}

std::string read_word(const char* name, const std::vector<std::string>& words, Members& inputs,
                      Problems& problems, const std::string& initial) {
  const Json* const json = inputs.member(name);
  if (!json) return initial;
  const auto found = json->is_string()
                         ? std::ranges::find(words, json->get_ref<const std::string&>())
                         : words.end();
  if (found != words.end()) return *found;
  std::string all;
  for (const std::string& word : words) all += (all.empty() ? "" : ", ") + word;
  problems.add(name, "must be one of " + all);
  return initial;
}

std::string read_datum(const App& app, const DemOfJob& dem, Members& inputs, Problems& problems) {
  const Json* const json = inputs.member("datum");
  if (!json) return {};
  std::string text = json->is_string() ? json->get<std::string>() : "";
  // A file of the server's is nothing that a client names.
  const auto datum = text.empty() || text.size() > kLongestWord || names_geoid_file(text) ||
                             text == "unknown" || text == "source"
                         ? fail(Errc::invalid_argument, "")
                         : datum_named(text);
  if (text == "source") return {};
  if (!datum && may_pass(datum.error())) return text;  // the job says so
  if (!datum) {
    problems.add("datum",
                 "must be source, ellipsoid, egm84, egm96, egm2008 or a vertical CRS "
                 "that PROJ knows (EPSG:5703)");
    return {};
  }
  if (const std::string why = dem.info ? why_not_above(*datum, *dem.info, app.environment) : "";
      !why.empty())
    problems.add("datum", why);
  return text;
}

void read_level(const App& app, const DemOfJob& dem, Members& inputs, services::JobOrder& order,
                Problems& problems) {
  const Json* const json = inputs.member("level");
  if (!json) return;
  if (!json->is_number_integer() || *json < 0 || *json > tiling::kMaxLevel)
    return problems.add("level",
                        "must be a whole number from 0 to " + std::to_string(tiling::kMaxLevel));
  if (inputs.member("datum"))
    problems.add("datum", "cannot be chosen with level: heights are above what the tiles' are");
  if (!dem.recipe) return;
  if (std::string why = why_no_level(dem); !why.empty()) return problems.add("level", why);
  order.files["tiles.toml"] = table_of(dem);
  order.arguments.push_back("--tiles=tiles.toml");
  order.arguments.push_back("--level=" + json->dump());
  if (!app.index_dir.empty()) order.arguments.push_back("--index-dir=" + app.index_dir);
}

void add_dem(const DemOfJob& dem, services::JobOrder& order) {
  const DemRecipe& recipe = *dem.recipe;
  const std::string& name = dem.dataset->name;
  for (const auto& [key, text] : recipe.words) {
    if (key == "to-datum") continue;  // the client says
    if (key == "allow-vrt") {
      if (text == "true") order.arguments.push_back("--allow-vrt");
      continue;
    }
    order.arguments.push_back("--" + key + "=" + text);
  }
  for (const std::string& file : recipe.files) {
    order.arguments.push_back(file);
    order.names.emplace_back(file, name);
  }
}

Ordered described(const char* title, const std::string& description, Ordered schema, int least) {
  return {{"title", title},
          {"description", description},
          {"minOccurs", least},
          {"schema", std::move(schema)}};
}

void describe_dem(Ordered& inputs) {
  inputs["dataset"] =
      described("Dataset", "by its name; /datasets lists all", {{"type", "string"}}, 1);
  inputs["layer"] =
      described("Layer", "which DEM, of a dataset that is layers of several; /datasets names them",
                {{"type", "string"}});
}

void describe_level(Ordered& inputs) {
  inputs["level"] = described(
      "Level of tiles",
      "in place of the DEM: what a client sees that draws this level of the dataset's tiles, or "
      "the deepest above it that is there; the answer says what their error leaves open",
      {{"type", "integer"}, {"minimum", 0}, {"maximum", tiling::kMaxLevel}});
}

void describe_datum(Ordered& inputs) {
  inputs["datum"] = described("Vertical datum",
                              "what heights are to be above: source, ellipsoid, egm96, EPSG:5703",
                              {{"type", "string"}, {"default", "source"}});
}

}  // namespace tind::api
