#pragma once
// Heights between the posts of one DEM: what a layer of a surface says by itself (height_field.h
// says what the surface does).

#include <optional>
#include <span>

#include "terrain/base/result.h"
#include "terrain/geo/coordinates.h"
#include "terrain/raster/dem_source.h"
#include "terrain/raster/height_grid.h"
#include "terrain/surface/void_fill.h"

namespace tind {

/// Bilinear over the four posts around a place; a plane over three where one is void; NaN else.
/// Within half a post spacing outside the grid the outermost posts count on.
class LayerField {
 public:
  explicit LayerField(const DemSource& source) : source_(source), info_(source.info()) {}

  /// Keeps the posts [col, col + cols) x [row, row + rows) in memory, which makes H fast there.
  /// Elsewhere H reads the source, 2 x 2 posts at a time.
  Result<void> load(std::int64_t col, std::int64_t row, int cols, int rows);

  /// What load() keeps.
  const HeightGrid& loaded() const { return window_; }

  /// H at post coordinates; NaN for void and outside. A read error is kept and shows in error().
  double at_post(Vec2 post) const;
  /// H at many places.
  void at(std::span<const Geographic> places, std::span<double> heights) const;
  /// H with the voids filled (void_fill.h), so that it is continuous and everywhere: bilinear over
  /// four posts, whichever of them are void.
  /// `shares`, where wanted: how much of a height that is (VoidFill::Post), 1 to 0.
  void filled(std::span<const Geographic> places, std::span<double> heights,
              std::span<double> shares = {}) const;
  /// The layer's own height where it has one inside its outermost posts: among four valid posts,
  /// or in the triangle of three; NaN else. `posts`: become the places in post coordinates.
  void inside(std::span<const Geographic> places, std::span<double> heights,
              std::span<Vec2> posts) const;

  const std::optional<Error>& error() const { return error_; }

 private:
  const DemSource& source_;
  const DemInfo& info_;
  HeightGrid window_;
  std::int64_t col_ = 0, row_ = 0;
  mutable std::optional<Error> error_;

  /// Four posts and the share of the way between them, to the east and to the south.
  struct Cell {
    double nw, ne, sw, se, fx, fy;
    bool whole() const;  // no void
    double height() const;
  };
  std::optional<Cell> cell_at(Vec2 post) const;
  VoidFill::Post filled_post(Vec2 post, const VoidFill* around) const;
  std::optional<VoidFill> fill_around(std::span<const Vec2> posts, int reach) const;
};

}  // namespace tind
