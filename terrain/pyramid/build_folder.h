#pragma once
// The directory of a batch build. It remembers how its tiles were made, so that a build that was
// killed goes on, and one whose source changed makes again what changed, and nothing else.

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "terrain/pyramid/build.h"
#include "terrain/pyramid/source_blocks.h"
#include "terrain/pyramid/tile_order.h"

namespace tind {

/// Three kinds of files: the tiles and layer.json; a record of the grid, the options and the
/// content; and hashes of the content's blocks. A first build writes tiles where they belong, and
/// layer.json last. An update writes the tiles that depend on heights that changed aside, into
/// tind-update/, and moves them in when all are there: until then the old pyramid can be served.
///
/// Killed at any moment, the next claim() and the rest end the same.
class BuildFolder {
 public:
  /// Makes the directory ours for these options and this content of the source. What is there:
  /// - nothing, or tiles of the same: they stay
  /// - tiles of the same grid and options but of other heights: an update
  /// - anything else is refused, or with `force` removed.
  /// `ids` must outlive this.
  static Result<BuildFolder> claim(const DemSource&, const TilePlan&, const TileOrder& ids,
                                   const SourceBlocks&, const BuildOptions&);

  const UpdateReport& update() const { return update_; }

  /// The size of tile k, where it is there as this build would make it.
  std::optional<std::size_t> finished(std::size_t k) const;
  /// Aside, then renamed: whoever looks sees the whole tile or none. For many threads.
  Result<void> write(std::size_t k, std::string_view bytes) const;
  /// REQUIRES: every tile is finished.
  Result<void> finish(std::string_view layer_json) const;

 private:
  explicit BuildFolder(const TileOrder& ids) : ids_(ids) {}

  const TileOrder& ids_;
  std::string output_;
  UpdateReport update_;
  std::vector<std::uint8_t> dirty_;  // by tile; empty: no update

  bool is_aside(std::size_t k) const { return !dirty_.empty() && dirty_[k]; }
  std::string path(std::size_t k) const;
  Result<void> make_folders() const;
};

}  // namespace tind
