#pragma once
// A dataset as tiles: made from a DEM on demand, or read from a store. The same bytes both ways.

#include <cstdint>
#include <memory>
#include <optional>
#include <stop_token>
#include <string>
#include <vector>

#include "proto/layer_json.h"
#include "terrain/base/result.h"
#include "terrain/geo/tiling_scheme.h"
#include "terrain/raster/dem_source.h"

namespace tind {

/// What making a tile took, seconds of one thread. For people only: no byte of a tile depends on
/// it.
struct TileCost {
  double reading = 0, borders = 0, fitting = 0, measuring = 0, encoding = 0;
};

/// One finished tile: quantized-mesh-1.0 with all the extensions that tind makes (octvertexnormals,
/// metadata), not compressed.
struct TileBytes {
  std::vector<std::uint8_t> bytes;
  TileCost cost;
  double max_error_m = 0;
  double edge_error_m = 0;    // how far its border is from the DEM, voids filled, at most
  bool exact = true;          // max_error_m is the maximum over all posts, not only a bound of it
  std::string side = "both";  // above: the mesh is at or above every post; below: at or below
};

/// How far a tile set is that must read its source before it can make tiles.
struct Readiness {
  enum class State { ready, reading, failed } state = State::ready;
  double share = 1;  // read, 0..1
  std::string why;   // it failed
};

/// The posts of a source that are lowest and highest; of several, any.
struct HeightExtremes {
  struct Place {
    Geographic where;
    double height_m = 0;  // in the source's datum()
  };
  Place lowest, highest;
};

class TileSet {
 public:
  virtual ~TileSet() = default;
  virtual Readiness readiness() const { return {}; }
  virtual const proto::LayerJson& layer() const = 0;
  virtual bool available(TileId) const = 0;
  /// Blocking and CPU-heavy for a DEM: call it on a worker. Thread-safe. not_found outside
  /// availability; any other error is the source's and must not be cached.
  virtual Result<TileBytes> tile(TileId, std::stop_token) const = 0;
  /// The DEM behind it; null for a store.
  virtual const DemSource* dem() const = 0;
  /// Of the DEM; nothing for a store, until the DEM has been read, and where that failed.
  virtual std::optional<HeightExtremes> extremes() const { return {}; }
};

struct TileSetOptions {
  double max_error_m = 0;   // at the leaves; 0: 1/32 of the post spacing
  double error_factor = 1;  // budget of level z: level_error(z) * factor
  int max_level = -1;  // where the pyramid ends; -1: the first level at least as fine as the source
  int first_level =
      0;  // levels that are made and offered of it: no byte of a tile depends on which
  int last_level = -1;        // -1: down to the end
  std::string side = "both";  // both | above | below: where the mesh lies as seen from the posts
  std::string effort = "normal";
  /// Tiles of more posts than this are certified through the residual index; 0: as residual_index.h
  /// says.
  std::int64_t exact_posts = 0;
};

/// Posts that opening a DEM as tiles reads before it returns: a second or so.
inline constexpr std::int64_t kMostReadAtOnce = std::int64_t(1) << 25;

/// The tiles of a DEM, made when asked for. Fails with `unsupported` for a DEM without CRS. Tiles
/// need the range of all heights, and those of a large source its residual index (plan_source.h):
/// of a source with more than `read_at_once` posts they are found in the background, on one thread,
/// and until then every tile is Errc::busy. The index is kept at `index_path`, or with the tiles
/// where that is empty.
Result<std::unique_ptr<TileSet>> open_dem_tiles(std::shared_ptr<const DemSource>,
                                                const TileSetOptions&,
                                                std::int64_t read_at_once = kMostReadAtOnce,
                                                const std::string& index_path = {});

/// The tiles of a directory made by `tind build` (or anyone): layer.json and z/x/y.terrain.
Result<std::unique_ptr<TileSet>> open_stored_tiles(const std::string& directory);

}  // namespace tind
