#pragma once
// GLB: binary glTF 2.0 (Khronos; ISO/IEC 12113:2022), one mesh in one node. Every engine and viewer
// of 3D reads it.

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace tind::proto {

/// A kind of ground, as whoever mapped it calls it.
struct GlbClass {
  std::uint16_t number = 0;
  std::string name = {};                                   // UTF-8; empty: it has none
  std::optional<std::array<std::uint8_t, 3>> colour = {};  // sRGB

  bool operator==(const GlbClass&) const = default;
};
/// Where there is no class, in place of the number of one.
inline constexpr std::uint16_t kNoGlbClass = 65535;

/// A surface beside the first one, in the same frame.
struct GlbPart {
  std::vector<std::array<float, 3>> positions;
  std::vector<std::array<float, 3>> normals;            // unit; empty, or one for each position
  std::vector<std::array<std::uint32_t, 3>> triangles;  // counter-clockwise, as the positions are
  std::string extras;                                   // of the primitive: a JSON object, or empty
  std::vector<std::array<float, 2>> texcoords = {};     // as normals are
  std::vector<std::array<float, 3>> colours = {};       // likewise
  std::vector<std::uint16_t> covers = {};               // likewise, as Glb has them
};

/// A surface whose z points up, in a frame that is kept in double: a vertex lies at origin + x
/// axes[0] + y axes[1] + z axes[2]. The node's matrix has the frame and turns it to glTF's, where y
/// points up; who turns that back, as 3D Tiles does, has the surface where it was.
struct Glb {
  std::array<double, 3> origin{};
  /// REQUIRES: orthogonal (glTF's matrices are turns and scales).
  std::array<std::array<double, 3>, 3> axes{{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
  std::vector<std::array<float, 3>> positions;
  std::vector<std::array<float, 3>> normals;            // unit; empty, or one for each position
  std::vector<std::array<float, 3>> colours;            // linear r g b, 0..1; likewise
  std::vector<std::array<float, 2>> texcoords;          // s right, t DOWN; likewise
  std::string texture;                                  // a file beside it, or empty
  std::vector<std::array<std::uint32_t, 3>> triangles;  // counter-clockwise, as the positions are
  std::string extras;                                   // of the node: a JSON object, or empty
  /// The vertices on the sides of a tile, for CesiumJS's terrain (CESIUM_tile_edges).
  struct Edges {
    std::vector<std::uint32_t> left, bottom, right, top;
  };
  std::optional<Edges> edges;
  /// A PNG over the tile's rectangle, north up, white where water is: a property texture of
  /// semantic WATERMASK (EXT_structural_metadata), as CesiumJS's terrain reads it. Or empty. Its
  /// tilesets draw nothing of a mesh with such a texture and without texcoords.
  std::string water_mask_png;
  /// Kinds of ground, a row of a property table each (EXT_structural_metadata), and which of them
  /// lies at each vertex, or kNoGlbClass (EXT_mesh_features, _FEATURE_ID_0). Both or neither.
  std::vector<GlbClass> classes;
  std::vector<std::uint16_t> covers;
  std::vector<GlbPart> parts;  // each a primitive of its own, after the surface's
  /// Neither shining nor metal, from outside only. What says nothing is metal to glTF.
  bool matt = false;
  /// Compressed by EXT_meshopt_compression, which a reader must know; normals are rounded to 8
  /// bits, colours to 16. REQUIRES: positions, also of the parts, are whole numbers from 0 to
  /// 65535, which the axes make metres of; texcoords lie in 0..1.
  bool meshopt = false;
};

/// REQUIRES: at least one triangle, finite positions, indices in range, `extras` JSON. Indices take
/// two bytes where that is enough.
std::vector<std::uint8_t> encode(const Glb&);

}  // namespace tind::proto
