#pragma once
// The residual index of a source: one file beside the store, made in one pass over all posts. With
// it a tile of any number of posts is fitted and certified from 257 x 257 heights.
// (design: "Certifying"; the file: docs/formats.md)

#include <cstdint>
#include <map>
#include <memory>
#include <string>

#include "terrain/base/progress.h"
#include "terrain/base/result.h"
#include "terrain/pyramid/residual/residual_record.h"
#include "terrain/surface/surface.h"

namespace tind {

/// Tiles of so many posts are certified post by post; of a source with no more than the second
/// number, all are.
inline constexpr std::int64_t kExactTilePosts = 10'000'000;
inline constexpr std::int64_t kExactSourcePosts = std::int64_t(1) << 25;

/// The deepest level whose tiles rest on the index, -1 when none does. Depends on the source's
/// facts alone. `exact_posts` > 0: instead of both numbers above. The index itself is made one
/// level deeper: its residuals at a tile's own level would take too much of the tile's budget.
int deepest_indexed_level(const DemInfo&, std::int64_t exact_posts = 0);
/// Surfaces of several layers have no index: every tile reads its posts.
int deepest_indexed_level(const Surface&, std::int64_t exact_posts = 0);

/// A finished index, open for reading. Thread-safe.
class ResidualIndex {
 public:
  ~ResidualIndex();
  ResidualIndex(const ResidualIndex&) = delete;
  ResidualIndex& operator=(const ResidualIndex&) = delete;

  /// Opens the file and reads it through. Fails with not_found; with bad_data for one that is
  /// damaged, unfinished, of another version, another source or another level.
  static Result<std::shared_ptr<const ResidualIndex>> open(const std::string& path, const Surface&,
                                                           int level);
  /// The same, and where that fails makes it: tiles of `level` straight from the posts, each parent
  /// from its four children. A file that is wrong is replaced; one that was begun (PATH.part) is
  /// gone on with; one that another process is making is waited for. The records do not depend on
  /// `threads`, only their order in the file does. Errc::cancelled on a stop: run again to go on.
  static Result<std::shared_ptr<const ResidualIndex>> open_or_make(const std::string& path,
                                                                   const Surface&, int level,
                                                                   int threads = 0,
                                                                   const Progress& = {});

  int level() const { return level_; }  // the deepest it has records of
  bool serves(int level) const { return level < level_; }
  std::uint64_t bytes() const { return bytes_; }
  bool made_now() const { return made_now_; }  // not found, but made

  /// Of all valid posts.
  double min_m() const { return min_m_; }
  double max_m() const { return max_m_; }
  std::uint64_t posts() const { return posts_; }

  /// Fails with bad_data when the record was damaged since the file was opened, with not_found for
  /// a tile that the source does not touch.
  Result<ResidualRecord> record(TileId) const;
  /// Of which level's records a tile of this level has its lattice.
  int lattice_level(int level) const;
  /// Of 1024 cells a side, or less where the index does not go so deep.
  Result<ResidualLattice> lattice(TileId) const;

 private:
  friend class ResidualFile;
  ResidualIndex() = default;
  struct Place {
    std::uint64_t offset = 0, hash = 0;
    std::uint32_t size = 0;
  };
  Result<ResidualRecord> record_at(TileId, const Place&) const;

  std::string path_;
  int file_ = -1, level_ = 0;
  bool made_now_ = false;
  std::uint64_t bytes_ = 0;
  std::map<TileId, Place> places_;
  double min_m_ = 0, max_m_ = 0;
  std::uint64_t posts_ = 0;
};

/// Heights of nodes are multiples of this power of two: a thousandth of the level's error.
double residual_step_m(int deepest_level);

}  // namespace tind
