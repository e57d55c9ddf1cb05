// Arrays one behind the other, each with a view and an accessor, aligned to four bytes.
//
// A compressed view says where its bytes are in the binary chunk, and also where they would be if
// they were not compressed: in a second buffer, which is not there ("fallback").

#include "proto/tile/glb_buffer.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <span>

#include "proto/tile/meshopt.h"
#include "terrain/base/bytes.h"

namespace tind::proto {
namespace {

using Json = GlbBuffer::Json;

constexpr int kByte = 5120, kShort = 5123, kInt = 5125, kFloat = 5126;  // component types
constexpr int kVertices = 34962, kIndices = 34963, kNoTarget = 0;       // targets
constexpr std::size_t kLargest16Bit = 65535;  // vertices: the index 65535 restarts a primitive
constexpr const char* kMeshopt = "EXT_meshopt_compression";
constexpr const char* kQuantization = "KHR_mesh_quantization";

void pad(std::vector<std::uint8_t>& bytes) {
  while (bytes.size() % 4 != 0) bytes.push_back(0);
}

Json described(int type, std::size_t count, const char* shape) {
  return {{"componentType", type}, {"count", count}, {"type", shape}};
}

/// Readers want the box of the positions, exactly.
template <class Number>
void add_box(Json& accessor, const std::vector<std::array<float, 3>>& positions) {
  std::array<float, 3> low = positions.front(), high = low;
  for (const auto& p : positions)
    for (std::size_t k = 0; k < 3; ++k) {
      low[k] = std::min(low[k], p[k]);
      high[k] = std::max(high[k], p[k]);
    }
  for (std::size_t k = 0; k < 3; ++k) {
    accessor["min"].push_back(Number(low[k]));
    accessor["max"].push_back(Number(high[k]));
  }
}

std::array<double, 3> octahedral(const std::array<float, 3>& n) {
  const double sum = std::abs(n[0]) + std::abs(n[1]) + std::abs(n[2]);
  if (!(sum > 0)) return {0, 0, 1};
  const double x = n[0] / sum, y = n[1] / sum;
  if (n[2] >= 0) return {x, y};
  return {std::copysign(1 - std::abs(y), x), std::copysign(1 - std::abs(x), y)};
}

std::uint16_t normalized_16(float x) {
  return std::uint16_t(std::lround(std::clamp(x, 0.0f, 1.0f) * 65535));
}

}  // namespace

/// What a compressed view needs beside its bytes.
struct GlbBuffer::Packed {
  std::vector<std::uint8_t> bytes;
  const char* mode;
  std::size_t count, stride;
  int target = kNoTarget;
  const char* filter = nullptr;
};

int GlbBuffer::add_view(std::size_t begin, int target) {
  views_.push_back({{"buffer", 0}, {"byteOffset", begin}, {"byteLength", bytes_.size() - begin}});
  if (target != kNoTarget) views_.back()["target"] = target;
  return int(views_.size() - 1);
}

int GlbBuffer::add_accessor(Json accessor, int view) {
  accessor["bufferView"] = view;
  accessors_.push_back(std::move(accessor));
  return int(accessors_.size() - 1);
}

int GlbBuffer::add_bytes(std::string_view bytes) {
  const std::size_t begin = bytes_.size();
  ByteWriter(bytes_).put_text(bytes);
  return end_view(begin);
}

int GlbBuffer::end_view(std::size_t begin) {
  const int view = add_view(begin, kNoTarget);
  pad(bytes_);
  return view;
}

template <std::size_t N>
int GlbBuffer::add_floats(const std::vector<std::array<float, N>>& values, Json accessor) {
  const std::size_t begin = bytes_.size();
  ByteWriter out(bytes_);
  for (const auto& value : values)
    for (const float x : value) out.put(x);
  return add_accessor(std::move(accessor), add_view(begin, kVertices));
}

template <class Indices>
int GlbBuffer::add_plain_indices(const Indices& indices, std::size_t vertices, int target) {
  const bool small = vertices <= kLargest16Bit;
  const std::size_t begin = bytes_.size();
  ByteWriter out(bytes_);
  for (const std::uint32_t index : indices) {
    assert(index < vertices);
    small ? out.put(std::uint16_t(index)) : out.put(index);
  }
  const int number = add_accessor(described(small ? kShort : kInt, indices.size(), "SCALAR"),
                                  add_view(begin, target));
  pad(bytes_);
  return number;
}

int GlbBuffer::add_packed(Json accessor, const Packed& packed) {
  const std::size_t begin = bytes_.size(), length = packed.count * packed.stride;
  ByteWriter(bytes_).put_bytes(packed.bytes.data(), packed.bytes.size());
  Json view = {{"buffer", 1}, {"byteOffset", unpacked_}, {"byteLength", length}};
  if (packed.target == kVertices) view["byteStride"] = packed.stride;
  if (packed.target != kNoTarget) view["target"] = packed.target;
  Json& where = view["extensions"][kMeshopt];
  where = {{"buffer", 0},
           {"byteOffset", begin},
           {"byteLength", packed.bytes.size()},
           {"byteStride", packed.stride},
           {"count", packed.count},
           {"mode", packed.mode}};
  if (packed.filter) where["filter"] = packed.filter;
  pad(bytes_);
  unpacked_ += (length + 3) / 4 * 4;
  views_.push_back(std::move(view));
  return add_accessor(std::move(accessor), int(views_.size() - 1));
}

int GlbBuffer::add_positions(const std::vector<std::array<float, 3>>& positions) {
  Json accessor = described(meshopt_ ? kShort : kFloat, positions.size(), "VEC3");
  if (!meshopt_) {
    add_box<float>(accessor, positions);
    return add_floats(positions, std::move(accessor));
  }
  add_box<int>(accessor, positions);
  std::vector<std::uint8_t> numbers;
  ByteWriter out(numbers);
  for (const auto& p : positions) {
    for (const float x : p) {
      assert(x >= 0 && x <= 65535 && x == std::trunc(x));
      out.put(std::uint16_t(x));
    }
    out.put(std::uint16_t(0));
  }
  return add_packed(std::move(accessor), {meshopt::encode_vertices(numbers, 8), "ATTRIBUTES",
                                          positions.size(), 8, kVertices});
}

int GlbBuffer::add_normals(const std::vector<std::array<float, 3>>& normals) {
  if (!meshopt_) return add_floats(normals, described(kFloat, normals.size(), "VEC3"));
  constexpr int kOne = 127;
  std::vector<std::uint8_t> numbers;
  ByteWriter out(numbers);
  for (const auto& n : normals) {
    const auto [x, y, z] = octahedral(n);
    out.put(std::int8_t(std::lround(x * kOne)));
    out.put(std::int8_t(std::lround(y * kOne)));
    out.put(std::int8_t(kOne));
    out.put(std::int8_t(0));
  }
  Json accessor = described(kByte, normals.size(), "VEC3");
  accessor["normalized"] = true;
  return add_packed(std::move(accessor), {meshopt::encode_vertices(numbers, 4), "ATTRIBUTES",
                                          normals.size(), 4, kVertices, "OCTAHEDRAL"});
}

int GlbBuffer::add_colours(const std::vector<std::array<float, 3>>& colours) {
  if (!meshopt_) return add_floats(colours, described(kFloat, colours.size(), "VEC3"));
  std::vector<std::uint8_t> numbers;  // 16 bits: of 8, dark colours of light would be bands
  ByteWriter out(numbers);
  for (const auto& colour : colours) {
    for (const float x : colour) out.put(normalized_16(x));
    out.put(std::uint16_t(0));
  }
  Json accessor = described(kShort, colours.size(), "VEC3");
  accessor["normalized"] = true;
  return add_packed(std::move(accessor), {meshopt::encode_vertices(numbers, 8), "ATTRIBUTES",
                                          colours.size(), 8, kVertices});
}

int GlbBuffer::add_texcoords(const std::vector<std::array<float, 2>>& texcoords) {
  if (!meshopt_) return add_floats(texcoords, described(kFloat, texcoords.size(), "VEC2"));
  std::vector<std::uint8_t> numbers;
  ByteWriter out(numbers);
  for (const auto& t : texcoords)
    for (const float x : t) out.put(normalized_16(x));
  Json accessor = described(kShort, texcoords.size(), "VEC2");
  accessor["normalized"] = true;
  return add_packed(std::move(accessor), {meshopt::encode_vertices(numbers, 4), "ATTRIBUTES",
                                          texcoords.size(), 4, kVertices});
}

int GlbBuffer::add_features(const std::vector<std::uint16_t>& features) {
  Json accessor = described(kFloat, features.size(), "SCALAR");
  std::vector<std::array<float, 1>> values;
  values.reserve(features.size());
  for (const std::uint16_t feature : features) values.push_back({float(feature)});
  if (!meshopt_) return add_floats(values, std::move(accessor));
  std::vector<std::uint8_t> numbers;
  ByteWriter out(numbers);
  for (const auto& [value] : values) out.put(value);
  return add_packed(std::move(accessor), {meshopt::encode_vertices(numbers, 4), "ATTRIBUTES",
                                          values.size(), 4, kVertices});
}

int GlbBuffer::add_triangles(const std::vector<std::array<std::uint32_t, 3>>& triangles,
                             std::size_t vertices) {
  std::vector<std::uint32_t> indices;
  indices.reserve(3 * triangles.size());
  for (const auto& t : triangles) indices.insert(indices.end(), t.begin(), t.end());
  if (!meshopt_) return add_plain_indices(indices, vertices, kIndices);
  const bool small = vertices <= kLargest16Bit;
  return add_packed(described(small ? kShort : kInt, indices.size(), "SCALAR"),
                    {meshopt::encode_triangles(indices, vertices), "TRIANGLES", indices.size(),
                     small ? 2u : 4u, kIndices});
}

int GlbBuffer::add_indices(const std::vector<std::uint32_t>& indices, std::size_t vertices) {
  if (!meshopt_) return add_plain_indices(indices, vertices, kNoTarget);
  const bool small = vertices <= kLargest16Bit;
  return add_packed(
      described(small ? kShort : kInt, indices.size(), "SCALAR"),
      {meshopt::encode_indices(indices, vertices), "INDICES", indices.size(), small ? 2u : 4u});
}

Json GlbBuffer::required_extensions() const {
  return meshopt_ ? Json::array({kMeshopt, kQuantization}) : Json::array();
}

void GlbBuffer::put_into(Json& gltf) {
  gltf["buffers"] = Json::array({Json{{"byteLength", bytes_.size()}}});
  if (unpacked_ > 0) {
    Json fallback = {{"byteLength", unpacked_}};
    fallback["extensions"][kMeshopt]["fallback"] = true;
    gltf["buffers"].push_back(std::move(fallback));
  }
  gltf["bufferViews"] = std::move(views_);
  gltf["accessors"] = std::move(accessors_);
}

}  // namespace tind::proto
