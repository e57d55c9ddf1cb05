#pragma once
// Where images of a tile ask for H: n x n places in each pixel, which lie on one lattice over the
// whole map. So a pixel does not depend on its tile, and neighbouring tiles have no seam.

#include <cstddef>
#include <functional>
#include <optional>
#include <span>
#include <stop_token>
#include <utility>
#include <vector>

#include "terrain/base/result.h"
#include "terrain/geo/web_mercator.h"
#include "terrain/surface/height_field.h"

namespace tind {

/// Columns from the west and rows from the north, in places; those of the tile are
/// [0, pixels x samples). Before and beyond them the lattice goes on into the neighbours. For one
/// thread.
class SampleLattice {
 public:
  SampleLattice(const Surface&, web_mercator::Tile, int pixels);

  /// Places in a pixel, along each axis: as dense as the posts of the finest layer there, at
  /// most 8.
  int samples() const { return samples_; }
  int pixels() const { return pixels_; }
  int level() const { return tile_.level; }
  /// Places along a side of the tile.
  int side() const { return pixels_ * samples_; }

  /// Of places, fractions between them, too; longitudes are within -180..180.
  double lon_of(double col) const;
  double lat_of(double row) const;
  /// The middle of a pixel.
  Geographic centre_of(int pixel_col, int pixel_row) const;

  /// H at the places [begin, begin + heights.size()) of a row; NaN where there is none. Places far
  /// from all extents of the surface are passed over, which costs next to nothing.
  void heights(int row, int begin, std::span<double> heights);
  /// Can H be filled there (HeightField::filled)? False only far beyond all posts, where it is 0.
  bool may_fill(Geographic) const;

  const HeightField& field() const { return field_; }

  /// f(row) for each row of pixels, from the north. Before, the posts that it needs are in memory,
  /// also for `margin` places around the row; some millions of posts at a time. Errors: those of
  /// reading; cancelled.
  Result<void> each_pixel_row(int margin, const std::stop_token&,
                              const std::function<void(int)>& f);

 private:
  HeightField field_;
  const int pixels_, samples_;
  const web_mercator::Tile tile_;
  const double tile_side_;                // of the map's
  std::vector<GeoRect> near_, fillable_;  // beyond them there is no H, nor anything to fill it with
  std::vector<Geographic> places_;
  std::vector<std::pair<int, int>> spans_;

  Result<void> load(int first_row, int end_row, int margin);
  void find_spans(double lat, int begin, int end);
};

}  // namespace tind
