#pragma once
// What tiles are made of: one DEM, or layers of them, each where those above have no height. A
// tile, its borders and whoever checks them ask the surface; only here is it known how many DEMs
// there are.

#include <concepts>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "terrain/raster/dem_source.h"
#include "terrain/shapes/shaped_dem.h"

namespace tind {

struct SurfaceLayer {
  std::string name;
  std::shared_ptr<const DemSource> source;
};

/// A value that is cheap to copy; copies share their layers. Thread-safe.
class Surface {
 public:
  /// Of one DEM.
  template <std::derived_from<DemSource> Source>
  Surface(std::shared_ptr<Source> source)  // NOLINT: a DEM is a surface
      : Surface(std::vector{SurfaceLayer{{}, std::move(source)}}) {}
  template <std::derived_from<DemSource> Source>
  Surface(std::shared_ptr<const Source> source)  // NOLINT
      : Surface(std::vector{SurfaceLayer{{}, std::move(source)}}) {}
  /// The same of a DEM that somebody else holds, as long as that does.
  Surface(const DemSource& source)  // NOLINT
      : Surface(std::shared_ptr<const DemSource>(std::shared_ptr<void>(), &source)) {}

  /// The lowest first.
  std::span<const SurfaceLayer> layers() const { return *layers_; }
  /// The DEM of a surface that has only one; else null.
  const DemSource* only() const { return layers_->size() == 1 ? top().get() : nullptr; }

  /// The lines and the water that go with it; null: none.
  const SurfaceShapes* shapes() const { return shapes_of(*top()); }

  /// What is known of it as a whole: of one DEM, what that says of itself.
  const DemInfo& info() const { return top()->info(); }
  /// Are all of its posts plain longitudes and latitudes?
  bool is_plain_geographic() const { return top()->is_plain_geographic(); }

 private:
  explicit Surface(std::vector<SurfaceLayer> layers)
      : layers_(std::make_shared<const std::vector<SurfaceLayer>>(std::move(layers))) {}
  const std::shared_ptr<const DemSource>& top() const { return layers_->back().source; }

  std::shared_ptr<const std::vector<SurfaceLayer>> layers_;
};

}  // namespace tind
