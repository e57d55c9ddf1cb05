#include "terrain/surface/height_field.h"

#include <utility>

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
}

void HeightField::filled(std::span<const Geographic> places, std::span<double> heights) const {
  layers_.front().filled(places, heights);
}

const std::optional<Error>& HeightField::error() const { return layers_.front().error(); }

}  // namespace tind
