#pragma once
// Tiles that nobody has built yet: those that a daemon makes of a dataset, by the table that says
// what it is made of.

#include <memory>
#include <string>

#include "terrain/base/result.h"
#include "terrain/geo/environment.h"
#include "terrain/store/tile_set.h"

namespace tind::cli {

/// NAME.toml, as lies in a daemon's catalog?
bool names_table(const std::string& location);

/// Its tiles, each made when it is first asked for; the last of them are kept. Waits where the DEM
/// must be read first; what is found then is kept in `index_dir`, or where a daemon has it by
/// default if that is empty. Fails where the file is no table of a dataset, where its files cannot
/// be opened, and where that reading fails.
Result<std::shared_ptr<const TileSet>> tiles_of_table(const std::string& file,
                                                      const std::string& index_dir,
                                                      std::shared_ptr<const Environment>);

}  // namespace tind::cli
