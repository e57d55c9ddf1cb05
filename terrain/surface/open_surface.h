#pragma once
// From files to layers: by what the operator says, or by their grids.

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "terrain/base/result.h"
#include "terrain/raster/dem_source.h"
#include "terrain/shapes/shape_files.h"
#include "terrain/surface/surface.h"

namespace tind {

/// What is said of one layer.
struct LayerSpec {
  std::string name;
  std::vector<std::string> files;      // of one grid
  std::optional<DemOptions> dem = {};  // other than what is said of all
};

struct SurfaceOptions {
  DemOptions dem;
  double blend_m = -1;  // of every layer; negative: as Surface::of_layers says
  /// Of single layers, by name.
  struct OfLayer {
    std::string name;
    double metres = 0;
  };
  std::vector<OfLayer> blends_m = {}, max_errors_m = {};
};

/// The layers that are said, the lowest first. Errors name the layer; invalid_argument for two of
/// one name, and for an option of a layer that is not there.
Result<Surface> open_surface(std::span<const LayerSpec>, const SurfaceOptions&);

/// Files that share CRS and grid are one layer, named after its first file; finer ones lie higher.
/// Of layers as fine as each other (within a fifth) the one that was named first lies higher, as
/// its files do in one grid. One layer is opened as DemSource::open does, and fails as that.
Result<Surface> open_surface(std::span<const std::string> files, const SurfaceOptions&);

/// The same surface with the lines and the water of files; itself where there are none. Fails as
/// SurfaceShapes::make does.
Result<Surface> shaped_surface(Surface, const ShapeFiles&);

}  // namespace tind
