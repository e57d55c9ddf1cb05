#include "terrain/dataset/stored_dataset.h"

#include <cstdint>
#include <optional>
#include <utility>

#include "terrain/raster/file_state.h"
#include "terrain/store/open/open_store.h"
#include "terrain/store/open/stored_tiles.h"

namespace tind {
namespace {

std::optional<Dataset> other_than(std::uint64_t generation, const std::string& location) {
  const auto now = stored_generation(location);
  if (!now || *now == generation) return {};
  auto opened = stored_dataset(location);
  // A folder that changes while it is opened is opened when it has come to rest.
  if (!opened || stored_generation(location) != now) return {};
  return std::move(*opened);
}

}  // namespace

Result<Dataset> stored_dataset(const std::string& location) {
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
      return fail(Errc::io, location + ": its ledger is no longer there, or damaged");
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
