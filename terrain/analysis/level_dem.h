#pragma once
// What clients of a level of tiles see, as a DEM with a bound: so that every question that can be
// asked of a DEM can be asked of tiles, and its answer carries what their error means for it.
//
// Tiles bound their error at posts; between posts a mesh may cut off a ridge, and be farther from
// the DEM than it says. So this takes the mesh's heights at the DEM's posts alone, and between them
// H is bilinear as the DEM's own. Two bilinear surfaces whose posts are within e of each other are
// within e everywhere: H is a mean of posts with weights that are not negative. What is asked of
// this surface is therefore off by what e does to it, and by no more.

#include <atomic>
#include <memory>
#include <string>

#include "terrain/base/result.h"
#include "terrain/raster/dem_source.h"
#include "terrain/store/tile_set.h"
#include "terrain/tile/level_heights.h"

namespace tind {

/// The tiles of a set, decoded one at a time. `tiles` is to outlive it.
LevelTiles level_tiles_of(const TileSet& tiles);

/// On the grid of `grid`, whose own heights only say which posts are void. Thread-safe. Reading
/// fails as the source and the tiles do, and (bad_data) for a tile that states no error.
class LevelDem : public DemSource {
 public:
  /// `datum`: what the tiles' heights are above.
  LevelDem(std::shared_ptr<const DemSource> grid, LevelTiles tiles, int level, VerticalDatum datum);

  /// No post of the DEM is farther from those that have been read, metres; with their rounding.
  double max_error_m() const { return max_error_m_; }

  const DemInfo& info() const override { return info_; }
  Result<HeightGrid> read(std::int64_t col, std::int64_t row, int cols, int rows) const override;
  Result<HeightGrid> read_decimated(std::int64_t col, std::int64_t row, int cols, int rows,
                                    int step) const override;
  void to_post(std::span<const Geographic> in, std::span<Vec2> out) const override;
  void to_geographic(std::span<const Vec2> in, std::span<Geographic> out) const override;
  bool is_plain_geographic() const override { return grid_->is_plain_geographic(); }

 private:
  Result<HeightGrid> seen(HeightGrid posts, std::int64_t col, std::int64_t row, int step) const;

  std::shared_ptr<const DemSource> grid_;
  LevelTiles tiles_;
  int level_;
  DemInfo info_;
  mutable std::atomic<double> max_error_m_ = 0;
};

}  // namespace tind
