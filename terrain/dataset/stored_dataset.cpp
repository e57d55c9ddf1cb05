#include "terrain/dataset/stored_dataset.h"

#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <utility>

#include "terrain/raster/file_state.h"
#include "terrain/raster/remote/objects.h"
#include "terrain/store/open/open_store.h"
#include "terrain/store/open/stored_tiles.h"

namespace tind {
namespace {

constexpr std::chrono::seconds kPauseOfRemote{15};

std::optional<Dataset> other_than(std::uint64_t generation, const std::string& location) {
  const auto now = stored_generation(location);
  if (!now || *now == generation) return {};
  auto opened = stored_dataset(location);
  // A folder that changes while it is opened is opened when it has come to rest.
  if (!opened || stored_generation(location) != now) return {};
  return std::move(*opened);
}

/// Whether so long has passed since the last time. For one thread at a time.
class Rarely {
 public:
  bool due() {
    const auto now = std::chrono::steady_clock::now();
    if (now - last_ < kPauseOfRemote) return false;
    last_ = now;
    return true;
  }

 private:
  std::chrono::steady_clock::time_point last_ = std::chrono::steady_clock::now();
};

/// Of another machine: what it was is asked for with every read, so that looks are rare.
Result<Dataset> remote_dataset(const std::string& location) {
  const auto generation = stored_generation(location);
  auto tiles = open_stored_tiles(location);
  if (!tiles) return std::unexpected(tiles.error());
  Dataset made = dataset_of(std::shared_ptr<const TileSet>(std::move(*tiles)));
  if (generation)
    made.renewed = [generation = *generation, location,
                    rarely = std::make_shared<Rarely>()]() -> std::optional<Dataset> {
      if (!rarely->due()) return {};
      return other_than(generation, location);
    };
  return made;
}

}  // namespace

Result<Dataset> stored_dataset(const std::string& location) {
  if (remote::is_remote(location)) return remote_dataset(location);
  // Before it is opened: what comes in between is seen by the next look.
  const auto generation = stored_generation(location);
  const std::string head = names_archive(location) ? location : location + "/layer.json";
  const auto state = file_state(head);
  auto tiles = open_stored_tiles(location);
  if (!tiles) return std::unexpected(tiles.error());
  Dataset made = dataset_of(std::shared_ptr<const TileSet>(std::move(*tiles)));
  if (generation)
    made.renewed = [generation = *generation, location] {
      return other_than(generation, location);
    };
  if (generation)
    made.unchanged = [location]() -> Result<void> {
      if (stored_generation(location)) return {};
      return fail(Errc::io,
                  location + ": is no longer there, cannot be read, or its ledger is damaged");
    };
  else if (state)
    made.unchanged = [head, state = *state]() -> Result<void> {
      const auto now = file_state(head);
      if (!now) return std::unexpected(now.error());
      if (now->same_content(state)) return {};
      return fail(Errc::io, head + ": is another than when it was opened");
    };
  return made;
}

}  // namespace tind
