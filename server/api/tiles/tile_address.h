#pragma once
// The address of a tile as a client writes it.

#include <optional>
#include <string_view>

#include "terrain/geo/tiling_scheme.h"
#include "terrain/geo/web_mercator.h"

namespace tind::api {

/// Digits only, no sign, no leading zero, so that each tile has one address; nothing outside
/// the pyramid.
std::optional<TileId> tile_address(std::string_view z, std::string_view x, std::string_view y);

/// The same of a tile of 3D Tiles (terrain/tiles3d/tileset.h), below "west" or "east".
std::optional<TileId> tile3d_address(std::string_view hemisphere, std::string_view z,
                                     std::string_view x, std::string_view y);

/// The same of a web map's tile, whose rows are counted from the north.
std::optional<web_mercator::Tile> web_tile_address(std::string_view z, std::string_view x,
                                                   std::string_view y);

}  // namespace tind::api
