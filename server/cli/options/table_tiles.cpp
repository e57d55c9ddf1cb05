#include "server/cli/options/table_tiles.h"

#include <chrono>
#include <mutex>
#include <thread>
#include <utility>

#include "server/services/datasets/config.h"
#include "server/services/datasets/dataset_file.h"
#include "server/services/datasets/open_dataset.h"
#include "terrain/base/lru.h"

namespace tind::cli {
namespace {

constexpr std::size_t kKeptBytes = std::size_t(64) << 20;
constexpr std::chrono::milliseconds kLookAgain{50};

/// A question comes to the same tile many times.
class KeptTiles : public TileSet {
 public:
  explicit KeptTiles(Dataset dataset) : dataset_(std::move(dataset)) {}

  Readiness readiness() const override { return dataset_.tiles->readiness(); }
  const proto::LayerJson& layer() const override { return dataset_.tiles->layer(); }
  bool available(TileId id) const override { return dataset_.tiles->available(id); }
  Result<TileBytes> tile(TileId id, std::stop_token stop) const override {
    {
      const std::lock_guard lock(mutex_);
      if (const TileBytes* const kept = kept_.find(id)) return *kept;
    }
    auto made = dataset_.tiles->tile(id, stop);
    if (!made) return made;
    const std::lock_guard lock(mutex_);
    kept_.insert(id, *made, made->bytes.size());
    return made;
  }

 private:
  const Dataset dataset_;
  mutable std::mutex mutex_;
  mutable Lru<TileId, TileBytes> kept_{kKeptBytes};
};

Result<void> wait_until_read(const TileSet& tiles) {
  for (;;) {
    const Readiness now = tiles.readiness();
    if (!now.why.empty()) return fail(Errc::io, now.why);  // whoever asked can try again
    if (now.state == Readiness::State::ready) return {};
    std::this_thread::sleep_for(kLookAgain);
  }
}

}  // namespace

bool names_table(const std::string& location) { return location.ends_with(".toml"); }

Result<std::shared_ptr<const TileSet>> tiles_of_table(
    const std::string& file, const std::string& index_dir,
    std::shared_ptr<const Environment> environment) {
  const auto spec = services::read_dataset_file(file, "tiles");
  if (!spec) return std::unexpected(spec.error());
  auto options = services::dataset_options({}, spec->own);
  if (!options) return fail(file, options.error());
  options->dem.environment = std::move(environment);
  auto dataset = services::open_dataset(*spec, *options, services::index_dir_of(index_dir));
  if (!dataset) return std::unexpected(dataset.error());
  if (!dataset->tiles) return fail(Errc::invalid_argument, file + ": the dataset has no tiles");
  auto kept = std::make_shared<const KeptTiles>(std::move(*dataset));
  if (auto ready = wait_until_read(*kept); !ready) return std::unexpected(ready.error());
  return kept;
}

}  // namespace tind::cli
