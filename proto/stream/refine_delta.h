#pragma once
// What POST /refine answers: a mesh, or what leads to it from the last one (docs/formats.md,
// "Refined meshes").

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "terrain/base/result.h"

namespace tind::proto {

/// Ids are the server's and mean nothing else. Every list ascends by id.
struct RefineDelta {
  struct Vertex {
    std::uint32_t id;
    std::array<float, 3> at;  // metres east, north and up of (lon, lat, 0)
    friend bool operator==(const Vertex&, const Vertex&) = default;
  };
  struct Triangle {
    std::uint32_t id;
    std::array<std::uint32_t, 3> corners;  // ids of vertices, counter-clockwise from above
    friend bool operator==(const Triangle&, const Triangle&) = default;
  };
  bool whole = false;  // forget what there was; nothing is removed
  std::string view;    // the token of this view; at most 255 bytes; empty for a region
  double lon = 0, lat = 0;
  std::vector<std::uint32_t> removed_triangles, removed_vertices;
  std::vector<Vertex> vertices;
  std::vector<Triangle> triangles;
  friend bool operator==(const RefineDelta&, const RefineDelta&) = default;
};

std::string encode(const RefineDelta&);
/// bad_data where something is wrong; never trusts a count.
Result<RefineDelta> decode_refine_delta(std::string_view bytes);

}  // namespace tind::proto
