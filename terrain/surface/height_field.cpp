#include "terrain/surface/height_field.h"

#include <utility>

#include "terrain/shapes/surface_shapes.h"

namespace tind {

HeightField::HeightField(Surface surface) : surface_(std::move(surface)) {
  for (const SurfaceLayer& layer : surface_.layers()) layers_.emplace_back(*layer.source);
}

Result<void> HeightField::load(std::size_t layer, std::int64_t col, std::int64_t row, int cols,
                               int rows) {
  return layers_[layer].load(col, row, cols, rows);
}

void HeightField::at(std::span<const Geographic> places, std::span<double> heights) const {
  layers_.front().at(places, heights);
  level(places, heights);
}

void HeightField::filled(std::span<const Geographic> places, std::span<double> heights) const {
  layers_.front().filled(places, heights);
  level(places, heights);
}

/// What is level is so between posts, too, and in voids.
void HeightField::level(std::span<const Geographic> places, std::span<double> heights) const {
  const SurfaceShapes* shapes = surface_.shapes();
  if (!shapes || shapes->level_areas().empty()) return;
  for (std::size_t i = 0; i < places.size(); ++i)
    if (const auto level = shapes->level_at(places[i])) heights[i] = *level;
}

const std::optional<Error>& HeightField::error() const { return layers_.front().error(); }

}  // namespace tind
