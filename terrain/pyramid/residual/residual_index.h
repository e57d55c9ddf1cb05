#pragma once
// The residual index of a source: one file beside the store, made in one pass over all posts. With
// it a tile of any number of posts is fitted and certified from 257 x 257 heights.
// (design: "Certifying"; the file: docs/formats.md)

#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "terrain/base/lru.h"
#include "terrain/base/progress.h"
#include "terrain/base/result.h"
#include "terrain/geo/coordinates.h"
#include "terrain/pyramid/residual/index_depth.h"
#include "terrain/pyramid/residual/residual_record.h"
#include "terrain/surface/surface.h"

namespace tind {

/// Tiles whose records are made straight from their posts, the deepest first: nearly all the work,
/// to be shared out among machines. All others are made of these.
std::vector<TileId> scanned_tiles(const Surface&, const IndexDepth&);

/// Records of some of those, made elsewhere, in a file.
struct IndexPart {
  std::string path;
  std::string whose;  // 32 characters or more: of the heights and options that it was made for
};

/// Makes the file, under another name first, or leaves alone the one that is there and whole.
/// Errc::cancelled on a stop: what is begun is dropped.
Result<void> make_index_part(const IndexPart&, const std::string& unfinished_path, const Surface&,
                             const IndexDepth&, const std::vector<TileId>&, int threads = 0,
                             const Progress& = {});

/// A finished index, open for reading. Thread-safe.
class ResidualIndex {
 public:
  ~ResidualIndex();
  ResidualIndex(const ResidualIndex&) = delete;
  ResidualIndex& operator=(const ResidualIndex&) = delete;

  /// Opens the file and reads it through. Fails with not_found; with bad_data for one that is
  /// damaged, unfinished, of another version, another source or another depth.
  static Result<std::shared_ptr<const ResidualIndex>> open(const std::string& path, const Surface&,
                                                           const IndexDepth&);
  /// The same, and where that fails makes it: tiles without records below them straight from the
  /// posts, each parent from its four children. A file that is wrong is replaced; one that was
  /// begun (PATH.part) is gone on with; one that another process is making is waited for. The
  /// bytes are a function of the surface and the depth alone. Records that `parts` have are taken
  /// from there; a part that is not there, or not sound, is done without. Errc::cancelled on a
  /// stop: run again to go on.
  static Result<std::shared_ptr<const ResidualIndex>> open_or_make(
      const std::string& path, const Surface&, const IndexDepth&, int threads = 0,
      const Progress& = {}, std::span<const IndexPart> parts = {});

  const IndexDepth& depth() const { return depth_; }
  int level() const { return depth_.level(); }  // the deepest it has records of
  /// Does the tile rest on the index? (A tile that the source does not touch has no record.)
  bool serves(TileId id) const { return depth_.serves(id) && places_.contains(id); }
  std::uint64_t bytes() const { return bytes_; }
  bool made_now() const { return made_now_; }  // not found, but made

  /// Of all valid posts; of layers of those that decide, the range with what rims bend.
  double min_m() const { return min_m_; }
  double max_m() const { return max_m_; }
  std::uint64_t posts() const { return posts_; }

  /// Fails with bad_data when the record was damaged since the file was opened, with not_found for
  /// a tile that the source does not touch. Those asked for last are at hand.
  Result<std::shared_ptr<const ResidualRecord>> record(TileId) const;
  /// What its record begins with, in one short read.
  Result<std::shared_ptr<const ResidualHead>> head(TileId) const;
  /// Of which level's records the terrain at a place is known to tiles of `level`; -1: of none, the
  /// tile there does not rest on the index. REQUIRES: a longitude within +-180.
  int lattice_level(int level, Geographic place) const;
  /// Of 512 cells a side: the records of its children.
  Result<ResidualLattice> lattice(TileId) const;
  /// How many levels further down the records are that edges of tiles are made of. More than for
  /// the lattice: where the data end on an edge its line falls off within one cell, and posts in
  /// that cell have the error of it. REQUIRES: one DEM.
  int finer(int level) const;

 private:
  friend class ResidualFile;
  friend Result<void> make_index_part(const IndexPart&, const std::string&, const Surface&,
                                      const IndexDepth&, const std::vector<TileId>&, int,
                                      const Progress&);
  explicit ResidualIndex(IndexDepth depth) : depth_(std::move(depth)) {}
  struct Place {
    std::uint64_t offset = 0, hash = 0;
    std::uint32_t size = 0;
  };
  Result<ResidualRecord> record_at(TileId, const Place&) const;
  Result<ResidualHead> head_at(TileId, const Place&) const;
  /// Of those asked for last, or what `read` has at the tile's place.
  template <class T>
  Result<std::shared_ptr<const T>> kept_or_read(Lru<TileId, std::shared_ptr<const T>>&, TileId,
                                                Result<T> (ResidualIndex::*read)(TileId,
                                                                                 const Place&)
                                                    const) const;
  Error damaged(TileId) const;

  std::string path_;
  IndexDepth depth_;
  int file_ = -1;
  bool made_now_ = false;
  std::uint64_t bytes_ = 0;
  std::map<TileId, Place> places_;
  double min_m_ = 0, max_m_ = 0;
  std::uint64_t posts_ = 0;
  /// Tiles beside each other, and above, ask for the same: 600 kB and 4 kB each.
  static constexpr std::size_t kKept = 96, kHeads = 2048;
  mutable std::mutex mutex_;
  mutable Lru<TileId, std::shared_ptr<const ResidualHead>> heads_{kHeads};
  mutable Lru<TileId, std::shared_ptr<const ResidualRecord>> kept_{kKept};
};

}  // namespace tind
