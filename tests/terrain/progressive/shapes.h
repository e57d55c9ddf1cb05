#pragma once
// Closed, open and pierced surfaces to take apart.

#include <cmath>
#include <numbers>
#include <random>

#include "terrain/mesh/halfedge_mesh.h"

namespace tind::test {

/// Corners and face centres of a box: 14 vertices, 24 triangles.
inline Tin box(const Vec3& low, const Vec3& high) {
  Tin t;
  for (int i = 0; i < 8; ++i)
    t.vertices.push_back({i & 1 ? high.x : low.x, i & 2 ? high.y : low.y, i & 4 ? high.z : low.z});
  const std::uint32_t faces[6][4] = {{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4},
                                     {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}};
  for (const auto& f : faces) {
    const std::uint32_t centre = std::uint32_t(t.vertices.size());
    t.vertices.push_back((t.vertices[f[0]] + t.vertices[f[2]]) * 0.5);
    for (int k = 0; k < 4; ++k) t.triangles.push_back({centre, f[k], f[(k + 1) % 4]});
  }
  return t;
}

/// Edges split at random, `times` times; on the border, too.
inline Tin split_at_random(const Tin& tin, int times, std::uint32_t seed) {
  HalfedgeMesh m = *HalfedgeMesh::from_tin(tin);
  std::mt19937 random(seed);
  for (int i = 0; i < times; ++i) {
    const auto h = HalfedgeMesh::Index(random() % m.halfedge_slots());
    m.split_edge(h, (m.position(m.origin(h)) + m.position(m.dest(h))) * 0.5);
  }
  return m.to_tin();
}

/// Of radius 1.
inline Tin sphere(int times, std::uint32_t seed = 3) {
  Tin t = split_at_random(box({-1, -1, -1}, {1, 1, 1}), times, seed);
  for (Vec3& v : t.vertices) v = v * (1 / length(v));
  return t;
}

/// m x n quads in two triangles each, at `place(i / m, j / n)`; each direction may close on itself.
template <class Place>
Tin sheet(int m, int n, bool closed_m, bool closed_n, Place&& place) {
  Tin t;
  const int rows = closed_m ? m : m + 1, cols = closed_n ? n : n + 1;
  for (int i = 0; i < rows; ++i)
    for (int j = 0; j < cols; ++j) t.vertices.push_back(place(double(i) / m, double(j) / n));
  const auto at = [&](int i, int j) { return std::uint32_t(i % rows * cols + j % cols); };
  for (int i = 0; i < m; ++i) {
    for (int j = 0; j < n; ++j) {
      t.triangles.push_back({at(i, j), at(i + 1, j), at(i + 1, j + 1)});
      t.triangles.push_back({at(i, j), at(i + 1, j + 1), at(i, j + 1)});
    }
  }
  return t;
}

inline Tin torus(int m, int n) {
  return sheet(m, n, true, true, [](double s, double t) {
    const double a = 2 * std::numbers::pi * s, b = 2 * std::numbers::pi * t, r = 2 + std::cos(b);
    return Vec3{r * std::cos(a), r * std::sin(a), std::sin(b)};
  });
}

/// A square, 0..1, with hills: one border.
inline Tin hills(int m) {
  return sheet(m, m, false, false, [](double s, double t) {
    return Vec3{s, t, 0.1 * std::sin(5 * s) * std::cos(4 * t)};
  });
}

/// A tube: two borders.
inline Tin tube(int m, int n) {
  return sheet(m, n, false, true, [](double s, double t) {
    const double a = 2 * std::numbers::pi * t;
    return Vec3{std::cos(a), std::sin(a), 3 * s};
  });
}

inline Tin turned(Tin t, double by) {
  for (Vec3& v : t.vertices)
    v = {std::cos(by) * v.x - std::sin(by) * v.y, std::sin(by) * v.x + std::cos(by) * v.y, v.z};
  return t;
}

}  // namespace tind::test
