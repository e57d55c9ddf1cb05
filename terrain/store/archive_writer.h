#pragma once
// How a file that holds a whole tile set is written: the contract of every kind of archive. Tiles
// come in the archive's own order, packed; nothing lies under the file's name until all are there.

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "proto/tile/layer_json.h"
#include "terrain/base/result.h"
#include "terrain/store/tile_store.h"

namespace tind {

/// What an archive holds beside its tiles.
struct ArchiveHead {
  proto::LayerJson layer;
  std::string layer_text, record_text;  // as they are given back; no record: empty
  std::string blocks;                   // KeptBlocks::encode(); empty: none are kept

  /// Stands for layer and record, to which the tiles' entries belong.
  std::uint64_t seed() const;
};

class ArchiveWriter {
 public:
  virtual ~ArchiveWriter() = default;

  /// Sorts tiles as add() wants them.
  virtual void put_in_order(std::vector<TileId>&) const = 0;
  /// `packed`: gzip data. `facts` takes its size.
  virtual Result<void> add(TileId, const std::vector<std::uint8_t>& packed, TileFacts facts) = 0;
  /// The file has its name now, in place of what had it.
  virtual Result<void> finish() = 0;
};

}  // namespace tind
