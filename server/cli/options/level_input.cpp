#include "server/cli/options/level_input.h"

#include <fmt/format.h>

#include <utility>

#include "server/cli/options/mesh_input.h"
#include "server/cli/options/table_tiles.h"
#include "server/cli/program/exit.h"
#include "terrain/raster/datums.h"
#include "terrain/store/open/stored_tiles.h"

namespace tind::cli {

void add_level_options(Command app, LevelInput& input) {
  const Option tiles = app.add_option("--tiles", input.tiles,
                                      "ask what clients of these tiles see, in place of the DEM: a "
                                      "directory made by tind build, a URL, or a daemon's table of "
                                      "a dataset (NAME.toml), whose tiles are made here");
  app.add_option("--level", input.level, "... of this level")
      .range(0, tiling::kMaxLevel)
      .needs(tiles);
  app.add_option("--index-dir", input.index_dir,
                 "where the index of a table's DEM is kept, if that is a large one")
      .needs(tiles);
  input.environment = app.environment();
}

Result<std::shared_ptr<const TileSet>> open_level_tiles(const LevelInput& input) {
  if (input.level < 0)
    return fail(Errc::invalid_argument, "--tiles needs a --level: what is seen depends on it");
  if (names_table(input.tiles))
    return tiles_of_table(input.tiles, input.index_dir, input.environment);
  auto tiles = open_stored_tiles(input.tiles);
  if (!tiles) return std::unexpected(tiles.error());
  return std::shared_ptr<const TileSet>(std::move(*tiles));
}

VerticalDatum datum_of(const TileSet& tiles) {
  return datum_named(tiles.layer().datum).value_or(VerticalDatum());
}

Result<AskedDem> open_asked(const DemInput& input, const LevelInput& level) {
  const bool tin = !input.files.empty() && is_mesh(input.files[0]);
  if (tin && !level.tiles.empty())
    return fail(
        Errc::invalid_argument,
        "--tiles takes the DEM that they were made of, whose posts their error is of, and " +
            input.files[0] + " is a mesh");
  auto opened = open_dem_or_tin(input);
  if (!opened) return std::unexpected(opened.error());
  auto& dem = opened->dem;
  if (level.tiles.empty())
    return AskedDem{std::move(dem), nullptr, nullptr, tin, opened->tin_error_m};
  const auto tiles = open_level_tiles(level);
  if (!tiles) return std::unexpected(tiles.error());
  const VerticalDatum theirs = datum_of(**tiles);
  const bool known = theirs != VerticalDatum::unknown;
  if (known && input.to_datum_given && dem->info().datum != theirs)
    return fail(Errc::invalid_argument,
                "heights of --tiles are above " + name(theirs) +
                    ": ask for them, or leave --to-datum out and convert the answer");
  if (known && dem->info().datum != theirs && dem->info().datum != VerticalDatum::unknown)
    warn(fmt::format("heights are those of the tiles, above {}, not above {} as the DEM's",
                     name(theirs), name(dem->info().datum)));
  auto seen = std::make_shared<const LevelDem>(std::move(dem), level_tiles_of(**tiles), level.level,
                                               theirs);
  return AskedDem{seen, *tiles, seen, false, 0};
}

}  // namespace tind::cli
