#pragma once
// From the frame in which tind works (post coordinates, metres up) to the frames in which people
// want their meshes, and back for measuring.

#include <utility>

#include "proto/mesh/mesh_io.h"
#include "terrain/base/enum_names.h"
#include "terrain/base/result.h"
#include "terrain/mesh/tin.h"
#include "terrain/raster/dem_source.h"

namespace tind {

enum class MeshFrame {
  source,  // x, y in the DEM's own CRS and units, by its geotransform (none: x = col, y = -row)
  metric,  // metres from the first post, along rows and up columns: mostly east and north
};

template <>
struct EnumNames<MeshFrame> {
  static constexpr const char* kWhat = "frame";
  static constexpr std::pair<MeshFrame, const char*> kAll[] = {{MeshFrame::source, "source"},
                                                               {MeshFrame::metric, "metric"}};
};

/// An affine map for x and y, a factor for z; and its inverse.
struct MeshMap {
  Affine xy;  // of (col, row)
  double z_per_metre = 1;

  /// Post coordinates (y = -row) to the mesh's frame. Triangles that the map turns over (a raster
  /// whose rows go north) are turned back, so that they are counter-clockwise in the new frame.
  Tin from_posts(Tin) const;
  Tin to_posts(Tin) const;
};

/// `source_units`: z in the raster's own unit instead of metres.
MeshMap mesh_map(const DemInfo&, MeshFrame, bool source_units);

/// What mesh files say of where such a mesh is. Looks up the CRS's code: milliseconds. Errc::io
/// where PROJ's database cannot be read.
Result<proto::MeshPlace> mesh_place(const DemInfo&, MeshFrame, bool source_units);

/// What a mesh file said, with what its CRS means (name, degrees or not, unit). Milliseconds.
/// Errc::io where PROJ's database cannot be read.
Result<proto::MeshPlace> looked_up(proto::MeshPlace said);

/// A mesh that is local to a point of its CRS, in that CRS. REQUIRES: place.local.
Tin in_crs(Tin, const proto::MeshPlace&);

/// The arrays of a mesh file. Nothing is converted.
proto::Mesh to_file_mesh(Tin);
Tin from_file_mesh(proto::Mesh);

}  // namespace tind
