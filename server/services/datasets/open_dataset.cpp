#include "server/services/datasets/open_dataset.h"

#include <algorithm>
#include <filesystem>

#include "terrain/pyramid/make/dem_tiles.h"
#include "terrain/pyramid/residual/residual_index.h"
#include "terrain/store/open/stored_tiles.h"

namespace tind::services {
namespace {

Result<std::unique_ptr<TileSet>> open_tiles(const DatasetSpec& spec, const DemOptions& dem_options,
                                            const TileSetOptions& options,
                                            const std::string& index_dir) {
  if (spec.files.size() == 1 && std::filesystem::is_directory(spec.files[0]))
    return open_stored_tiles(spec.files[0]);
  auto dem = open_dem(spec, dem_options);
  if (!dem) return std::unexpected(dem.error());
  std::string index;
  if (!index_dir.empty() && deepest_indexed_level((*dem)->info(), options.exact_posts) >= 0) {
    std::error_code error;
    std::filesystem::create_directories(index_dir, error);
    if (error) return fail(Errc::io, "cannot create " + index_dir + ": " + error.message());
    index = index_dir + "/" + (*dem)->info().fingerprint + ".residuals";
  }
  return open_dem_tiles(std::move(*dem), options, kMostReadAtOnce, index);
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
  // Before it is opened: what comes in between is seen by the next look.
  std::optional<std::uint64_t> generation;
  if (spec.files.size() == 1 && std::filesystem::is_directory(spec.files[0]))
    generation = stored_generation(spec.files[0]);
  auto tiles = open_tiles(spec, dem_options, options, index_dir);
  if (!tiles) return std::unexpected(tiles.error());
  catalog.add(name_of(spec), spec.files, std::move(*tiles), generation);
  return {};
}

}  // namespace tind::services
