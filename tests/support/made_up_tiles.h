#pragma once
// A tile set without a DEM: every tile is a small square with all extensions, made in no time, or
// as slowly and as wrongly as a test wants.

#include <atomic>
#include <functional>
#include <future>
#include <optional>

#include "terrain/base/result.h"
#include "terrain/store/tile_set.h"

namespace tind::test {

class MadeUpTiles : public TileSet {
 public:
  /// All tiles of levels 0..max_level.
  explicit MadeUpTiles(int max_level = 4);

  const proto::LayerJson& layer() const override { return layer_; }
  bool available(TileId id) const override;
  Result<TileBytes> tile(TileId, std::stop_token) const override;

  /// Called in every tile(); what it returns, if anything, is the tile's error.
  std::function<std::optional<Error>(TileId)> before;
  mutable std::atomic<int> built{0};

 private:
  proto::LayerJson layer_;
};

/// Holds every tile back until it is opened; `then` is what comes instead of the tile.
class Gate {
 public:
  explicit Gate(MadeUpTiles& tiles, std::optional<Error> then = {}) {
    tiles.before = [opened = opened_.get_future().share(), then](TileId) {
      opened.wait();
      return then;
    };
  }
  void open() { opened_.set_value(); }

 private:
  std::promise<void> opened_;
};

}  // namespace tind::test
