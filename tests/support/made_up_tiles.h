#pragma once
// A tile set without a DEM: every tile is a small square with all extensions, made in no time, or
// as slowly and as wrongly as a test wants.

#include <atomic>
#include <functional>
#include <optional>

#include "terrain/pyramid/tileset.h"

namespace tind::test {

class MadeUpTiles : public TileSet {
 public:
  /// All tiles of levels 0..max_level.
  explicit MadeUpTiles(int max_level = 4);

  const proto::LayerJson& layer() const override { return layer_; }
  bool available(TileId id) const override;
  Result<TileBytes> tile(TileId, std::stop_token) const override;
  const DemSource* dem() const override { return nullptr; }

  /// Called in every tile(); what it returns, if anything, is the tile's error.
  std::function<std::optional<Error>(TileId)> before;
  mutable std::atomic<int> built{0};

 private:
  proto::LayerJson layer_;
};

}  // namespace tind::test
