#include "terrain/simplify/collapse/attribute_quadric.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <random>
#include <set>

#include "terrain/mesh/halfedge_mesh.h"
#include "terrain/mesh/surface_distance.h"
#include "terrain/mesh/validity.h"
#include "terrain/mesh/vertical_error.h"
#include "terrain/simplify/collapse/quadric_n.h"
#include "terrain/simplify/methods.h"
#include "terrain/simplify/simplify.h"
#include "terrain/simplify/simplify_mesh.h"
#include "tests/support/support.h"

namespace tind {
namespace {

TEST(QuadricN, HasThePapersNumberOfCoefficients) {
  EXPECT_EQ(QuadricN<3>::kCoefficients, 10);
  EXPECT_EQ(QuadricN<5>::kCoefficients, 21);
  EXPECT_EQ(QuadricN<6>::kCoefficients, 28);
  EXPECT_EQ(QuadricN<9>::kCoefficients, 55);
}

TEST(QuadricN, IsTheSquaredDistanceToThePlaneWhereverItsOriginIs) {
  std::mt19937 random(6);
  std::uniform_real_distribution<double> at(-2, 2);
  for (int round = 0; round < 50; ++round) {
    PointN<6> p, q, r;
    std::array<float, 6> v, move;
    for (int i = 0; i < 6; ++i) p[i] = at(random), q[i] = at(random), r[i] = at(random);
    // A point of the plane is at distance 0 (relative to p).
    const double s = at(random), t = at(random);
    for (int i = 0; i < 6; ++i) v[i] = float(s * (q[i] - p[i]) + t * (r[i] - p[i]));
    QuadricN<6> quadric = QuadricN<6>::of_triangle(p, q, r, 1, 0);
    EXPECT_NEAR(quadric.value(v), 0, 1e-4);
    for (float& x : v) x = float(at(random));
    const float before = quadric.value(v);
    for (int i = 0; i < 6; ++i) move[i] = float(at(random)), v[i] -= move[i];
    quadric.move_origin(move);
    EXPECT_NEAR(quadric.value(v), before, 1e-4 * (1 + before));
  }
}

TEST(QuadricN, LeastIsNoHigherThanAnywhereNear) {
  std::mt19937 random(7);
  std::normal_distribution<float> at;
  for (int round = 0; round < 50; ++round) {
    QuadricN<9> sum;
    for (int t = 0; t < 5; ++t) {
      PointN<9> p, q, r;
      for (int i = 0; i < 9; ++i) p[i] = at(random), q[i] = at(random), r[i] = at(random);
      QuadricN<9> one = QuadricN<9>::of_triangle(p, q, r, 1, 1e-3);
      std::array<float, 9> move;
      for (float& x : move) x = at(random);
      one.move_origin(move);
      sum.add(one);
    }
    for (const int given : {0, 2, 3}) {
      std::array<float, 9> d{};
      for (int i = 0; i < given; ++i) d[i] = at(random);
      sum.least(d, given);
      const float low = sum.value(d);
      for (int k = 0; k < 20; ++k) {
        std::array<float, 9> near = d;
        for (int i = given; i < 9; ++i) near[i] += 0.1f * at(random);
        EXPECT_LE(low, sum.value(near) + 1e-4f * (1 + std::abs(low)));
      }
    }
  }
}

/// A plane whose left half is black and whose right half is white, from column `edge` on.
Tin two_coloured_plane(int n, int edge) {
  Tin tin;
  for (int r = 0; r < n; ++r) {
    for (int c = 0; c < n; ++c) {
      tin.vertices.push_back({double(c), double(-r), 0});
      const float shade = c >= edge ? 1.0f : 0.0f;
      tin.colours.push_back({shade, shade, shade});
    }
  }
  for (unsigned r = 0; r + 1 < unsigned(n); ++r) {
    for (unsigned c = 0; c + 1 < unsigned(n); ++c) {
      const unsigned nw = r * unsigned(n) + c, sw = nw + unsigned(n);
      tin.triangles.push_back({nw, sw, nw + 1});
      tin.triangles.push_back({sw + 1, nw + 1, sw});
    }
  }
  return tin;
}

/// A wavy sheet of two halves with texture coordinates of their own: along the middle there are two
/// vertices at each place.
Tin sheet_with_a_seam(int n) {
  Tin tin;
  const auto w = unsigned(n);
  for (unsigned half = 0; half < 2; ++half)
    for (unsigned y = 0; y < w; ++y)
      for (unsigned x = 0; x < w; ++x) {
        const double at = x + half * (w - 1.0);
        tin.vertices.push_back({at, double(y), 2 * std::sin(at / 4) * std::cos(y / 3.0)});
        tin.texcoords.push_back({float(x) / float(w), float(half)});
      }
  for (unsigned half = 0; half < 2; ++half)
    for (unsigned y = 0; y + 1 < w; ++y)
      for (unsigned x = 0; x + 1 < w; ++x) {
        const unsigned a = half * w * w + y * w + x;
        tin.triangles.push_back({a, a + 1, a + w + 1});
        tin.triangles.push_back({a, a + w + 1, a + w});
      }
  return tin;
}

/// Edges inside the sheet that only one triangle has, seen by places.
int open_edges(const Tin& tin, double width, double height) {
  std::set<std::array<double, 6>> edges;
  for (const Triangle& t : tin.triangles)
    for (int k = 0; k < 3; ++k) {
      const Vec3 &a = tin.vertices[t[std::size_t(k)]], &b = tin.vertices[t[std::size_t(k + 1) % 3]];
      edges.insert({a.x, a.y, a.z, b.x, b.y, b.z});
    }
  int open = 0;
  for (const auto& e : edges) {
    const auto inside = [&](double x, double y) {
      return x > 0.5 && y > 0.5 && x < width - 0.5 && y < height - 0.5;
    };
    open += inside(e[0], e[1]) && inside(e[3], e[4]) &&
            !edges.contains({e[3], e[4], e[5], e[0], e[1], e[2]});
  }
  return open;
}

TEST(SimplifyMesh, NoCrackOpensAlongASeam) {
  const Tin sheet = sheet_with_a_seam(25);
  ASSERT_EQ(open_edges(sheet, 48, 24), 0);
  for (const MethodOptions& method :
       {MethodOptions(QemOptions{}), MethodOptions(AttributeQemOptions{.drape = {}}),
        MethodOptions(TriangleCollapseOptions{})}) {
    SimplifyOptions o;
    o.method = method;
    o.stop.ratio = 0.1;
    const auto made = simplify_mesh(sheet, o);
    ASSERT_TRUE(made) << made.error().what;
    EXPECT_LT(made->made.tin.triangles.size(), sheet.triangles.size() / 8) << method_name(method);
    EXPECT_EQ(open_edges(made->made.tin, 48, 24), 0) << method_name(method);
    const bool shape = std::holds_alternative<TriangleCollapseOptions>(method);
    EXPECT_EQ(made->seam_vertices, shape ? 0u : 50u);
  }
}

TEST(SimplifyMesh, VerticesThatAgreeInAllAreOne) {
  Tin soup;
  const Tin sheet = sheet_with_a_seam(9);
  for (const Triangle& t : sheet.triangles) {
    const auto n = std::uint32_t(soup.vertices.size());
    for (const std::uint32_t v : t) soup.vertices.push_back(sheet.vertices[v]);
    soup.triangles.push_back({n, n + 1, n + 2});
  }
  SimplifyOptions o;
  o.method = QemOptions{};
  o.stop.ratio = 0.2;
  const auto made = simplify_mesh(soup, o);
  ASSERT_TRUE(made) << made.error().what;
  EXPECT_LE(made->made.tin.triangles.size(), 52u);
  EXPECT_EQ(open_edges(made->made.tin, 16, 8), 0);
}

TEST(AttributeQem, KeepsAColourBorderThatTheShapeDoesNotShow) {
  const Tin fine = two_coloured_plane(33, 11);
  SimplifyOptions o;
  o.method = AttributeQemOptions{.weight = 20, .drape = {}};
  o.stop.triangles = 60;
  const auto joint = simplify_mesh(fine, o);
  std::get<AttributeQemOptions>(o.method).metric = AttributeMetric::ignored;
  const auto shape = simplify_mesh(fine, o);
  ASSERT_TRUE(joint && shape);
  EXPECT_EQ(joint->made.details.at("coefficients"), 28);
  const auto error = [&](const Tin& t) {
    return surface_distance(fine, t, {.face_samples = 20000}).colour->rms;
  };
  EXPECT_LT(error(joint->made.tin), 0.6 * error(shape->made.tin));
}

TEST(AttributeQem, TerrainCarriesUnitNormalsAndStaysValid) {
  std::mt19937 random(3);
  for (int round = 0; round < 40; ++round) {
    HeightGrid grid(2 + int(random() % 30), 2 + int(random() % 30), 0);
    for (float& z : grid.values()) {
      z = float(random() % 1000) / 7;
      if (round % 3 == 1 && random() % 12 == 0) z = HeightGrid::kVoid;
    }
    SimplifyOptions o;
    AttributeQemOptions method;
    o.stop.ratio = 0.15;
    if (round % 2)
      method.drape = std::make_shared<std::vector<std::array<float, 3>>>(
          grid.size(), std::array<float, 3>{1, 0.5f, float(round) / 40});
    o.method = method;
    const auto r = simplify({grid, 20, 25}, o);
    if (!r) {
      EXPECT_EQ(r.error().code, Errc::bad_data);
      continue;
    }
    const MeshValidity validity = check_validity(r->tin);
    EXPECT_TRUE(validity.ok()) << validity.first_problem;
    EXPECT_EQ(r->details.at("dimension"), round % 2 ? 9 : 6);
    ASSERT_EQ(r->tin.normals.size(), r->tin.vertices.size());
    for (const auto& n : r->tin.normals)
      EXPECT_NEAR(n[0] * n[0] + n[1] * n[1] + n[2] * n[2], 1, 1e-4);
    if (round % 2 == 0) continue;
    ASSERT_EQ(r->tin.colours.size(), r->tin.vertices.size());
    for (const auto& c : r->tin.colours) EXPECT_NEAR(c[1], 0.5, 1e-3);
  }
}

TEST(SimplifyMesh, AnySoupComesOutAsAManifold) {
  std::mt19937 random(9);
  for (int round = 0; round < 200; ++round) {
    Tin tin;
    const unsigned n = 4 + random() % 30;
    for (unsigned i = 0; i < n; ++i) {
      tin.vertices.push_back({double(random() % 10), double(random() % 10), double(random() % 10)});
      tin.colours.push_back({float(random() % 2), 0, 1});
    }
    for (unsigned t = 1 + random() % 60; t > 0; --t)
      tin.triangles.push_back(
          {unsigned(random() % n), unsigned(random() % n), unsigned(random() % n)});
    SimplifyOptions o;
    o.method = *method_named(round % 3 == 0   ? "qem"
                             : round % 3 == 1 ? "attribute-qem"
                                              : "triangle-collapse");
    o.stop.ratio = 0.3;
    const auto r = simplify_mesh(tin, o);
    if (!r) {
      EXPECT_EQ(r.error().code, Errc::bad_data);
      continue;
    }
    const auto mesh = HalfedgeMesh::from_tin(r->made.tin);
    ASSERT_TRUE(mesh) << mesh.error().what;
    for (const Vec3& v : r->made.tin.vertices) EXPECT_TRUE(std::isfinite(v.x + v.y + v.z));
  }
}

TEST(SimplifyMesh, RefusesWhatIsForTerrain) {
  SimplifyOptions o;
  o.stop.ratio = 0.5;
  const Tin plane = two_coloured_plane(4, 2);
  o.method = EdgeCostOptions{};
  EXPECT_EQ(simplify_mesh(plane, o).error().code, Errc::invalid_argument);
  o.method = QemOptions{};
  o.stop = {.max_error_m = 1};
  EXPECT_EQ(simplify_mesh(plane, o).error().code, Errc::invalid_argument);
  o.stop = {.ratio = 0.5};
  o.method = AttributeQemOptions{.attributes = AttributeChoice::texture, .drape = {}};
  EXPECT_EQ(simplify_mesh(plane, o).error().code, Errc::invalid_argument);
}

}  // namespace
}  // namespace tind
