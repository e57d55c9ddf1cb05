#include "server/services/datasets/open_dataset.h"

#include <algorithm>
#include <filesystem>
#include <utility>

#include "terrain/base/file_there.h"
#include "terrain/dataset/dem_dataset.h"
#include "terrain/dataset/stored_dataset.h"
#include "terrain/mesh/mesh_file.h"
#include "terrain/raster/file_state.h"
#include "terrain/shapes/shaped_dem.h"
#include "terrain/surface/open_surface.h"

namespace tind::services {
namespace {

/// What a table says of how a DEM is read and made into tiles means nothing for tiles that are
/// made. Who reads rasters is no such word: an operator says it of all that he has.
Result<void> no_settings_of_dems(const DatasetSpec& spec) {
  std::string names;
  for (const auto& [name, text] : spec.own)
    if (name != "attribution" && name != "drape" && name != "land-cover" && name != "sandbox")
      names += (names.empty() ? "" : ", ") + file_key(name);
  if (names.empty()) return {};
  return fail(Errc::invalid_argument,
              spec.files[0] +
                  ": holds tiles, which are served as they were made; leave out what is "
                  "for a DEM: " +
                  names);
}

/// GDAL's words for a mesh would say that it is no raster, and nothing of what to do with it.
Error not_a_dem(const Error& why, const std::vector<std::string>& files) {
  if (why.code != Errc::bad_data) return why;
  for (const std::string& file : files)
    if (format_to_read(file) || format_only_written(file))
      return {
          Errc::unsupported,
          file +
              ": is a mesh, and what is served is a DEM (a raster) or tiles: serve the DEM that "
              "it was made of; clients send meshes of their own to /processes/simplify, "
              "measure and compare"};
  return why;
}

/// A file as another process finds it; what is no path of this system stays as it is.
std::string absolute(const std::string& path) {
  if (path.find("://") != path.npos || path.starts_with("/vsi")) return path;
  std::error_code error;
  const auto whole = std::filesystem::absolute(path, error);
  return error ? path : whole.string();
}

/// Of each layer what was said of all, and what its own table says.
std::vector<DemRecipe> recipes_of(const Surface& source, const DatasetSpec& spec,
                                  const DatasetOptions& options) {
  std::vector<DemRecipe> recipes;
  for (const SurfaceLayer& layer : source.layers()) {
    DemRecipe recipe{{}, options.dem_words};
    for (const std::string& file : layer.source->info().files)
      recipe.files.push_back(absolute(file));
    const auto table = std::ranges::find(spec.layers, layer.name, &LayerTable::name);
    if (table != spec.layers.end())
      for (const auto& [key, text] : table->own)  // named as in a file
        for (const DatasetSetting& row : dataset_settings())
          if (row.of_dem && file_key(row.name) == key) recipe.words[row.name] = text;
    for (auto& [name, text] : recipe.words)
      if (const auto may_be_path = dataset_setting(name)->may_be_path;
          may_be_path && may_be_path(text))
        text = absolute(text);
    recipes.push_back(std::move(recipe));
  }
  return recipes;
}

Result<Dataset> open(const DatasetSpec& spec, const DatasetOptions& options,
                     const std::string& index_dir) {
  if (is_stored(spec)) {
    if (auto ok = no_settings_of_dems(spec); !ok) return std::unexpected(ok.error());
    return stored_dataset(spec.files[0]);
  }
  auto source = open_source(spec, options.dem);
  if (!source) return std::unexpected(source.error());
  source = shaped_surface(std::move(*source), options.shapes);
  if (!source) return std::unexpected(source.error());
  auto recipes = recipes_of(*source, spec, options);
  auto dataset = dem_dataset(*source, options.tiles, index_dir);
  if (dataset) dataset->recipes = std::move(recipes);
  return dataset;
}

Dataset with_attribution(Dataset dataset, const std::string& attribution) {
  dataset.facts = [known = std::move(dataset.facts), attribution] {
    DatasetFacts facts = known();
    facts.attribution = attribution;
    return facts;
  };
  if (dataset.renewed)
    dataset.renewed = [renewed = std::move(dataset.renewed), attribution]() {
      auto other = renewed();
      if (other) other = with_attribution(std::move(*other), attribution);
      return other;
    };
  return dataset;
}

Dataset with_draped(Dataset dataset, const Draped& draped) {
  dataset.draped = draped;
  if (dataset.renewed)
    dataset.renewed = [renewed = std::move(dataset.renewed), draped]() {
      auto other = renewed();
      if (other) other = with_draped(std::move(*other), draped);
      return other;
    };
  return dataset;
}

/// A dataset that changes with the images that are drawn on it, too.
Dataset with_images(Dataset dataset, FileStates images) {
  if (dataset.renewed)
    dataset.renewed = [renewed = std::move(dataset.renewed), images]() {
      auto other = renewed();
      if (other) other = with_images(std::move(*other), images);
      return other;
    };
  dataset.unchanged = [of_heights = std::move(dataset.unchanged),
                       images = std::move(images)]() -> Result<void> {
    if (of_heights)
      if (auto same = of_heights(); !same) return same;
    return images.unchanged();
  };
  return dataset;
}

/// The image comes first: tiles may be made for its sake.
Result<Dataset> open_with_draped(const DatasetSpec& spec, const DatasetOptions& options,
                                 const std::string& index_dir) {
  FileStates images;
  for (const std::string& image : {options.drape, options.land_cover})
    if (!image.empty()) {
      const auto there = is_there(image);
      if (!there) return std::unexpected(there.error());
      if (!*there) continue;  // whoever opens it says so
      if (auto known = images.add(image); !known) return std::unexpected(known.error());
    }
  const auto draped = open_draped(options.drape, options.land_cover);
  if (!draped) return std::unexpected(draped.error());
  DatasetOptions coloured = options;
  coloured.tiles.colours = draped->colours;
  auto dataset = open(spec, coloured, index_dir);
  if (!dataset || (options.drape.empty() && options.land_cover.empty())) return dataset;
  const GeoRect where = dataset->source ? dataset->source->info().bounds : dataset->facts().box;
  if (auto ok = check_lies_on(where, *draped, options.drape, options.land_cover); !ok)
    return std::unexpected(ok.error());
  return with_images(with_draped(std::move(*dataset), *draped), std::move(images));
}

}  // namespace

Result<Surface> open_source(const DatasetSpec& spec, const DemOptions& options) {
  if (!spec.layers.empty()) {
    const auto specs = layers_of(spec, options);
    if (!specs) return std::unexpected(specs.error());
    return open_surface(specs->layers, specs->options);
  }
  auto dem = open_surface(spec.files, {.dem = options});
  if (!dem) dem = std::unexpected(not_a_dem(dem.error(), spec.files));
  if (dem || dem.error().code != Errc::not_found || spec.files.size() != 1) return dem;
  const std::string& text = spec.files[0];
  if (std::error_code none; text.find(',') == text.npos || std::filesystem::exists(text, none))
    return dem;
  return fail(Errc::not_found, dem.error().what +
                                   "; several files are one dataset as NAME=" + text +
                                   ", and those whose names hold commas as [[dataset]] in a file "
                                   "for --config");
}

Result<Dataset> open_dataset(const DatasetSpec& spec, const DatasetOptions& options,
                             const std::string& index_dir) {
  if (spec.files.empty())
    return fail(Errc::invalid_argument, "dataset " + spec.name + " names no file");
  auto files = files_of(spec);
  if (!files) return std::unexpected(files.error());
  DatasetSpec plain = spec;
  plain.files = std::move(*files);
  auto dataset = open_with_draped(plain, options, index_dir);
  if (!dataset && !spec.where.empty()) return fail(spec.where, dataset.error());
  if (!dataset || options.attribution.empty()) return dataset;
  return with_attribution(std::move(*dataset), options.attribution);
}

Result<void> open_dataset(Catalog& catalog, const DatasetSpec& spec, const DemOptions& dem_options,
                          const TileSetOptions& options, const std::string& index_dir) {
  auto dataset = open_dataset(spec, {dem_options, options, {}, {}}, index_dir);
  if (!dataset) return std::unexpected(dataset.error());
  catalog.add(name_of(spec), std::move(*dataset));
  return {};
}

}  // namespace tind::services
