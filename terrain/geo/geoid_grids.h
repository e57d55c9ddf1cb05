#pragma once
// Grids of geoids as GeographicLib has them: where they lie, and their heights by its cubic fit.

#include <memory>
#include <string>
#include <vector>

#include "terrain/base/result.h"
#include "terrain/geo/geoid.h"

namespace tind {

/// Where NAME.pgm is looked for: `first`, then where GeographicLib does (GEOGRAPHICLIB_GEOID_PATH,
/// GEOGRAPHICLIB_DATA, its own default), then /usr/share and /usr/local/share.
std::vector<std::string> geoid_folders(const std::string& first);

/// The first of those folders that holds NAME.pgm; empty where none does. io, where that cannot be
/// told of one: another grid has other heights.
Result<std::string> folder_of_geoid(const std::string& name,
                                    const std::vector<std::string>& folders);

/// A grid `name`.pgm in `folder`, read as a whole (two bytes a node: egm2008-1 0.5 GB). Heights by
/// GeographicLib's cubic fit, as GeographicLib's own tools give them. bad_data where it is none.
Result<std::shared_ptr<const Geoid>> cubic_geoid(const std::string& folder,
                                                 const std::string& name);

}  // namespace tind
