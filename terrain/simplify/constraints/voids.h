#pragma once
// What a mesh has where the DEM has nothing, whatever the method would do by itself: triangles that
// cover the voids, so that no valid post is left out, or voids that stay open along the outermost
// posts.
//
// "Rims" are where the triangles of three valid corners end that terrain_mesh() makes of the posts;
// the DEM's own sides are none.

#include <cstdint>
#include <utility>
#include <vector>

#include "terrain/base/enum_names.h"
#include "terrain/base/result.h"
#include "terrain/mesh/tin.h"
#include "terrain/raster/gdal/vectors/vector_source.h"
#include "terrain/raster/height_grid.h"

namespace tind {

enum class Voids : std::uint8_t { cover, keep };

template <>
struct EnumNames<Voids> {
  static constexpr const char* kWhat = "way with voids";
  static constexpr std::pair<Voids, const char*> kAll[] = {{Voids::cover, "cover"},
                                                           {Voids::keep, "keep"}};
};

bool has_voids(const HeightGrid&);

/// What to say (bad_data) where open voids leave no triangle of valid posts.
Error no_triangle(const HeightGrid&);

/// The rims as straight lines, in post coordinates and with the DEM's heights (NaN). As breaklines
/// of the covered() grid they are edges of what any method makes of it: open_voids() then takes out
/// what lies between them.
std::vector<VectorLine> void_rims(const HeightGrid&);

/// Takes the triangles over voids out of a mesh in post coordinates, and vertices that only these
/// had; a vertex where two fans are left becomes two. REQUIRES: the rims are edges of it.
void open_voids(Tin&, const HeightGrid&);

/// Every void filled, smoothly from what lies around it; for a method that leaves voids open. As it
/// was where there is no valid post. O(n).
HeightGrid covered(HeightGrid);

}  // namespace tind
