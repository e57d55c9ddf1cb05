#pragma once
// The numbers of a GLB and what describes them: its binary chunk, buffers, buffer views and
// accessors. As floats, or as small integers under EXT_meshopt_compression.

#include <array>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <string_view>
#include <vector>

#include "terrain/base/bytes.h"

namespace tind::proto {

/// Each function that adds something returns its number: of an accessor, or of a view.
class GlbBuffer {
 public:
  using Json = nlohmann::ordered_json;

  explicit GlbBuffer(bool meshopt) : meshopt_(meshopt) {}

  int add_positions(
      const std::vector<std::array<float, 3>>&);  // REQUIRES, compressed: as Glb has it
  int add_normals(const std::vector<std::array<float, 3>>&);
  int add_colours(const std::vector<std::array<float, 3>>&);
  int add_texcoords(const std::vector<std::array<float, 2>>&);
  /// One whole number a vertex, as floats: in 16 bits each would need two more to fill up four,
  /// which loaders.gl (4.3) takes for numbers, too.
  int add_features(const std::vector<std::uint16_t>&);
  int add_triangles(const std::vector<std::array<std::uint32_t, 3>>&, std::size_t vertices);
  int add_indices(const std::vector<std::uint32_t>&, std::size_t vertices);  // of no triangles
  int add_bytes(std::string_view);                                           // a view
  template <class T>
  int add_values(const std::vector<T>& values) {  // a view
    const std::size_t begin = bytes_.size();
    ByteWriter out(bytes_);
    for (const T value : values) out.put(value);
    return end_view(begin);
  }

  /// Names of the extensions that a reader must know.
  Json required_extensions() const;
  /// Puts buffers, bufferViews and accessors; once, at the end.
  void put_into(Json& gltf);
  /// The binary chunk.
  const std::vector<std::uint8_t>& bytes() const { return bytes_; }

 private:
  struct Packed;
  const bool meshopt_;
  std::vector<std::uint8_t> bytes_;
  std::size_t unpacked_ = 0;  // bytes that a reader needs for what is compressed
  Json views_ = Json::array(), accessors_ = Json::array();

  int add_view(std::size_t begin, int target);
  int end_view(std::size_t begin);
  int add_accessor(Json accessor, int view);
  template <std::size_t N>
  int add_floats(const std::vector<std::array<float, N>>&, Json accessor);
  template <class Indices>
  int add_plain_indices(const Indices&, std::size_t vertices, int target);
  int add_packed(Json accessor, const Packed&);
};

}  // namespace tind::proto
