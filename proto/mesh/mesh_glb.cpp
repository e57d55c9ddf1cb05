// A mesh as GLB. Its numbers have 24 bits, a UTM northing has more. But most vertices of a terrain
// lie on posts, or on simple fractions between them, so columns and rows are written: small
// numbers, exact in 32 bits. The node's matrix, whose numbers are text, makes coordinates of them.

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <nlohmann/json.hpp>

#include "proto/mesh/mesh_io.h"
#include "proto/tile/glb.h"

namespace tind::proto {
namespace {

using Vec = std::array<double, 3>;

double dot(const Vec& a, const Vec& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

/// origin + x axes[0] + y axes[1] + z axes[2]; orthogonal.
struct Frame {
  Vec origin{};
  std::array<Vec, 3> axes{{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};

  Vec out(const Vec& p) const {
    Vec q;
    for (std::size_t i = 0; i < 3; ++i)
      q[i] = origin[i] + p[0] * axes[0][i] + p[1] * axes[1][i] + p[2] * axes[2][i];
    return q;
  }
  Vec in(const Vec& q) const {
    const Vec d = {q[0] - origin[0], q[1] - origin[1], q[2] - origin[2]};
    Vec p;
    for (std::size_t i = 0; i < 3; ++i) p[i] = dot(d, axes[i]) / dot(axes[i], axes[i]);
    return p;
  }
  /// Normals go by the inverse of the transpose.
  std::array<float, 3> normal_in(const std::array<float, 3>& n) const {
    Vec p;
    for (std::size_t i = 0; i < 3; ++i) p[i] = dot({n[0], n[1], n[2]}, axes[i]);
    const double length = std::sqrt(dot(p, p));
    if (!(length > 0)) return n;
    return {float(p[0] / length), float(p[1] / length), float(p[2] / length)};
  }
  bool turns_over() const { return axes[0][0] * axes[1][1] - axes[0][1] * axes[1][0] < 0; }
};

/// Columns to the right, rows down; heights as they are.
bool frame_of_lattice(const MeshPlace& place, Frame& frame) {
  const auto& [x0, x_col, x_row, y0, y_col, y_row] = place.lattice;
  frame.origin = {x0, y0, 0};
  frame.axes = {{{x_col, y_col, 0}, {-x_row, -y_row, 0}, {0, 0, 1}}};
  const double a = dot(frame.axes[0], frame.axes[0]), b = dot(frame.axes[1], frame.axes[1]);
  return a > 0 && b > 0 && std::abs(dot(frame.axes[0], frame.axes[1])) < 1e-9 * std::sqrt(a * b);
}

/// Heights of posts are 32-bit numbers already, and stay what they are; others keep more digits
/// around their middle.
bool heights_fit(const Mesh& m) {
  return std::ranges::all_of(m.positions, [](const Vec& p) { return double(float(p[2])) == p[2]; });
}

Frame frame_of(const Mesh& m) {
  Frame frame;
  const bool lattice = frame_of_lattice(m.place, frame);
  if (lattice && heights_fit(m)) return frame;
  Vec low, high;
  low.fill(std::numeric_limits<double>::infinity());
  high.fill(-std::numeric_limits<double>::infinity());
  for (const Vec& p : m.positions)
    for (std::size_t i = 0; i < 3; ++i) {
      low[i] = std::min(low[i], p[i]);
      high[i] = std::max(high[i], p[i]);
    }
  if (!lattice) frame = {};
  for (std::size_t i = lattice ? 2 : 0; i < 3 && !m.positions.empty(); ++i)
    frame.origin[i] = std::round((low[i] + high[i]) / 2);
  return frame;
}

std::array<float, 3> narrow(const Vec& p) { return {float(p[0]), float(p[1]), float(p[2])}; }

/// Pictures are sRGB, vertex colours of glTF are linear.
float linear(float c) {
  c = std::min(std::max(c, 0.0f), 1.0f);
  return c <= 0.04045f ? c / 12.92f : float(std::pow((double(c) + 0.055) / 1.055, 2.4));
}

/// The lines of place_lines, and the WKT beside a code. All values are text: assimp 5.2 cannot
/// export extras with arrays.
std::string extras_of(const MeshPlace& place) {
  nlohmann::ordered_json j = nlohmann::ordered_json::object();
  for (const std::string& line : place_lines(place)) {
    const std::size_t colon = line.find(": ");
    std::string key = line.substr(0, colon);
    std::ranges::replace(key, ' ', '_');
    j[key] = line.substr(colon + 2);
  }
  if (!place.crs_wkt.empty()) j[place.local ? "origin_crs_wkt" : "crs_wkt"] = place.crs_wkt;
  return j.empty() ? std::string()
                   : j.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

/// Of the file, or some more.
std::uint64_t most_bytes(const Mesh& m) {
  constexpr std::uint64_t kText = 1 << 20;
  return 12 * (std::uint64_t(m.positions.size()) + m.normals.size() + m.colours.size() +
               m.triangles.size()) +
         8 * std::uint64_t(m.texcoords.size()) + 2 * m.place.crs_wkt.size() + kText;
}

}  // namespace

Result<std::string> encode_glb(const Mesh& m) {
  if (m.triangles.empty())
    return fail(Errc::invalid_argument, "a mesh without triangles cannot be GLB");
  if (most_bytes(m) > std::numeric_limits<std::uint32_t>::max())
    return fail(Errc::out_of_range,
                "a GLB has 4 GiB at most, its lengths are 32-bit: fewer triangles, or PLY");
  const Frame frame = frame_of(m);
  Glb glb;
  glb.origin = frame.origin;
  glb.axes = frame.axes;
  glb.positions.reserve(m.positions.size());
  for (const Vec& p : m.positions) glb.positions.push_back(narrow(frame.in(p)));
  for (const auto& n : m.normals) glb.normals.push_back(frame.normal_in(n));
  for (const auto& [r, g, b] : m.colours) glb.colours.push_back({linear(r), linear(g), linear(b)});
  for (const auto& [s, t] : m.texcoords) glb.texcoords.push_back({s, 1 - t});
  if (!m.texcoords.empty()) glb.texture = m.texture;
  glb.triangles = m.triangles;
  if (frame.turns_over())
    for (auto& t : glb.triangles) std::swap(t[1], t[2]);
  glb.extras = extras_of(m.place);
  const std::vector<std::uint8_t> bytes = encode(glb);
  return std::string(bytes.begin(), bytes.end());
}

Mesh as_in_glb(Mesh m) {
  const Frame frame = frame_of(m);
  for (Vec& p : m.positions) {
    const auto [x, y, z] = narrow(frame.in(p));
    p = frame.out({x, y, z});
  }
  return m;
}

}  // namespace tind::proto
