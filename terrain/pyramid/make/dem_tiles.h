#pragma once
// The tiles of a DEM as a tile set.

#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "terrain/base/result.h"
#include "terrain/pyramid/plan/height_extremes.h"
#include "terrain/pyramid/plan/tile_set_options.h"
#include "terrain/store/tile_set.h"
#include "terrain/surface/surface.h"

namespace tind {

class DemTiles : public TileSet {
 public:
  /// Of the source; nothing until it has been read, and where that failed. Thread-safe.
  virtual std::optional<HeightExtremes> extremes() const = 0;
};

/// Posts that opening a DEM as tiles reads before it returns: a second or so.
inline constexpr std::int64_t kMostReadAtOnce = std::int64_t(1) << 25;

/// The tiles of a DEM, made when asked for. Fails with `unsupported` for a DEM without CRS. Some
/// tiles rest on the range of all heights or on the residual index (TilePlan::rests_on_all_heights,
/// plan_source.h): of a source with more than `read_at_once` posts both are found in the
/// background, on all cores that have nothing else to do. Until then those tiles are Errc::busy; so
/// are tiles without a post until one with a post was made, because a DEM without any has no tiles.
/// All others are there at once. The index is kept at `index_path`, or with the tiles where that is
/// empty.
Result<std::unique_ptr<DemTiles>> open_dem_tiles(const Surface&, const TileSetOptions&,
                                                 std::int64_t read_at_once = kMostReadAtOnce,
                                                 const std::string& index_path = {});

}  // namespace tind
