#pragma once
// Gives heights where a source has none: in voids, and around the data. One rule serves all tiles.
// It depends on the source alone, not on a level or a tile. So all tiles that meet in a void agree
// on the heights in it.

#include <cstdint>
#include <vector>

#include "terrain/base/result.h"
#include "terrain/raster/dem_source.h"
#include "terrain/raster/height_grid.h"

namespace tind {

/// A void post, inside the source or outside, has the height of the nearest valid post (of two as
/// near: first by rows down, up, then by columns left, right); from kFlat posts away it slopes to 0
/// at kReach, so that there is a rule for every place on the globe that only asks what is near.
class VoidFill {
 public:
  static constexpr int kReach = 64, kFlat = 16;  // posts

  /// For the posts [col, col + cols) x [row, row + rows): reads `reach` more on each side. A small
  /// reach is enough for narrow voids; what it is too small for is NaN, never wrong.
  static Result<VoidFill> load(const DemSource&, std::int64_t col, std::int64_t row, int cols,
                               int rows, int reach = kReach);

  bool covers(std::int64_t col, std::int64_t row) const;
  /// Height of a post that is covered, valid or not. O(distance).
  double at(std::int64_t col, std::int64_t row) const { return post(col, row).height; }

  /// The same, and which share of the nearest post's height that is: 1 at valid posts and near
  /// them, 0 beyond the reach.
  struct Post {
    double height = 0, share = 0;
  };
  Post post(std::int64_t col, std::int64_t row) const;

 private:
  HeightGrid around_;
  std::int64_t col_ = 0, row_ = 0;  // of around_'s first post
  int reach_ = kReach;
  bool all_void_ = false;                   // nothing to be near to
  std::vector<std::int16_t> left_, right_;  // columns to the nearest valid post in the row
};

/// A source, or a window of it, without voids, for what draws it: its posts as they are (`posts`:
/// as read from (col, row) on), and in the voids at(), smoothed so that where two nearest posts
/// meet there is a slope and no cliff.
Result<HeightGrid> fill_voids(const DemSource&, HeightGrid posts, std::int64_t col = 0,
                              std::int64_t row = 0);

}  // namespace tind
