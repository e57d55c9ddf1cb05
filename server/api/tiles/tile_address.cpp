#include "server/api/tiles/tile_address.h"

#include <charconv>

#include "terrain/tiles3d/tileset.h"

namespace tind::api {
namespace {

std::int64_t number(std::string_view text) {
  std::int64_t value = -1;
  if (text.empty() || text.size() > 10 || (text[0] == '0' && text.size() > 1)) return -1;
  if (text[0] == '-') return -1;  // which from_chars takes, and "-0" is 0
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  return error == std::errc() && end == text.data() + text.size() ? value : -1;
}

}  // namespace

std::optional<TileId> tile_address(std::string_view z, std::string_view x, std::string_view y) {
  return tiling::tile(number(z), number(x), number(y));
}

std::optional<TileId> tile3d_address(std::string_view hemisphere, std::string_view z,
                                     std::string_view x, std::string_view y) {
  return tiles3d::tile_at(hemisphere, number(z), number(x), number(y));
}

std::optional<web_mercator::Tile> web_tile_address(std::string_view z, std::string_view x,
                                                   std::string_view y) {
  return web_mercator::tile(number(z), number(x), number(y));
}

}  // namespace tind::api
