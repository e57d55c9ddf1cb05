#pragma once
// A TIN where a DEM is asked for: --posts.

#include <memory>
#include <string>
#include <vector>

#include "server/cli/options/dem_input.h"
#include "server/cli/program/command_line.h"
#include "terrain/analysis/tin_ground.h"
#include "terrain/base/result.h"
#include "terrain/raster/dem_source.h"

namespace tind::cli {

/// --posts: the subcommand takes a TIN in place of its DEM.
void add_tin_options(Command, DemInput&);

/// "a DEM, or several that share one grid; or a TIN, with --posts: .ply, ..."
std::string dem_or_tin_help();

/// The TIN's heights on a grid of posts (mesh/tin_posts.h), where and above what its file or the
/// options say; how many posts and how far off is said on stderr. Fails with its name where it is
/// no terrain, where --posts is missing, and for options that are said of rasters. REQUIRES:
/// is_mesh() of the first file.
Result<OpenedDem> open_tin(const DemInput&);

/// A TIN that is asked itself, without posts: a mesh without --posts.
bool asks_tin_itself(const DemInput&);
/// Fails as open_tin() does; and for --bounds and --to-datum, which are for posts.
Result<TinGround> open_tin_ground(const DemInput&);

/// Two that are opened alike; --posts counts for those that are TINs, --bounds for the first.
struct TwoDems {
  DemInput first, other;
};
TwoDems two_dems(const DemInput& first, const std::vector<std::string>& other);

}  // namespace tind::cli
