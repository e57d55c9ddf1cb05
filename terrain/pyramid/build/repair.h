#pragma once
// What is broken in a store is made again from its source, by what the store's record says of how
// it was made.

#include <cstdint>
#include <string>

#include "terrain/base/progress.h"
#include "terrain/base/result.h"
#include "terrain/pyramid/plan/tile_set_options.h"
#include "terrain/store/build_record.h"
#include "terrain/surface/surface.h"

namespace tind {

/// bad_data for a record that says what no option can be.
Result<TileSetOptions> tile_options_of(const BuildRecord&);

struct RepairReport {
  std::uint64_t tiles = 0, made = 0;
};

/// Makes the tiles that are not there as they were written, and what the store keeps beside them;
/// the others stay. A directory is mended tile by tile, an archive is written anew and takes the
/// old one's place. The result is what was there before it broke, byte for byte. Fails
/// (invalid_argument), with nothing changed, unless the surface is what the tiles were made of: its
/// files, lines and water, and the options with which they were read and layers were joined, of
/// which the record has only enough to name those that are missing. Fails (bad_data) where there is
/// no record. What tind did not make is not touched.
Result<RepairReport> repair_tiles(const Surface&, const std::string& location, int threads = 0,
                                  const Progress& = {});

}  // namespace tind
