// quantized-mesh-1.0 as bytes (CesiumGS/quantized-mesh specification, and docs/formats.md for the
// places where readers differ).
//
//   0   header: 3 f64 centre, 2 f32 heights, 4 f64 sphere, 3 f64 horizon occlusion point
//   88  u32 n, then u[n], v[n], h[n] as zig-zag deltas, u16
//       two bytes of padding when indices are 32-bit and n is odd
//       u32 triangles, then their indices, high-water-mark coded, 16 or 32 bits
//       four edge lists W S E N: u32 count, plain indices of the same width
//       extensions: u8 id, u32 length, bytes
//
// Everything is little endian. One walk over the layout (`Walk`) serves decode and
// strip_extensions, so both agree on where a tile ends.

#include "proto/tile/quantized_mesh.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>

#include "terrain/base/bytes.h"

namespace tind::proto {
namespace {

constexpr std::size_t kHeaderBytes = 88;
constexpr std::size_t kLargest16Bit = 65536;  // vertices that 16-bit indices can still name
constexpr std::uint16_t kMax = 32767;
constexpr std::uint8_t kNormals = 1, kWaterMask = 2, kMetadata = 4;

// ---- writing -----------------------------------------------------------------------------------

using Writer = ByteWriter<>;

std::size_t padding(std::size_t vertices) {
  return vertices > kLargest16Bit && vertices % 2 == 1 ? 2 : 0;
}

std::size_t extension_size(std::size_t payload) { return payload ? 5 + payload : 0; }

std::size_t encoded_size(const QuantizedMesh& m) {
  const std::size_t n = m.u.size(), index = n > kLargest16Bit ? 4 : 2;
  const std::size_t indices =
      3 * m.triangles.size() + m.west.size() + m.south.size() + m.east.size() + m.north.size();
  return kHeaderBytes + 4 + 6 * n + padding(n) + 5 * 4 + index * indices +
         extension_size(2 * m.oct_normals.size()) + extension_size(m.water_mask.size()) +
         extension_size(m.metadata.empty() ? 0 : 4 + m.metadata.size());
}

void put_header(Writer& out, const QuantizedMesh& m) {
  for (double x : m.center) out.put(x);
  out.put(m.min_height);
  out.put(m.max_height);
  for (double x : m.bounding_sphere) out.put(x);
  for (double x : m.horizon_occlusion) out.put(x);
}

void put_deltas(Writer& out, std::span<const std::uint16_t> values) {
  std::int32_t last = 0;
  for (const std::int32_t value : values) {
    const std::int32_t delta = value - last;
    out.put(std::uint16_t((delta << 1) ^ (delta >> 31)));
    last = value;
  }
}

template <class Index>
void put_triangles(Writer& out, const QuantizedMesh& m) {
  std::uint32_t highest = 0;
  for (const auto& triangle : m.triangles)
    for (const std::uint32_t index : triangle) {
      assert(index <= highest && index < m.u.size());
      assert(highest - index <= std::numeric_limits<Index>::max());
      out.put(Index(highest - index));
      highest += index == highest;
    }
}

template <class Index>
void put_edge(Writer& out, std::span<const std::uint32_t> edge) {
  out.put(std::uint32_t(edge.size()));
  for (const std::uint32_t index : edge) out.put(Index(index));
}

template <class Index>
void put_indices(Writer& out, const QuantizedMesh& m) {
  out.put(std::uint32_t(m.triangles.size()));
  put_triangles<Index>(out, m);
  for (const auto* edge : {&m.west, &m.south, &m.east, &m.north}) put_edge<Index>(out, *edge);
}

void put_extension(Writer& out, std::uint8_t id, const void* data, std::size_t size) {
  if (!size) return;
  out.put(id);
  out.put(std::uint32_t(size));
  out.put_bytes(data, size);
}

void put_metadata(Writer& out, const std::string& json) {
  if (json.empty()) return;
  out.put(kMetadata);
  out.put(std::uint32_t(4 + json.size()));
  out.put(std::uint32_t(json.size()));
  out.put_bytes(json.data(), json.size());
}

// ---- reading -----------------------------------------------------------------------------------

/// Where the parts of a tile lie, every size checked against the bytes that are there.
struct Walk {
  explicit Walk(std::span<const std::uint8_t> the_bytes) : bytes(the_bytes) {}

  std::span<const std::uint8_t> bytes;
  std::string error;
  std::size_t at = 0;

  std::size_t vertices = 0, triangles = 0, index_size = 2;
  std::size_t vertex_data = 0, index_data = 0;
  std::array<std::size_t, 4> edge_data{}, edge_count{};

  bool reject(std::string why) {
    error = std::move(why);
    return false;
  }
  bool need(std::size_t size, const char* part) {
    if (size <= bytes.size() - at) return true;
    return reject("truncated: " + std::string(part) + " at byte " + std::to_string(at) + " needs " +
                  std::to_string(size) + " bytes, " + std::to_string(bytes.size() - at) +
                  " are left");
  }
  bool count(std::size_t& value, const char* part) {
    if (!need(4, part)) return false;
    value = load<std::uint32_t>(&bytes[at]);
    at += 4;
    return true;
  }
  bool array(std::size_t count_, std::size_t size, std::size_t& begin, const char* part) {
    if (!need(count_ * size, part)) return false;  // below 2^32 * 12: no overflow
    begin = at;
    at += count_ * size;
    return true;
  }

  bool up_to_extensions() {
    if (bytes.size() >= 2 && bytes[0] == 0x1f && bytes[1] == 0x8b)
      return reject("this is gzip, not quantized-mesh: decompress it first");
    if (!need(kHeaderBytes, "header")) return false;
    at = kHeaderBytes;
    if (!count(vertices, "vertex count")) return false;
    if (!array(vertices, 6, vertex_data, "vertices")) return false;
    index_size = vertices > kLargest16Bit ? 4 : 2;
    if (!need(padding(vertices), "padding")) return false;
    at += padding(vertices);
    if (!count(triangles, "triangle count")) return false;
    if (!array(triangles, 3 * index_size, index_data, "triangles")) return false;
    static constexpr const char* kSides[] = {"west edge", "south edge", "east edge", "north edge"};
    for (int side = 0; side < 4; ++side) {
      if (!count(edge_count[side], kSides[side])) return false;
      if (!array(edge_count[side], index_size, edge_data[side], kSides[side])) return false;
    }
    return true;
  }

  struct Extension {
    std::uint8_t id = 0;
    std::size_t begin = 0, end = 0;  // payload
  };

  /// REQUIRES: at < bytes.size(). The length is little endian; tiles of the retired `vertexnormals`
  /// extension have it big endian, which is recognised by the one size that normals can have.
  bool extension(Extension& e) {
    if (!need(5, "extension")) return false;
    e.id = bytes[at];
    std::size_t size = load<std::uint32_t>(&bytes[at + 1]);
    const std::size_t swapped = load<std::uint32_t, std::endian::big>(&bytes[at + 1]);
    if (e.id == kNormals && size != 2 * vertices && swapped == 2 * vertices) big_endian_ = true;
    if (big_endian_) size = swapped;
    at += 5;
    if (!need(size, "extension")) return false;
    e.begin = at;
    e.end = at += size;
    return true;
  }

 private:
  bool big_endian_ = false;
};

bool read_header(Walk& walk, QuantizedMesh& m) {
  const std::uint8_t* p = walk.bytes.data();
  for (int i = 0; i < 3; ++i) m.center[i] = load<double>(p + 8 * i);
  m.min_height = load<float>(p + 24);
  m.max_height = load<float>(p + 28);
  for (int i = 0; i < 4; ++i) m.bounding_sphere[i] = load<double>(p + 32 + 8 * i);
  for (int i = 0; i < 3; ++i) m.horizon_occlusion[i] = load<double>(p + 64 + 8 * i);
  const auto finite = [](double x) { return std::isfinite(x); };
  if (!std::ranges::all_of(m.center, finite)) return walk.reject("the centre is not finite");
  if (!std::isfinite(m.min_height) || !std::isfinite(m.max_height))
    return walk.reject("the minimum or maximum height is not finite");
  if (m.min_height > m.max_height)
    return walk.reject("the minimum height is above the maximum height");
  if (!std::ranges::all_of(m.bounding_sphere, finite) || m.bounding_sphere[3] < 0)
    return walk.reject("the bounding sphere is not finite");
  if (!std::ranges::all_of(m.horizon_occlusion, finite))
    return walk.reject("the horizon occlusion point is not finite");
  return true;
}

bool read_deltas(Walk& walk, std::size_t begin, const char* name, std::vector<std::uint16_t>& out) {
  out.resize(walk.vertices);
  const std::uint8_t* p = walk.bytes.data() + begin;
  std::int32_t value = 0;
  for (std::size_t i = 0; i < walk.vertices; ++i, p += 2) {
    const std::int32_t code = load<std::uint16_t>(p);
    value += (code >> 1) ^ -(code & 1);
    if (value < 0 || value > kMax)
      return walk.reject(std::string(name) + " of vertex " + std::to_string(i) + " is " +
                         std::to_string(value) + ", outside 0..32767");
    out[i] = std::uint16_t(value);
  }
  return true;
}

template <class Index>
bool read_triangles(Walk& walk, QuantizedMesh& m) {
  m.triangles.resize(walk.triangles);
  const std::uint8_t* p = walk.bytes.data() + walk.index_data;
  std::uint32_t highest = 0;
  for (std::size_t t = 0; t < walk.triangles; ++t)
    for (std::uint32_t& index : m.triangles[t]) {
      const std::uint32_t code = load<Index>(p);
      p += sizeof(Index);
      index = highest - code;
      if (code > highest || index >= walk.vertices)
        return walk.reject("triangle " + std::to_string(t) + " names a vertex that is not there");
      highest += code == 0;
    }
  return true;
}

template <class Index>
bool read_edges(Walk& walk, QuantizedMesh& m) {
  std::vector<std::uint32_t>* const edges[] = {&m.west, &m.south, &m.east, &m.north};
  for (int side = 0; side < 4; ++side) {
    const std::uint8_t* p = walk.bytes.data() + walk.edge_data[side];
    edges[side]->resize(walk.edge_count[side]);
    for (std::uint32_t& index : *edges[side]) {
      index = load<Index>(p);
      p += sizeof(Index);
      if (index >= walk.vertices)
        return walk.reject("an edge list names vertex " + std::to_string(index) + " of " +
                           std::to_string(walk.vertices));
    }
  }
  return true;
}

bool read_metadata(Walk& walk, std::span<const std::uint8_t> payload, QuantizedMesh& m) {
  if (payload.size() < 4) return walk.reject("the metadata extension has no length");
  const std::size_t size = load<std::uint32_t>(payload.data());
  if (size > payload.size() - 4)
    return walk.reject("the metadata's length " + std::to_string(size) +
                       " is beyond its extension");
  m.metadata.assign(reinterpret_cast<const char*>(payload.data()) + 4, size);
  return true;
}

bool read_extensions(Walk& walk, QuantizedMesh& m) {
  while (walk.at < walk.bytes.size()) {
    Walk::Extension e;
    if (!walk.extension(e)) return false;
    const auto payload = walk.bytes.subspan(e.begin, e.end - e.begin);
    if (e.id == kNormals) {
      if (payload.size() != 2 * walk.vertices)
        return walk.reject("the normals extension has " + std::to_string(payload.size()) +
                           " bytes for " + std::to_string(walk.vertices) + " vertices");
      m.oct_normals.resize(walk.vertices);
      if (!payload.empty()) std::memcpy(m.oct_normals.data(), payload.data(), payload.size());
    } else if (e.id == kWaterMask) {
      if (payload.size() != 1 && payload.size() != 65536)
        return walk.reject("the water mask has " + std::to_string(payload.size()) +
                           " bytes, neither 1 nor 65536");
      m.water_mask.assign(payload.begin(), payload.end());
    } else if (e.id == kMetadata) {
      if (!read_metadata(walk, payload, m)) return false;
    }
  }
  return true;
}

// ---- arranging ---------------------------------------------------------------------------------

constexpr std::uint32_t kUnused = ~std::uint32_t(0);

/// Renames vertices in the order in which triangles use them; returns the old name of each.
std::vector<std::uint32_t> rename_in_first_use_order(QuantizedMesh& m) {
  std::vector<std::uint32_t> new_name(m.u.size(), kUnused), old_name;
  old_name.reserve(m.u.size());
  for (auto& triangle : m.triangles)
    for (std::uint32_t& index : triangle) {
      std::uint32_t& name = new_name[index];
      if (name == kUnused) {
        name = std::uint32_t(old_name.size());
        old_name.push_back(index);
      }
      index = name;
    }
  return old_name;
}

template <class T>
void permute(std::vector<T>& values, std::span<const std::uint32_t> old_name) {
  if (values.empty()) return;
  std::vector<T> sorted(old_name.size());
  for (std::size_t i = 0; i < sorted.size(); ++i) sorted[i] = values[old_name[i]];
  values = std::move(sorted);
}

/// The vertices whose `across` is `side`, by `along`, ties by number.
std::vector<std::uint32_t> edge_list(std::span<const std::uint16_t> across, std::uint16_t side,
                                     std::span<const std::uint16_t> along, bool ascending) {
  std::vector<std::uint32_t> edge;
  for (std::uint32_t i = 0; i < across.size(); ++i)
    if (across[i] == side) edge.push_back(i);
  std::ranges::sort(edge, [&](std::uint32_t a, std::uint32_t b) {
    if (along[a] == along[b]) return a < b;
    return (along[a] < along[b]) == ascending;
  });
  return edge;
}

}  // namespace

void arrange(QuantizedMesh& m) {
  // Once all of so many vertices are known, the first one's code would need a 17th bit.
  if (m.u.size() == kLargest16Bit && !m.triangles.empty())
    std::ranges::stable_partition(m.triangles, [first = m.triangles[0][0]](const auto& t) {
      return std::ranges::find(t, first) != t.end();
    });
  const std::vector<std::uint32_t> old_name = rename_in_first_use_order(m);
  permute(m.u, old_name);
  permute(m.v, old_name);
  permute(m.h, old_name);
  permute(m.oct_normals, old_name);
  m.west = edge_list(m.u, 0, m.v, true);
  m.south = edge_list(m.v, 0, m.u, false);
  m.east = edge_list(m.u, kMax, m.v, false);
  m.north = edge_list(m.v, kMax, m.u, true);
}

std::vector<std::uint8_t> encode(const QuantizedMesh& m) {
  assert(m.v.size() == m.u.size() && m.h.size() == m.u.size());
  assert(m.oct_normals.empty() || m.oct_normals.size() == m.u.size());
  std::vector<std::uint8_t> bytes;
  bytes.reserve(encoded_size(m));
  Writer out(bytes);
  put_header(out, m);
  out.put(std::uint32_t(m.u.size()));
  put_deltas(out, m.u);
  put_deltas(out, m.v);
  put_deltas(out, m.h);
  out.skip(padding(m.u.size()));
  if (m.u.size() > kLargest16Bit)
    put_indices<std::uint32_t>(out, m);
  else
    put_indices<std::uint16_t>(out, m);
  put_extension(out, kNormals, m.oct_normals.data(), 2 * m.oct_normals.size());
  put_extension(out, kWaterMask, m.water_mask.data(), m.water_mask.size());
  put_metadata(out, m.metadata);
  assert(bytes.size() == encoded_size(m));
  return bytes;
}

Result<QuantizedMesh> decode(std::span<const std::uint8_t> bytes) {
  QuantizedMesh m;
  Walk walk(bytes);
  const auto bad = [&] { return fail(Errc::bad_data, walk.error); };
  if (!walk.up_to_extensions() || !read_header(walk, m)) return bad();
  const std::size_t n = walk.vertices, begin = walk.vertex_data;
  if (!read_deltas(walk, begin, "u", m.u) || !read_deltas(walk, begin + 2 * n, "v", m.v) ||
      !read_deltas(walk, begin + 4 * n, "height", m.h))
    return bad();
  const bool indices =
      walk.index_size == 4
          ? read_triangles<std::uint32_t>(walk, m) && read_edges<std::uint32_t>(walk, m)
          : read_triangles<std::uint16_t>(walk, m) && read_edges<std::uint16_t>(walk, m);
  if (!indices || !read_extensions(walk, m)) return bad();
  return m;
}

std::vector<std::uint8_t> strip_extensions(std::span<const std::uint8_t> bytes, Extensions keep) {
  Walk walk(bytes);
  std::vector<std::uint8_t> kept(bytes.begin(), bytes.end());
  if (!walk.up_to_extensions()) return kept;
  std::size_t end = walk.at;
  while (walk.at < bytes.size()) {
    const std::size_t begin = walk.at;
    Walk::Extension e;
    if (!walk.extension(e)) return {bytes.begin(), bytes.end()};
    const bool wanted = (e.id == kNormals && keep.normals) ||
                        (e.id == kWaterMask && keep.water_mask) ||
                        (e.id == kMetadata && keep.metadata);
    if (!wanted) continue;
    std::memmove(kept.data() + end, bytes.data() + begin, walk.at - begin);
    end += walk.at - begin;
  }
  kept.resize(end);
  return kept;
}

}  // namespace tind::proto
