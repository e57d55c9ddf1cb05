#pragma once
// TileJSON 3.0.0 (Mapbox): how clients of web maps learn where tiles are and what is in them.

#include <array>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "proto/tile/layer_json.h"
#include "terrain/base/result.h"

namespace tind::proto {

/// Rows count from the north.
struct TileJson {
  std::string name, tiles;  // `tiles`: a URL with {z}, {x} and {y}
  int minzoom = 0, maxzoom = 0;
  std::array<double, 4> bounds{};                    // west, south, east, north
  std::optional<std::array<double, 2>> center = {};  // where the data is; none: the bounds' middle
  int tile_size = 512;
  std::string encoding;  // of heights, "mapbox" or "terrarium"; empty: pictures
  std::string format = "png";
  std::string attribution;
  std::vector<StatedAccuracy> accuracy = {};  // tind's own, as in layer.json
  /// Beyond the standard: words and numbers.
  std::vector<std::pair<std::string, std::string>> words;
  std::vector<std::pair<std::string, double>> numbers;
};

/// One line. What is empty is left out.
std::string encode_tile_json(const TileJson&);

/// Back from what that wrote: what decides the tiles' bytes (tile_size, encoding, format, words,
/// numbers) and which there are (minzoom, maxzoom, bounds; where these are damaged, none), and no
/// more. bad_data for what is no object.
Result<TileJson> decode_tile_json(std::string_view);

}  // namespace tind::proto
