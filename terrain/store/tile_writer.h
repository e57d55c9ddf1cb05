#pragma once
// How a build writes a store: the contract of every kind of store that can be written. The build
// says which tiles there are and what is in them; the store knows where they lie, which of them are
// finished, and how what is finished stays.
//
// Killed at any moment, or without power from any moment on, the next lock_store(), claim() and the
// rest end the same. What the store did not make is neither changed nor removed.

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "proto/tile/layer_json.h"
#include "terrain/base/progress.h"
#include "terrain/base/result.h"
#include "terrain/geo/tile_order.h"
#include "terrain/store/build_record.h"
#include "terrain/store/tile_store.h"

namespace tind {

/// What is kept of the heights for the next update: hashes of blocks (raster/source_blocks.h).
struct KeptBlocks {
  std::string digest;                   // 32 digits that stand for all of them
  std::function<std::string()> encode;  // the bytes of the file; none: there are no blocks
};

/// What a build is going to write.
struct TileWork {
  /// One flag for each of `ids`: does the tile depend on heights that changed since the tiles of
  /// `old` were made? `old_blocks`: what KeptBlocks::encode() gave then. Fails where that cannot
  /// be told.
  using Changes = std::function<Result<std::vector<std::uint8_t>>(const BuildRecord& old,
                                                                  std::string_view old_blocks)>;

  const TileOrder& ids;                               // must outlive the writer
  std::vector<std::vector<proto::TileRange>> levels;  // the same tiles, as layer.json has them
  BuildRecord record;
  KeptBlocks blocks;
  Changes changes;
  bool force = false;  // replace tiles of another source or of other options
  int threads = 0;     // to look at what is there; 0: one per core
  int batch = 1024;    // tiles, at most, until those written are made durable and count
};

/// Tiles are given by their number in TileWork::ids.
class TileWriter {
 public:
  virtual ~TileWriter() = default;

  /// Tiles that an earlier run left and that are not as they were written, or not known to be
  /// finished.
  virtual std::uint64_t unsound() const = 0;
  /// What is known of tile k, where it is there as this build would make it.
  virtual std::optional<TileFacts> finished(std::size_t k) const = 0;
  /// Whoever looks sees the whole tile or none. For many threads. Every so many tiles or seconds,
  /// one of them makes durable what was written. `facts` takes its size.
  virtual Result<void> write(std::size_t k, std::string_view bytes, TileFacts facts) = 0;
  /// What was written until now is finished, come what may.
  virtual Result<void> commit() = 0;
  /// REQUIRES: every tile is finished. From now on the tiles are those of this build.
  virtual Result<void> finish(std::string_view layer_json) = 0;

  /// A file of this machine's for the residual index of the source, which is kept beside the tiles
  /// and serves the next build, too. Empty: the store keeps none.
  virtual std::string index_path() const { return {}; }
};

/// A store that nobody else writes to as long as this is there.
class LockedStore {
 public:
  virtual ~LockedStore() = default;

  /// Makes the store ours for this work; at most once. What is there:
  /// - nothing, or tiles of the same: those stay that are as they were written
  /// - tiles that can become these (may_update()): an update. Only tiles that `changes` flags are
  ///   made again, and take the old ones' places when all are ready; those that are not of this
  ///   work go then
  /// - other tiles of a build: refused, or with `force` removed
  /// - anything else where our tiles belong: refused
  virtual Result<std::unique_ptr<TileWriter>> claim(const TileWork&, const Progress& = {}) = 0;
};

}  // namespace tind
