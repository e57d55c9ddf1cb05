#pragma once
// The directory of a batch build. It remembers how its tiles were made and which are finished, so
// that a build that was killed goes on, and one whose source changed makes again what changed, and
// nothing else.

#include <atomic>
#include <chrono>
#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "terrain/base/progress.h"
#include "terrain/base/result.h"
#include "terrain/geo/tile_order.h"
#include "terrain/pyramid/build/build.h"
#include "terrain/raster/dem_source.h"
#include "terrain/raster/source_blocks.h"
#include "terrain/store/folder_files.h"
#include "terrain/store/folder_lock.h"
#include "terrain/store/tile_ledger.h"

namespace tind {

/// Four kinds of files: the tiles and layer.json; a record of the grid, the options and the
/// content; hashes of the content's blocks; and the ledger of finished tiles. A first build writes
/// tiles where they belong, and layer.json last. An update writes the tiles that depend on heights
/// that changed aside, into tind-update/, and moves them in when all are there: until then the old
/// pyramid can be served.
///
/// Killed at any moment, or without power from any moment on, the next claim() and the rest end the
/// same. What is not ours is neither changed nor removed.
class BuildFolder {
 public:
  /// Makes the directory ours for these options and this content of the source. What is there:
  /// - nothing, or tiles of the same: those stay that are as the ledger says
  /// - tiles of the same grid and options but of other heights: an update
  /// - other tiles that tind build made: refused, or with `force` removed
  /// - anything else where our files belong: refused
  /// `ids` and `files` must outlive this.
  static Result<std::unique_ptr<BuildFolder>> claim(FolderFiles& files, FolderLock,
                                                    const DemSource&, const TilePlan&,
                                                    const TileOrder& ids, const SourceBlocks&,
                                                    const BuildOptions&, const Progress& = {});
  ~BuildFolder();

  const UpdateReport& update() const { return update_; }
  /// Tiles that an earlier run left and that are not as the ledger says, or not in it.
  std::uint64_t unsound() const { return unsound_; }

  /// What is known of tile k, where it is there as this build would make it.
  std::optional<LedgerEntry> finished(std::size_t k) const;
  /// Aside, then renamed: whoever looks sees the whole tile or none. For many threads. Every
  /// so many tiles or seconds, one of them makes durable what was written. `known` takes size
  /// and hash.
  Result<void> write(std::size_t k, std::string_view bytes, LedgerEntry known);
  /// What was written until now is finished, come what may.
  Result<void> commit();
  /// REQUIRES: every tile is finished.
  Result<void> finish(std::string_view layer_json);

 private:
  BuildFolder(FolderFiles& files, FolderLock lock, const TileOrder& ids, const BuildOptions& o)
      : files_(files), lock_(std::move(lock)), ids_(ids), options_(o), output_(o.output) {}

  FolderFiles& files_;
  FolderLock lock_;
  const TileOrder& ids_;
  const BuildOptions& options_;
  const std::string output_;
  UpdateReport update_;
  std::optional<TileLedger> ledger_;  // of the tiles in their places
  std::optional<TileLedger> aside_;   // of an update; names all tiles
  std::vector<std::uint8_t> dirty_;   // by tile: is made aside. Empty: no update
  std::vector<std::uint8_t> sound_;   // by tile: is there as the ledger says. Empty: none
  std::uint64_t unsound_ = 0;
  bool claimed_ = false;

  std::mutex mutex_;  // of what follows
  std::vector<LedgerEntry> pending_;
  std::chrono::steady_clock::time_point last_commit_ = std::chrono::steady_clock::now();
  bool committing_ = false;
  std::atomic<std::uint64_t> next_partial_ = 0;

  bool is_aside(std::size_t k) const { return !dirty_.empty() && dirty_[k]; }
  std::string path(std::size_t k) const;
  Result<void> put(const std::string& path, std::string_view bytes);
  Result<void> put_record(const std::string& folder, const std::string& record, const SourceBlocks&,
                          const TilePlan&, std::optional<TileLedger>&);
  Result<void> mend_blocks(const std::string& folder, const SourceBlocks&);
  Result<void> start(const std::string& record, const SourceBlocks&, const TilePlan&);
  Result<void> start_update(const std::string& record, const SourceBlocks&, const TilePlan&,
                            const Progress&);
  Result<void> make_folders();
  std::vector<std::uint8_t> look_at_tiles(bool aside, const Progress&);
  Result<void> enter(std::vector<LedgerEntry>);
};

}  // namespace tind
