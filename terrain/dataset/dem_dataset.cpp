#include "terrain/dataset/dem_dataset.h"

#include <chrono>
#include <filesystem>
#include <memory>
#include <mutex>
#include <utility>

#include "terrain/pyramid/residual/residual_index.h"
#include "terrain/raster/remote/objects.h"

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

bool on_other_machines(const Surface& surface) {
  for (const SurfaceLayer& layer : surface.layers())
    for (const std::string& file : layer.source->info().files)
      if (remote::is_remote(file)) return true;
  return false;
}

/// What is read from another machine is held against the version that was opened anyway: that it
/// is another need not be known at once.
class RareLook {
 public:
  Result<void> look(const Surface& surface) {
    const std::lock_guard lock(mutex_);
    const auto now = std::chrono::steady_clock::now();
    if (now - last_ < kPause) return found_;
    found_ = surface.unchanged();
    last_ = std::chrono::steady_clock::now();
    return found_;
  }

 private:
  static constexpr std::chrono::seconds kPause{15};
  std::mutex mutex_;
  Result<void> found_;
  std::chrono::steady_clock::time_point last_ = std::chrono::steady_clock::now();
};

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
  if (on_other_machines(surface))
    made.unchanged = [surface, rare = std::make_shared<RareLook>()] { return rare->look(surface); };
  else
    made.unchanged = [surface] { return surface.unchanged(); };
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
