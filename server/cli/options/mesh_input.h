#pragma once
// Meshes as inputs of subcommands, and .tpm streams as outputs.

#include <string>
#include <vector>

#include "proto/mesh/mesh_io.h"
#include "proto/stream/mesh_stream.h"
#include "terrain/base/result.h"
#include "terrain/mesh/tin.h"
#include "terrain/raster/dem_source.h"
#include "terrain/simplify/simplify_tin.h"

namespace tind::cli {

/// By its extension, in any case: of a format that is read as a mesh.
bool is_mesh(const std::string& path);

/// Why a subcommand that works on rasters alone does not take this mesh, and which ones do.
std::string mesh_refused(const std::string& path);

/// What kept a file from being opened as a DEM; where it looks like a mesh, that.
Error not_a_dem(const Error& why, const std::vector<std::string>& files);

/// The file's mesh, attributes included, with what the file says of where it is.
struct PlacedTin {
  Tin tin;
  proto::MeshPlace place;
  std::string texture = {};  // as the file names it; empty: it has none
  std::size_t materials = 0;
};
/// Fails (bad_data) with the file's name, also where a coordinate is not a number; and as
/// check_unit() does of the file's own CRS, unless `crs` is said in its place. Warns where several
/// surfaces are one mesh here.
Result<PlacedTin> read_placed_tin(const std::string& path, const std::string& crs = {});

/// A file that says the unit of its x and y, against the CRS that they are in, its own or one that
/// somebody says: one of the two is wrong where they differ, and answers by the ratio of the units
/// or its square. Fails (invalid_argument) with the file's name. REQUIRES: no degrees.
Result<void> check_unit(const std::string& path, const proto::MeshPlace&,
                        const std::string& crs_name, double crs_unit_m);

/// Whether a mesh is a surface in space, whose distances and normals mean something: fails
/// (unsupported) with the file's name where x and y are degrees and z is a length.
Result<void> check_surface(const std::string& path, const proto::MeshPlace&);
/// The mesh of a file that is one, attributes included.
Result<Tin> read_surface(const std::string& path);

/// A mesh as terrain (as_terrain), with what its units are in metres: as far as its file says where
/// it is, otherwise all three are metres. Degrees are those of its middle.
struct PlacedTerrain {
  TerrainTin terrain;
  proto::MeshPlace place;
  bool had_attributes = false;  // colours, normals, texture coordinates
};
/// Fails as read_placed_tin() does, and where it is no terrain, with the file's name and the place.
Result<PlacedTerrain> read_terrain_tin(const std::string& path, const std::string& crs = {});

/// The shape of a surface alone: no attributes, vertices that only they kept apart welded, unused
/// ones gone.
Result<Tin> read_shape(const std::string& path);

/// Encodes and writes; the number of bytes. Fails (io) when the file cannot be written.
Result<std::size_t> write_stream(const std::string& path, const Result<proto::MeshStream>&);

}  // namespace tind::cli
