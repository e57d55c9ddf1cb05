#include "terrain/dataset/dem_dataset.h"

#include <filesystem>
#include <utility>

#include "terrain/pyramid/residual/residual_index.h"

namespace tind {
namespace {

/// Empty where the source needs no index, or it is not to be kept.
Result<std::string> index_path(const DemInfo& info, const TileSetOptions& options,
                               const std::string& folder) {
  if (folder.empty() || deepest_indexed_level(info, options.exact_posts) < 0) return std::string();
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error) return fail(Errc::io, "cannot create " + folder + ": " + error.message());
  return folder + "/" + info.fingerprint + ".residuals";
}

}  // namespace

Result<Dataset> dem_dataset(std::shared_ptr<const DemSource> source, const TileSetOptions& options,
                            const std::string& index_dir, std::int64_t read_at_once) {
  const auto index = index_path(source->info(), options, index_dir);
  if (!index) return std::unexpected(index.error());
  auto opened = open_dem_tiles(source, options, read_at_once, *index);
  if (!opened) return std::unexpected(opened.error());
  const std::shared_ptr<const DemTiles> tiles = std::move(*opened);
  Dataset made = dataset_of(tiles);
  made.source = std::move(source);
  made.facts = [tiles, settled = made.facts()] {
    DatasetFacts facts = settled;
    facts.extremes = tiles->extremes();
    return facts;
  };
  return made;
}

}  // namespace tind
