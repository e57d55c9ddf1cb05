#include "terrain/store/taken_away.h"

#include <cstdint>

#include "terrain/store/layer_place.h"

namespace tind {
namespace {

std::uint64_t common(const TileArea& a, const TileArea& b) {
  std::uint64_t count = 0;
  for (const TileRange& range : b.ranges())
    for (const TileRange& part : a.within(range)) count += part.size();
  return count;
}

}  // namespace

Result<void> most_stay(const std::string& store, const AvailableTiles& there,
                       const AvailableTiles& wanted) {
  std::uint64_t all = 0, kept = 0;
  for (std::size_t level = 0; level < there.size(); ++level) {
    const TileArea before = area_of(there[level]);
    all += before.size();
    if (level < wanted.size()) kept += common(before, area_of(wanted[level]));
  }
  if (2 * kept >= all) return {};
  return fail(Errc::invalid_argument,
              store + ": " + std::to_string(all - kept) + " of its " + std::to_string(all) +
                  " tiles would be taken away, for there is nothing any more where they lie: name "
                  "all files, or --force where that is meant");
}

}  // namespace tind
