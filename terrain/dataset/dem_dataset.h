#pragma once
// A DEM, and its tiles made when they are asked for.

#include <cstdint>
#include <memory>
#include <string>

#include "terrain/base/result.h"
#include "terrain/dataset/dataset.h"
#include "terrain/pyramid/make/dem_tiles.h"
#include "terrain/pyramid/plan/tile_set_options.h"
#include "terrain/surface/surface.h"

namespace tind {

/// Fails where open_dem_tiles() does, which says what is read before this returns. The residual
/// index of a source that needs one is kept in `index_dir`, under the source's fingerprint; with
/// the tiles where that is empty. Errc::io where the folder cannot be made.
Result<Dataset> dem_dataset(const Surface&, const TileSetOptions&,
                            const std::string& index_dir = {},
                            std::int64_t read_at_once = kMostReadAtOnce);

}  // namespace tind
