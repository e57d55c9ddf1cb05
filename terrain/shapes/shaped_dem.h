#pragma once
// A DEM as its lines make it: posts in level polygons have the level, posts outside the boundary
// are void. Whatever reads posts (tiles, the residual index, updates, the checker) reads these.

#include <memory>

#include "terrain/raster/dem_source.h"
#include "terrain/shapes/shape_files.h"

namespace tind {

class SurfaceShapes;

/// Voids in polygons stay voids. Its extents are those
/// of the boundary, so that there are tiles only where that is; its fingerprint knows the shapes.
/// COST: of a window without polygons none; else that of a row of posts for each row (plain
/// longitudes and latitudes), or of PROJ for each post.
std::shared_ptr<const DemSource> shaped_dem(std::shared_ptr<const DemSource>,
                                            std::shared_ptr<const SurfaceShapes>);

/// The same of one DEM from files; the DEM itself where there are none. Fails as
/// SurfaceShapes::make does.
Result<std::shared_ptr<const DemSource>> shaped_dem(std::shared_ptr<const DemSource>,
                                                    const ShapeFiles&);

/// Those that a DEM has been given by shaped_dem(); else null.
const SurfaceShapes* shapes_of(const DemSource&);

}  // namespace tind
