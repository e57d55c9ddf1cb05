#pragma once
// Triangle meshes as bytes: written so that nothing is lost and read from any maker. Plain numbers;
// frames and units are the caller's, who says in MeshPlace what they are. Which formats there are
// for people is the table in terrain/mesh/mesh_file.h.
//
// Readers take any bytes: they never read outside them, allocate at most about 40 times their size
// whatever a header claims, and say what is wrong in one line with a line number (text) or a byte
// offset (binary).

#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "terrain/base/result.h"

namespace tind::proto {

/// Where the numbers of a mesh are on Earth. Every format writes as much of it as it has room for.
struct MeshPlace {
  // The reference system of x and y. All empty: none is known.
  int epsg = 0;  // 0: it has no code
  std::string crs_wkt = {}, crs_name = {};
  bool geographic = false;  // x, y are degrees, longitude first
  double unit_m = 1;        // metres per unit of x and y, where not geographic
  double said_unit_m = 0;   // the same by the file's own word beside its CRS; 0: it says none

  std::string vertical_datum = {};  // what z is above; empty: this is no terrain
  double z_unit_m = 1;              // metres per unit of z

  /// x and y are metres from a point of that system instead: x_crs = origin[0] + to_crs[0] x +
  /// to_crs[1] y, y_crs = origin[1] + to_crs[2] x + to_crs[3] y.
  bool local = false;
  std::array<double, 2> origin{};
  std::array<double, 4> to_crs{1, 0, 0, 1};

  /// The lattice on which most vertices lie: x = x0 + col x_col + row x_row, then the same for y.
  /// With it, formats of 32-bit numbers keep whole columns and rows exactly. All zero: none.
  std::array<double, 6> lattice{};
};

/// "crs: EPSG:32611", "vertical datum: egm96" ...: what is known, a line each, for formats with
/// comments. QGIS takes the CRS from the first one in a PLY (MDAL, mdal_ply.cpp).
std::vector<std::string> place_lines(const MeshPlace&);
/// One such line, read back; any other text says nothing.
void read_place_line(std::string_view, MeshPlace&);

/// Attributes are per vertex: each array is empty or as long as `positions`.
struct Mesh {
  std::vector<std::array<double, 3>> positions;
  std::vector<std::array<std::uint32_t, 3>> triangles;
  std::vector<std::array<float, 3>> colours;    // r g b, 0..1
  std::vector<std::array<float, 3>> normals;    // as in the file
  std::vector<std::array<float, 2>> texcoords;  // s right, t up
  std::string texture;                          // image file name, or empty
  /// Read back from PLY, OBJ, 2DM and LandXML as far as the file says it (place_lines; LandXML's
  /// units and codes). What a CRS means (geographic, unit_m) no reader looks up.
  MeshPlace place;

  // OBJ only: what the file names, in order of first use.
  std::vector<std::string> material_libraries, materials;
  /// LandXML only: the names of the surfaces whose faces these are, in the file's order.
  std::vector<std::string> surfaces;
};

// ---- writing ----

struct PlyOptions {
  bool float_positions = false;  // 4 bytes a coordinate instead of 8: loses digits
  bool float_colours = false;    // instead of one byte a channel, which every reader knows
};

/// Binary little endian; positions as double. The texture is named in a `comment TextureFile`.
std::string encode_ply(const Mesh&, const PlyOptions& = {});

/// Text with the shortest digits that give back the same doubles. `material_library`, when not
/// empty, is named by `mtllib`, and the mesh uses its material `surface`.
std::string encode_obj(const Mesh&, std::string_view material_library = {});

/// STL has float32 only, too coarse for projected coordinates (0.5 m at 5,000,000). Vertices are
/// therefore written relative to `origin` (whole units; zero on each axis whose coordinates are
/// within 16 times the mesh's size of zero), which the 80-byte header names: "tind origin X Y Z".
struct Stl {
  std::string bytes;
  std::array<double, 3> origin{};
};
Stl encode_stl(const Mesh&);
std::array<double, 3> stl_origin(const Mesh&);

/// STL as it stands in the file: positions rounded to what its reader gets.
Mesh as_in_stl(Mesh);

/// The material library that `encode_obj` names, for the texture.
std::string encode_mtl(const Mesh&);

/// GLB with positions, colours, normals and texture coordinates. Where the place has a lattice,
/// positions are columns, rows and heights, and the node's matrix, in double, puts them where
/// they are; else they are relative to the middle, which the matrix names. The node's extras name
/// the place. Fails (invalid_argument) without a triangle: glTF has no empty mesh.
Result<std::string> encode_glb(const Mesh&);
/// GLB as it stands in the file.
Mesh as_in_glb(Mesh);

/// Aquaveo's 2DM (SMS, QGIS, TUFLOW): the shape alone. Text, shortest digits.
std::string encode_2dm(const Mesh&);

/// UGRID 1.0 (CF conventions for unstructured grids) in a NetCDF file of the classic 64-bit offset
/// format; z as node_z, standard_name altitude. Fails (out_of_range) beyond 2^31 vertices
/// or 4 GB.
Result<std::string> encode_ugrid(const Mesh&);

/// VTK's XML UnstructuredGrid, binary in base64; colours, normals and texture coordinates as
/// PointData.
std::string encode_vtu(const Mesh&);

/// DXF R12 (AutoCAD): one 3DFACE a triangle on the layer TERRAIN. Text, shortest digits.
std::string encode_dxf(const Mesh&);

/// LandXML 1.2: one Surface, a TIN. y before x, as LandXML has it. Fails (invalid_argument) for
/// units that it has no word for: degrees, or feet other than the two.
Result<std::string> encode_landxml(const Mesh&);
Result<void> landxml_can_say(const MeshPlace&);

// ---- reading ----

/// ascii and binary of both byte orders; any scalar types; x y z, red green blue (bytes or floats),
/// nx ny nz, s t | u v | texture_u texture_v; faces (polygons: polygon.h) and triangle strips.
/// Unknown elements and properties are skipped.
Result<Mesh> decode_ply(std::string_view bytes);

/// The picture that the header names; empty where it names none, or is none.
std::string texture_of_ply(std::string_view bytes);

/// v (with colour), vt, vn, f in every index form, negative ones too; polygons: polygon.h. A
/// vertex used with several vt or vn is split: the first use keeps its place, others follow at
/// the end.
Result<Mesh> decode_obj(std::string_view text);

/// ascii or binary; equal positions become one vertex. The origin that encode_stl wrote is added.
Result<Mesh> decode_stl(std::string_view bytes);

/// File name of the diffuse texture (map_Kd) of a material; the first one when `material` is empty;
/// empty when there is none.
std::string diffuse_texture(std::string_view mtl_text, std::string_view material);

/// Every picture that a material library names (map_..., bump, disp, decal, refl, norm), as it
/// does.
std::vector<std::string> pictures_of_materials(std::string_view mtl_text);

/// Paths of the files that the OBJ at `path` needs beside it: its material libraries and their
/// pictures; whether they are there or not. Libraries that leave its folder are not read.
std::vector<std::string> files_of_obj(const std::string& path, std::string_view obj_text);

/// The texture that the OBJ at `path` names by way of the material libraries beside it; names that
/// leave its folder are not followed. A library that cannot be read costs the texture, not
/// the mesh.
std::string texture_of_obj(const std::string& path, const Mesh&);

/// ND, E3T and E4Q (two triangles); other cards are read over, E6T, E8Q and E9Q refused.
Result<Mesh> decode_2dm(std::string_view text);

/// Every Surface with a TIN, as one mesh, which names them; faces marked invisible (i="1") are left
/// out.
Result<Mesh> decode_landxml(std::string_view text);

}  // namespace tind::proto
