#include "server/services/datasets/open_dataset.h"

#include <algorithm>
#include <filesystem>

#include "terrain/dataset/dem_dataset.h"
#include "terrain/dataset/stored_dataset.h"

namespace tind::services {
namespace {

Result<Dataset> open(const DatasetSpec& spec, const DemOptions& dem_options,
                     const TileSetOptions& options, const std::string& index_dir) {
  if (is_stored(spec)) return stored_dataset(spec.files[0]);
  auto dem = open_dem(spec, dem_options);
  if (!dem) return std::unexpected(dem.error());
  return dem_dataset(std::move(*dem), options, index_dir);
}

std::string name_of(const DatasetSpec& spec) {
  if (!spec.name.empty()) return spec.name;
  const std::filesystem::path path = std::filesystem::path(spec.files[0]).lexically_normal();
  const bool slash = !path.has_filename();  // "tiles/"
  if (slash) return path.parent_path().filename().string();
  return std::filesystem::is_directory(path) ? path.filename().string() : path.stem().string();
}

}  // namespace

DatasetSpec parse_dataset_spec(const std::string& text) {
  const auto equals = text.find('=');
  if (equals == text.npos || std::filesystem::exists(text)) return {{}, {text}};
  DatasetSpec spec{text.substr(0, equals), {}};
  std::string_view rest = std::string_view(text).substr(equals + 1);
  while (!rest.empty()) {
    const std::string_view file = rest.substr(0, rest.find(','));
    if (!file.empty()) spec.files.emplace_back(file);
    rest.remove_prefix(std::min(file.size() + 1, rest.size()));
  }
  return spec;
}

bool is_stored(const DatasetSpec& spec) {
  return spec.files.size() == 1 && std::filesystem::is_directory(spec.files[0]);
}

Result<std::shared_ptr<const DemSource>> open_dem(const DatasetSpec& spec,
                                                  const DemOptions& options) {
  auto dem = DemSource::open(spec.files, options);
  if (dem || dem.error().code != Errc::not_found || spec.files.size() != 1) return dem;
  const std::string& text = spec.files[0];
  if (text.find(',') == text.npos || std::filesystem::exists(text)) return dem;
  return fail(Errc::not_found,
              dem.error().what + "; several files are one dataset as NAME=" + text);
}

Result<void> open_dataset(Catalog& catalog, const DatasetSpec& spec, const DemOptions& dem_options,
                          const TileSetOptions& options, const std::string& index_dir) {
  if (spec.files.empty())
    return fail(Errc::invalid_argument, "dataset " + spec.name + " names no file");
  auto dataset = open(spec, dem_options, options, index_dir);
  if (!dataset) return std::unexpected(dataset.error());
  catalog.add(name_of(spec), std::move(*dataset));
  return {};
}

}  // namespace tind::services
