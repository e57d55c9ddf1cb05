#pragma once
// layer.json: what a quantized-mesh tile set says of itself (TileJSON 2.1 dialect of
// globe clients).

#include <array>
#include <cstdint>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "terrain/base/result.h"

namespace tind::proto {

/// Inclusive ranges of tile columns and rows, TMS.
struct TileRange {
  std::uint32_t start_x = 0, start_y = 0, end_x = 0, end_y = 0;
  friend bool operator==(const TileRange&, const TileRange&) = default;
};

/// How good the heights are said to be by who made them.
struct StatedAccuracy {
  std::string layer;  // of the surface; empty: it has only one
  std::string kind;   // le90, le95, rmse, unspecified
  double metres = 0;
  friend bool operator==(const StatedAccuracy&, const StatedAccuracy&) = default;
};

/// As JSON has it everywhere: [{"layer": "town", "kind": "rmse", "m": 0.3}], without `layer` where
/// that is empty.
nlohmann::ordered_json accuracy_json(const std::vector<StatedAccuracy>&);

struct LayerJson {
  std::string name, description, attribution;
  std::string version = "1.0.0";
  std::string format = "quantized-mesh-1.0";
  std::string scheme = "tms";
  std::string projection = "EPSG:4326";
  std::vector<std::string> tiles = {"{z}/{x}/{y}.terrain?v={version}"};
  std::array<double, 4> bounds = {-180, -90, 180, 90};  // west, south, east, north, degrees
  int minzoom = 0, maxzoom = 0;
  std::vector<std::vector<TileRange>> available;  // by absolute level from 0
  std::vector<std::string> extensions;            // e.g. octvertexnormals, metadata
  // 0, or n: tiles of every n-th level say in their metadata which descendants exist, n
  // levels down. CesiumJS reads `available` where this is absent, but cannot then take tiles
  // with metadata.
  int metadata_availability = 0;
  // tind's own: above or below where every tile lies on that side of its posts; not written
  // for both.
  std::string side = "both";
  // tind's own: what the heights are above: ellipsoid, egm96 or unknown; not written where empty.
  std::string datum;
  // tind's own: of those layers that say it; not written where none does.
  std::vector<StatedAccuracy> accuracy;

  bool contains(int z, std::uint32_t x, std::uint32_t y) const;
};

/// Every field, deterministic order and digits.
std::string encode_layer_json(const LayerJson&);

/// Accepts what other makers write (missing optional fields); bad_data when it is not a layer.json
/// of quantized-mesh tiles.
Result<LayerJson> decode_layer_json(std::string_view text);

}  // namespace tind::proto
