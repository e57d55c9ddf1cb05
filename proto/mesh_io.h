#pragma once
// Triangle meshes as files: PLY, OBJ and STL, written so that nothing is lost and read from any
// maker. Plain numbers and bytes; frames and units are the caller's.
//
// Readers take any bytes: they never read outside them, allocate at most about 40 times their size
// whatever a header claims, and say what is wrong in one line with a line number (text) or a byte
// offset (binary). Writers make the file under a temporary name in the same folder and rename it,
// so a full disk leaves no torn file.

#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "terrain/base/result.h"

namespace tind::proto {

/// Attributes are per vertex: each array is empty or as long as `positions`.
struct Mesh {
  std::vector<std::array<double, 3>> positions;
  std::vector<std::array<std::uint32_t, 3>> triangles;
  std::vector<std::array<float, 3>> colours;    // r g b, 0..1
  std::vector<std::array<float, 3>> normals;    // as in the file
  std::vector<std::array<float, 2>> texcoords;  // s right, t up
  std::string texture;                          // image file name, or empty
  std::vector<std::string> comments;            // written, one line each (PLY and OBJ), not read

  // OBJ only: what the file names, in order of first use.
  std::vector<std::string> material_libraries, materials;
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

Result<void> write_ply(const std::string& path, const Mesh&, const PlyOptions& = {});
/// With a texture: also PATH with its extension replaced by .mtl.
Result<void> write_obj(const std::string& path, const Mesh&);
/// Gives the origin.
Result<std::array<double, 3>> write_stl(const std::string& path, const Mesh&);

/// By the extension .ply, .obj or .stl, any case.
Result<void> write_mesh(const std::string& path, const Mesh&);

// ---- reading ----

/// ascii and binary of both byte orders; any scalar types; x y z, red green blue (bytes or floats),
/// nx ny nz, s t | u v | texture_u texture_v; faces (polygons become fans) and triangle strips.
/// Unknown elements and properties are skipped.
Result<Mesh> decode_ply(std::string_view bytes);

/// v (with colour), vt, vn, f in every index form, negative ones too; polygons become fans. A
/// vertex used with several vt or vn is split: the first use keeps its place, others follow at
/// the end.
Result<Mesh> decode_obj(std::string_view text);

/// ascii or binary; equal positions become one vertex. The origin that encode_stl wrote is added.
Result<Mesh> decode_stl(std::string_view bytes);

/// File name of the diffuse texture (map_Kd) of a material; the first one when `material` is empty;
/// empty when there is none.
std::string diffuse_texture(std::string_view mtl_text, std::string_view material);

/// By extension. Of an OBJ the material libraries beside it are read for `texture`; names that
/// leave its folder are not followed.
Result<Mesh> read_mesh(const std::string& path);

}  // namespace tind::proto
