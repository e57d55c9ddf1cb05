#include "terrain/dataset/dem_dataset.h"

#include <filesystem>
#include <utility>

#include "terrain/pyramid/residual/residual_index.h"

namespace tind {
namespace {

/// Empty where the source needs no index, or it is not to be kept.
Result<std::string> index_path(const Surface& surface, const TileSetOptions& options,
                               const std::string& folder) {
  if (folder.empty() || deepest_indexed_level(surface, options.exact_posts) < 0)
    return std::string();
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error) return fail(Errc::io, "cannot create " + folder + ": " + error.message());
  return folder + "/" + surface.info().fingerprint + ".residuals";
}

}  // namespace

Result<Dataset> dem_dataset(const Surface& surface, const TileSetOptions& options,
                            const std::string& index_dir, std::int64_t read_at_once) {
  const auto index = index_path(surface, options, index_dir);
  if (!index) return std::unexpected(index.error());
  auto opened = open_dem_tiles(surface, options, read_at_once, *index);
  if (!opened) return std::unexpected(opened.error());
  const std::shared_ptr<const DemTiles> tiles = std::move(*opened);
  Dataset made = dataset_of(tiles);
  made.source = std::make_shared<const Surface>(surface);
  made.options = std::make_shared<const TileSetOptions>(options);
  made.unchanged = [surface]() -> Result<void> {
    for (const SurfaceLayer& layer : surface.layers())
      if (auto same = layer.source->unchanged(); !same) return same;
    return {};
  };
  DatasetFacts known = made.facts();
  if (known.bounds.width() >= 360) known.box = box_of(surface.info());
  made.facts = [tiles, settled = std::move(known)] {
    DatasetFacts facts = settled;
    facts.extremes = tiles->extremes();
    return facts;
  };
  return made;
}

}  // namespace tind
