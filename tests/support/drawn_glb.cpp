#include "tests/support/drawn_glb.h"

#include <gtest/gtest.h>
#include <meshoptimizer.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "terrain/base/bytes.h"
#include "terrain/geo/ellipsoid.h"

namespace tind::test {
namespace {

using Json = nlohmann::json;
using Bytes = std::vector<std::uint8_t>;

constexpr const char* kMeshopt = "EXT_meshopt_compression";

std::size_t size_of(const Json& component) {
  switch (component.get<int>()) {
    case 5120:
    case 5121:
      return 1;
    case 5122:
    case 5123:
      return 2;
    default:
      return 4;
  }
}
std::size_t shape_of(const Json& type) { return type == "VEC3" ? 3 : type == "VEC2" ? 2 : 1; }

Bytes unpack(const Json& extension, const Bytes& numbers) {
  EXPECT_EQ(extension["buffer"], 0);
  const std::size_t begin = extension["byteOffset"], length = extension["byteLength"];
  const std::size_t count = extension["count"], stride = extension["byteStride"];
  EXPECT_LE(begin + length, numbers.size());
  const std::uint8_t* const from = numbers.data() + begin;
  Bytes out(count * stride);
  if (extension["mode"] == "TRIANGLES")
    EXPECT_EQ(meshopt_decodeIndexBuffer(out.data(), count, stride, from, length), 0);
  else if (extension["mode"] == "INDICES")
    EXPECT_EQ(meshopt_decodeIndexSequence(out.data(), count, stride, from, length), 0);
  else
    EXPECT_EQ(meshopt_decodeVertexBuffer(out.data(), count, stride, from, length), 0);
  if (extension.value("filter", "NONE") == "OCTAHEDRAL")
    meshopt_decodeFilterOct(out.data(), count, stride);
  return out;
}

/// Bytes of a view, and from one element to the next.
std::pair<Bytes, std::size_t> view_of(const DrawnGlb& glb, const Json& accessor) {
  const Json& view = glb.json["bufferViews"][accessor["bufferView"].get<std::size_t>()];
  const std::size_t element = size_of(accessor["componentType"]) * shape_of(accessor["type"]);
  const std::size_t stride = view.value("byteStride", element);
  if (view.contains("extensions")) {
    const Json& fallback = glb.json["buffers"][1];
    EXPECT_EQ(fallback["extensions"][kMeshopt]["fallback"], true);
    EXPECT_LE(view["byteOffset"].get<std::size_t>() + view["byteLength"].get<std::size_t>(),
              fallback["byteLength"].get<std::size_t>());
    Bytes bytes = unpack(view["extensions"][kMeshopt], glb.numbers);
    EXPECT_EQ(bytes.size(), view["byteLength"].get<std::size_t>());
    return {std::move(bytes), stride};
  }
  const std::size_t begin = view["byteOffset"], length = view["byteLength"];
  EXPECT_LE(begin + length, glb.numbers.size());
  const auto at = glb.numbers.begin() + std::ptrdiff_t(begin);
  return {Bytes(at, at + std::ptrdiff_t(length)), stride};
}

double number(ByteReader& in, int component, bool normalized) {
  switch (component) {
    case 5120: {
      const double x = in.get<std::int8_t>();
      return normalized ? std::max(x / 127, -1.0) : x;
    }
    case 5123: {
      const double x = in.get<std::uint16_t>();
      return normalized ? x / 65535 : x;
    }
    case 5125:
      return in.get<std::uint32_t>();
    default:
      EXPECT_EQ(component, 5126);
      return in.get<float>();
  }
}

template <std::size_t N>
std::vector<std::array<double, N>> values_of(const DrawnGlb& glb, std::size_t index) {
  const Json& accessor = glb.json["accessors"][index];
  EXPECT_EQ(shape_of(accessor["type"]), N);
  const auto [bytes, stride] = view_of(glb, accessor);
  const std::size_t count = accessor["count"];
  std::vector<std::array<double, N>> values(count);
  for (std::size_t i = 0; i < count; ++i) {
    ByteReader in(std::span<const std::uint8_t>(bytes).subspan(i * stride));
    for (double& x : values[i])
      x = number(in, accessor["componentType"], accessor.value("normalized", false));
    EXPECT_TRUE(in.good());
  }
  return values;
}

DrawnPart part_of(const DrawnGlb& glb, const Json& primitive, const std::vector<double>& m) {
  DrawnPart part;
  part.json = primitive;
  const Json& attributes = primitive["attributes"];
  const auto turned = [&](const std::array<double, 3>& p) {  // glTF's y is up
    const auto row = [&](std::size_t r) { return m[r] * p[0] + m[4 + r] * p[1] + m[8 + r] * p[2]; };
    return Vec3{row(0), -row(2), row(1)};
  };
  for (const auto& p : values_of<3>(glb, attributes["POSITION"]))
    part.vertices.push_back(turned(p) + Vec3{m[12], -m[14], m[13]});
  if (attributes.contains("NORMAL"))
    for (const auto& n : values_of<3>(glb, attributes["NORMAL"])) {
      const Vec3 turn = turned(n);
      part.normals.push_back(turn * (1 / length(turn)));
    }
  if (attributes.contains("TEXCOORD_0"))
    part.texcoords = values_of<2>(glb, attributes["TEXCOORD_0"]);
  const auto indices = glb.indices(primitive["indices"]);
  EXPECT_EQ(indices.size() % 3, 0u);
  for (std::size_t i = 0; i + 2 < indices.size(); i += 3)
    part.triangles.push_back({indices[i], indices[i + 1], indices[i + 2]});
  return part;
}

/// By how much the triangle, drawn straight, is above the place; nothing where it is not over it.
std::optional<double> height_over(const std::array<Vec3, 3>& t, const Vec3& from, const Vec3& up) {
  const Vec3 a = t[0] - from, b = t[1] - from, c = t[2] - from;
  // Seen along `up`, is the place inside? Signed volumes, all of one sign.
  const double ab = dot(up, cross(a, b)), bc = dot(up, cross(b, c)), ca = dot(up, cross(c, a));
  const double all = ab + bc + ca, slack = -1e-9 * std::abs(all);
  if (all <= 0 || ab < slack || bc < slack || ca < slack) return {};
  return dot(up, a * (bc / all) + b * (ca / all) + c * (ab / all));
}

/// Of a DEM's posts: the middle one, and how far others are from it at most.
struct Ball {
  Vec3 center;
  double radius = 0;
};
Ball ball_of(const MadeUpSource& source) {
  const auto ecef = [&](double col, double row) {
    const Vec2 at = source.info().post_to_crs.apply(col, row);
    return wgs84::to_ecef({at.x, at.y}, 0);
  };
  const double right = source.grid().cols() - 1, bottom = source.grid().rows() - 1;
  Ball ball{ecef(right / 2, bottom / 2)};
  for (const Vec3& corner : {ecef(0, 0), ecef(right, 0), ecef(0, bottom), ecef(right, bottom)})
    ball.radius = std::max(ball.radius, length(corner - ball.center));
  return ball;
}

/// Is a triangle certainly over none of them? `up` does not point away from the middle of the
/// earth, but 21 km beside it.
bool is_elsewhere(const std::array<Vec3, 3>& t, const Ball& ball) {
  constexpr double kBeside_m = 60000;
  for (std::size_t k = 0; k < 3; ++k) {
    const Vec3 across = cross(t[k], t[(k + 1) % 3]);
    if (dot(across, ball.center) < -(ball.radius + kBeside_m) * length(across)) return true;
  }
  return false;
}

/// Columns and rows of posts that a triangle may be over.
struct Window {
  int west, east, north, south;
};
Window window_of(const std::array<Vec3, 3>& t, const MadeUpSource& source) {
  const HeightGrid& grid = source.grid();
  double low_x = HUGE_VAL, low_y = HUGE_VAL, high_x = -HUGE_VAL, high_y = -HUGE_VAL;
  for (const Vec3& corner : t) {
    const Geographic p = wgs84::from_ecef(corner).p;
    const Vec2 post = source.info().post_to_crs.invert(p.lon, p.lat);
    low_x = std::min(low_x, post.x), high_x = std::max(high_x, post.x);
    low_y = std::min(low_y, post.y), high_y = std::max(high_y, post.y);
  }
  const double wide = 1 + (high_x - low_x) / 4,
               tall = 1 + (high_y - low_y) / 4;  // straight edges bend
  const auto col = [&](double x) { return int(std::clamp(x, 0.0, double(grid.cols() - 1))); };
  const auto row = [&](double y) { return int(std::clamp(y, 0.0, double(grid.rows() - 1))); };
  if (high_x - low_x > 1e4)  // around a pole, or half of the earth
    return {0, grid.cols() - 1, 0, grid.rows() - 1};
  return {col(low_x - wide), col(high_x + wide), row(low_y - tall), row(high_y + tall)};
}

}  // namespace

std::vector<std::uint32_t> DrawnGlb::indices(std::size_t accessor) const {
  std::vector<std::uint32_t> all;
  for (const auto& [x] : values_of<1>(*this, accessor)) all.push_back(std::uint32_t(x));
  return all;
}

DrawnGlb read_glb(const std::vector<std::uint8_t>& bytes) {
  ByteReader in(bytes);
  EXPECT_EQ(in.get_text(4), "glTF");
  EXPECT_EQ(in.get<std::uint32_t>(), 2u);
  EXPECT_EQ(in.get<std::uint32_t>(), bytes.size());
  const auto text = in.get<std::uint32_t>();
  EXPECT_EQ(in.get_text(4), "JSON");
  DrawnGlb glb;
  glb.json = Json::parse(in.get_text(text));
  const auto size = in.get<std::uint32_t>();
  in.get_bytes(4);
  const auto numbers = in.get_bytes(size);
  glb.numbers.assign(numbers.begin(), numbers.end());
  EXPECT_TRUE(in.good());
  EXPECT_EQ(in.left(), 0u);
  EXPECT_EQ(glb.json["buffers"][0]["byteLength"], numbers.size());
  const Json& node = glb.json["nodes"][glb.json["scenes"][0]["nodes"][0].get<std::size_t>()];
  glb.extras = node["extras"];
  const auto matrix = node["matrix"].get<std::vector<double>>();
  for (const Json& primitive : glb.json["meshes"][0]["primitives"])
    glb.parts.push_back(part_of(glb, primitive, matrix));
  return glb;
}

DrawnError drawn_error(const DrawnPart& surface, const MadeUpSource& source, const GeoRect& rect) {
  const HeightGrid& grid = source.grid();
  const Ball ball = ball_of(source);
  std::vector<double> worst(std::size_t(grid.cols()) * std::size_t(grid.rows()), -1);
  for (const auto& triangle : surface.triangles) {
    const std::array<Vec3, 3> t = {surface.vertices[triangle[0]], surface.vertices[triangle[1]],
                                   surface.vertices[triangle[2]]};
    if (is_elsewhere(t, ball)) continue;
    const Window w = window_of(t, source);
    for (int row = w.north; row <= w.south; ++row)
      for (int col = w.west; col <= w.east; ++col) {
        const Vec2 at = source.info().post_to_crs.apply(col, row);
        const float post = grid.at(col, row);
        if (std::isnan(post) || !rect.contains({at.x, at.y})) continue;
        const Geographic place{at.x, at.y};
        const auto off = height_over(t, wgs84::to_ecef(place, post), wgs84::up(place));
        double& most = worst[std::size_t(row) * std::size_t(grid.cols()) + std::size_t(col)];
        if (off) most = std::max(most, std::abs(*off));
      }
  }
  DrawnError error;
  for (const double w : worst)
    if (w >= 0) ++error.posts, error.worst_m = std::max(error.worst_m, w);
  return error;
}

}  // namespace tind::test
