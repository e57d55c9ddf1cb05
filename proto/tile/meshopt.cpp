// All three coders take whole numbers and work in whole numbers, so that their bytes are the same
// on every machine. The library's other functions (orders of triangles by floats) are not used.

#include "proto/tile/meshopt.h"

#include <meshoptimizer.h>

#include <cassert>

namespace tind::proto::meshopt {
namespace {

/// The versions that the extension's text demands. The library keeps them in global variables, so
/// they are set once.
void demand_versions() {
  [[maybe_unused]] static const bool once = [] {
    meshopt_encodeVertexVersion(0);
    meshopt_encodeIndexVersion(1);
    return true;
  }();
}

}  // namespace

std::vector<std::uint8_t> encode_vertices(std::span<const std::uint8_t> bytes, std::size_t stride) {
  assert(stride > 0 && stride % 4 == 0 && stride <= 256 && bytes.size() % stride == 0);
  demand_versions();
  const std::size_t count = bytes.size() / stride;
  std::vector<std::uint8_t> out(meshopt_encodeVertexBufferBound(count, stride));
  out.resize(meshopt_encodeVertexBuffer(out.data(), out.size(), bytes.data(), count, stride));
  return out;
}

std::vector<std::uint8_t> encode_triangles(std::span<const std::uint32_t> indices,
                                           std::size_t vertices) {
  assert(indices.size() % 3 == 0);
  demand_versions();
  std::vector<std::uint8_t> out(meshopt_encodeIndexBufferBound(indices.size(), vertices));
  out.resize(meshopt_encodeIndexBuffer(out.data(), out.size(), indices.data(), indices.size()));
  return out;
}

std::vector<std::uint8_t> encode_indices(std::span<const std::uint32_t> indices,
                                         std::size_t vertices) {
  demand_versions();
  std::vector<std::uint8_t> out(meshopt_encodeIndexSequenceBound(indices.size(), vertices));
  out.resize(meshopt_encodeIndexSequence(out.data(), out.size(), indices.data(), indices.size()));
  return out;
}

}  // namespace tind::proto::meshopt
