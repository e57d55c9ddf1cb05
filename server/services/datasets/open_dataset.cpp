#include "server/services/datasets/open_dataset.h"

#include <filesystem>
#include <utility>

#include "terrain/dataset/dem_dataset.h"
#include "terrain/dataset/stored_dataset.h"
#include "terrain/shapes/shaped_dem.h"
#include "terrain/surface/open_surface.h"

namespace tind::services {
namespace {

Result<Dataset> open(const DatasetSpec& spec, const DatasetOptions& options,
                     const std::string& index_dir) {
  if (is_stored(spec)) return stored_dataset(spec.files[0]);
  auto source = open_source(spec, options.dem);
  if (!source) return std::unexpected(source.error());
  source = shaped_surface(std::move(*source), options.shapes);
  if (!source) return std::unexpected(source.error());
  return dem_dataset(std::move(*source), options.tiles, index_dir);
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

}  // namespace

Result<Surface> open_source(const DatasetSpec& spec, const DemOptions& options) {
  if (!spec.layers.empty()) {
    const auto specs = layers_of(spec, options);
    if (!specs) return std::unexpected(specs.error());
    return open_surface(specs->layers, specs->options);
  }
  auto dem = open_surface(spec.files, {.dem = options});
  if (dem || dem.error().code != Errc::not_found || spec.files.size() != 1) return dem;
  const std::string& text = spec.files[0];
  if (text.find(',') == text.npos || std::filesystem::exists(text)) return dem;
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
  auto dataset = open(plain, options, index_dir);
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
