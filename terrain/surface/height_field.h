#pragma once
// H, the height function of a surface. Every tile, border and query takes its heights from it.
//
// H depends only on the surface and the position, never on the tile that needs it. So two tiles,
// two runs and two machines get the same height to the last bit.

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "terrain/base/result.h"
#include "terrain/geo/coordinates.h"
#include "terrain/raster/height_grid.h"
#include "terrain/surface/layer_field.h"
#include "terrain/surface/surface.h"

namespace tind {

/// In a polygon that is level, its level. Else of one DEM: bilinear over the four posts around a
/// place; a plane over three where one is void; NaN else. Within half a post spacing outside the
/// grid the outermost posts count on. For one thread.
class HeightField {
 public:
  explicit HeightField(Surface surface);

  /// Keeps the posts [col, col + cols) x [row, row + rows) of a layer in memory, which makes H fast
  /// there. Elsewhere H reads the source, 2 x 2 posts at a time.
  Result<void> load(std::size_t layer, std::int64_t col, std::int64_t row, int cols, int rows);

  /// What load() keeps of a layer.
  const HeightGrid& loaded(std::size_t layer) const { return layers_[layer].loaded(); }

  /// H at many places; NaN for void and outside. A read error is kept and shows in error().
  void at(std::span<const Geographic> places, std::span<double> heights) const;
  /// H with the voids filled (void_fill.h), so that it is continuous and everywhere: of one DEM,
  /// bilinear over four posts, whichever of them are void.
  void filled(std::span<const Geographic> places, std::span<double> heights) const;

  const std::optional<Error>& error() const;

 private:
  Surface surface_;
  std::vector<LayerField> layers_;

  void level(std::span<const Geographic> places, std::span<double> heights) const;
};

}  // namespace tind
