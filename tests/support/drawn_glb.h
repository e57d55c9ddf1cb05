#pragma once
// A GLB as a client draws it: read by the texts of glTF, KHR_mesh_quantization and
// EXT_meshopt_compression, with the decoder of meshoptimizer.

#include <array>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <vector>

#include "terrain/geo/coordinates.h"
#include "tests/support/made_up_source.h"

namespace tind::test {

struct DrawnPart {
  std::vector<Vec3> vertices;  // where the node puts them, z up: ECEF of tiles
  std::vector<Vec3> normals;   // unit, or none; axes likewise
  std::vector<std::array<double, 2>> texcoords;
  std::vector<std::array<std::uint32_t, 3>> triangles;
  nlohmann::json json;  // the primitive
};

struct DrawnGlb {
  nlohmann::json json, extras;  // of all, of the node
  std::vector<DrawnPart> parts;

  /// An accessor of indices.
  std::vector<std::uint32_t> indices(std::size_t accessor) const;
  std::vector<std::uint8_t> numbers;  // the binary chunk
};

/// Fails the test where a length does not fit.
DrawnGlb read_glb(const std::vector<std::uint8_t>&);

/// The farthest that posts are from a surface that is drawn straight through space, vertically, and
/// how many it has. On a parallel, straight edges leave it: posts in that sliver are the next
/// tile's.
struct DrawnError {
  double worst_m = 0;
  int posts = 0;
};
/// Of every post in `rect`.
DrawnError drawn_error(const DrawnPart& surface, const MadeUpSource&, const GeoRect& rect);

}  // namespace tind::test
