// PLY, OBJ and STL writers (mesh_io.h). Numbers in text are the shortest that read back as the same
// double (std::to_chars); binary is little endian.

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "proto/mesh/mesh_io.h"
#include "proto/text_put.h"
#include "terrain/base/bytes.h"

namespace tind::proto {
namespace {

template <Number T>
void put(std::string& out, T value) {
  ByteWriter(out).put(value);
}

using text::one_line;
using text::put_text;

std::uint8_t to_byte(float channel) {
  return std::uint8_t(std::lround(std::clamp(channel, 0.0f, 1.0f) * 255));
}

// ---- ply ----

std::string ply_header(const Mesh& m, const PlyOptions& options) {
  const char* position = options.float_positions ? "float" : "double";
  const char* channel = options.float_colours ? "float" : "uchar";
  std::string h = "ply\nformat binary_little_endian 1.0\ncomment tind\n";
  for (const std::string& line : place_lines(m.place)) h += "comment " + one_line(line) + "\n";
  if (!m.texture.empty()) h += "comment TextureFile " + one_line(m.texture) + "\n";
  h += "element vertex " + std::to_string(m.positions.size()) + "\n";
  const auto property = [&](const char* type, const char* name) {
    h += std::string("property ") + type + " " + name + "\n";
  };
  for (const char* name : {"x", "y", "z"}) property(position, name);
  if (!m.normals.empty())
    for (const char* name : {"nx", "ny", "nz"}) property("float", name);
  if (!m.colours.empty())
    for (const char* name : {"red", "green", "blue"}) property(channel, name);
  if (!m.texcoords.empty())
    for (const char* name : {"s", "t"}) property("float", name);
  h += "element face " + std::to_string(m.triangles.size()) + "\n";
  h += "property list uchar int vertex_indices\nend_header\n";
  return h;
}

// ---- obj ----

template <class Row>
void put_row(std::string& out, const char* word, const Row& row) {
  out += word;
  for (const auto x : row) {
    out += ' ';
    put_text(out, x);
  }
}

void put_face(std::string& out, const Mesh& m, const std::array<std::uint32_t, 3>& triangle) {
  const bool uv = !m.texcoords.empty(), normal = !m.normals.empty();
  out += 'f';
  for (const std::uint32_t index : triangle) {
    out += ' ';
    put_text(out, index + 1);
    if (uv || normal) out += '/';
    if (uv) put_text(out, index + 1);
    if (normal) {
      out += '/';
      put_text(out, index + 1);
    }
  }
  out += '\n';
}

// ---- stl ----

/// Zero where float32 resolves the mesh well anyway, else the middle in whole units.
std::array<double, 3> middle_or_zero(const Mesh& m) {
  std::array<double, 3> low, high, origin{};
  low.fill(std::numeric_limits<double>::infinity());
  high.fill(-std::numeric_limits<double>::infinity());
  for (const auto& p : m.positions)
    for (int i = 0; i < 3; ++i) {
      low[i] = std::min(low[i], p[i]);
      high[i] = std::max(high[i], p[i]);
    }
  if (m.positions.empty()) return origin;
  const double size = std::hypot(high[0] - low[0], high[1] - low[1], high[2] - low[2]);
  for (int i = 0; i < 3; ++i)
    if (std::max(std::abs(low[i]), std::abs(high[i])) > 16 * size)
      origin[i] = std::round((low[i] + high[i]) / 2);
  return origin;
}

using Float3 = std::array<float, 3>;

Float3 face_normal(const Float3& a, const Float3& b, const Float3& c) {
  const double x1 = double(b[0]) - a[0], y1 = double(b[1]) - a[1], z1 = double(b[2]) - a[2];
  const double x2 = double(c[0]) - a[0], y2 = double(c[1]) - a[1], z2 = double(c[2]) - a[2];
  const double x = y1 * z2 - z1 * y2, y = z1 * x2 - x1 * z2, z = x1 * y2 - y1 * x2;
  const double length = std::hypot(x, y, z);
  if (!(length > 0)) return {};
  return {float(x / length), float(y / length), float(z / length)};
}

}  // namespace

std::string encode_ply(const Mesh& m, const PlyOptions& options) {
  std::string out = ply_header(m, options);
  out.reserve(out.size() + m.positions.size() * 56 + m.triangles.size() * 13);
  for (std::size_t i = 0; i < m.positions.size(); ++i) {
    for (const double x : m.positions[i])
      options.float_positions ? put(out, float(x)) : put(out, x);
    if (!m.normals.empty())
      for (const float x : m.normals[i]) put(out, x);
    if (!m.colours.empty())
      for (const float x : m.colours[i]) options.float_colours ? put(out, x) : put(out, to_byte(x));
    if (!m.texcoords.empty())
      for (const float x : m.texcoords[i]) put(out, x);
  }
  for (const auto& triangle : m.triangles) {
    out += char(3);
    for (const std::uint32_t index : triangle) put(out, index);
  }
  return out;
}

std::string encode_obj(const Mesh& m, std::string_view material_library) {
  std::string out = "# tind\n";
  for (const std::string& line : place_lines(m.place)) out += "# " + one_line(line) + "\n";
  out.reserve(out.size() + m.positions.size() * 60 + m.triangles.size() * 28);
  if (!material_library.empty())
    out += "mtllib " + one_line(material_library) + "\nusemtl surface\n";
  for (std::size_t i = 0; i < m.positions.size(); ++i) {
    put_row(out, "v", m.positions[i]);
    if (!m.colours.empty()) put_row(out, "", m.colours[i]);
    out += '\n';
  }
  for (const auto& st : m.texcoords) put_row(out, "vt", st), out += '\n';
  for (const auto& normal : m.normals) put_row(out, "vn", normal), out += '\n';
  for (const auto& triangle : m.triangles) put_face(out, m, triangle);
  return out;
}

std::array<double, 3> stl_origin(const Mesh& m) { return middle_or_zero(m); }

Stl encode_stl(const Mesh& m) {
  Stl stl{.bytes = "tind origin", .origin = stl_origin(m)};
  for (const double x : stl.origin) put_text(stl.bytes += ' ', x);
  stl.bytes.resize(80, ' ');
  put(stl.bytes, std::uint32_t(m.triangles.size()));
  stl.bytes.reserve(84 + 50 * m.triangles.size());
  const auto local = [&](std::uint32_t index) {
    Float3 p;
    for (int i = 0; i < 3; ++i) p[i] = float(m.positions[index][i] - stl.origin[i]);
    return p;
  };
  for (const auto& [a, b, c] : m.triangles) {
    const Float3 corners[] = {local(a), local(b), local(c)};
    for (const float x : face_normal(corners[0], corners[1], corners[2])) put(stl.bytes, x);
    for (const Float3& corner : corners)
      for (const float x : corner) put(stl.bytes, x);
    put(stl.bytes, std::uint16_t(0));
  }
  return stl;
}

Mesh as_in_stl(Mesh m) {
  const std::array<double, 3> origin = stl_origin(m);
  for (auto& p : m.positions)
    for (std::size_t i = 0; i < 3; ++i) p[i] = origin[i] + double(float(p[i] - origin[i]));
  return m;
}

std::string encode_mtl(const Mesh& m) {
  return "newmtl surface\nKd 1 1 1\nmap_Kd " + one_line(m.texture) + "\n";
}

}  // namespace tind::proto
