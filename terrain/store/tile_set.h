#pragma once
// Tiles, wherever they come from: made from a DEM on demand, or read from a store. The same bytes
// both ways.

#include <cstdint>
#include <optional>
#include <stop_token>
#include <string>
#include <vector>

#include "proto/tile/layer_json.h"
#include "terrain/base/result.h"
#include "terrain/geo/tiling_scheme.h"
#include "terrain/mesh/side.h"

namespace tind {

/// What making a tile took, seconds of one thread, and who made it. For people only: no byte of a
/// tile depends on it.
struct TileCost {
  double reading = 0, borders = 0, fitting = 0, measuring = 0, encoding = 0;
  bool by_bounded = false;     // instead of another method, which could not keep the budget
  bool without_lines = false;  // of the dataset, with which the tile was far over its budget
};

/// One finished tile: quantized-mesh-1.0 with all the extensions that tind makes (octvertexnormals,
/// metadata, and watermask where there is water), not compressed.
struct TileBytes {
  std::vector<std::uint8_t> bytes;
  TileCost cost;
  double max_error_m = 0;
  double edge_error_m = 0;  // how far its border is from the DEM, voids filled, at most
  bool exact = true;        // max_error_m is the maximum over all posts, not only a bound of it
  Side side = Side::both;
  std::uint64_t posts = 0;  // valid ones in the closed rectangle, of a tile just made
};

/// How far a tile set is that must read its source before it can make all of its tiles.
struct Readiness {
  enum class State { ready, reading, failed } state = State::ready;
  double share = 1;  // read, 0..1
  std::string why;   // it failed; while reading: it failed before, and is tried again
  std::optional<double> seconds_left = {};  // of reading, by what it took so far
  std::optional<double> again_in_s = {};    // it rests until then, having failed
};

class TileSet {
 public:
  virtual ~TileSet() = default;
  virtual Readiness readiness() const { return {}; }
  virtual const proto::LayerJson& layer() const = 0;
  virtual bool available(TileId) const = 0;
  /// Blocking and CPU-heavy for a DEM: call it on a worker. Thread-safe. not_found outside
  /// availability, busy for one that cannot be made yet (Readiness); any other error is the
  /// source's and must not be cached.
  virtual Result<TileBytes> tile(TileId, std::stop_token) const = 0;
  /// Is a tile waited for, as an answer of another machine, rather than made?
  virtual bool fetched() const { return false; }
};

}  // namespace tind
