#pragma once
// H, the height function of a surface. Every tile, border and query takes its heights from it.
//
// H depends only on the surface and the position, never on the tile that needs it. So two tiles,
// two runs and two machines get the same height to the last bit.

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "terrain/base/result.h"
#include "terrain/geo/coordinates.h"
#include "terrain/raster/height_grid.h"
#include "terrain/surface/layer_blend.h"
#include "terrain/surface/layer_field.h"
#include "terrain/surface/surface.h"

namespace tind {

/// In a polygon that is level, its level. Else of one DEM: bilinear over the four posts around a
/// place; a plane over three where one is void; NaN else. Within half a post spacing outside the
/// grid the outermost posts count on.
///
/// Of layers: that of the topmost layer with a height there; where layers above it end nearby, bent
/// to them (layer_blend.h). Upper layers end at their outermost posts. For one thread.
class HeightField {
 public:
  explicit HeightField(Surface surface);

  const Surface& surface() const { return surface_; }

  /// Keeps the posts [col, col + cols) x [row, row + rows) of a layer in memory, which makes H fast
  /// there. Elsewhere H reads the source, 2 x 2 posts at a time.
  Result<void> load(std::size_t layer, std::int64_t col, std::int64_t row, int cols, int rows);

  /// What load() keeps of a layer.
  const HeightGrid& loaded(std::size_t layer) const { return layers_[layer].loaded(); }

  /// H at many places; NaN for void and outside. A read error is kept and shows in error().
  /// `deciding`: becomes the topmost layer with a height there, -1 for none.
  void at(std::span<const Geographic> places, std::span<double> heights,
          std::span<int> deciding = {}) const;
  /// H with the voids filled (void_fill.h), so that it is continuous and everywhere. Of one DEM,
  /// bilinear over four posts, whichever of them are void. Of layers, where none has a height: each
  /// in turn beside what fills below it, as far as there is any.
  void filled(std::span<const Geographic> places, std::span<double> heights) const;

  /// From now on that slopes to this far from all posts, in place of 0. For one who counts heights
  /// from something else: 0 there would be far from its own.
  using Ground = std::function<void(std::span<const Geographic>, std::span<double> heights)>;
  void fill_towards(Ground ground) { ground_ = std::move(ground); }

  /// H at places where `layer` has a height and that is `heights`: bent to the layers above that
  /// end nearby; NaN where one of those has a height itself and decides.
  void raise(std::size_t layer, std::span<const Geographic> places,
             std::span<double> heights) const;

  std::optional<Error> error() const;

 private:
  Surface surface_;
  std::vector<LayerField> layers_;
  mutable std::vector<LayerBlend> blends_;  // of layers 1, 2, ...
  mutable std::optional<Error> error_;
  Ground ground_;  // empty: 0

  struct Places;  // in the course of finding their heights
  void level(std::span<const Geographic> places, std::span<double> heights) const;
  void add_ground(std::span<const Geographic> places, std::span<double> heights,
                  std::span<const double> shares) const;
  void find_own(std::size_t begin, std::size_t end, Places&) const;
  void add_layer(std::size_t k, Places&) const;
  void fill(std::size_t layers, std::span<const Geographic> places, std::span<double> heights,
            std::span<double> shares) const;
};

/// H at one place, and which layer decides it. Of one DEM as height_at() of the DEM, which ends at
/// its outermost posts. What is level is so up to its outline, also in cells that a shore cuts and
/// in voids; not beyond the DEM or the boundary.
struct SurfaceHeight {
  HeightAt height;
  std::size_t layer = 0;  // REQUIRES: a height
};
Result<SurfaceHeight> height_at(const Surface&, Geographic);

}  // namespace tind
