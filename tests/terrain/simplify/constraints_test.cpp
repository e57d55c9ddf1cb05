// Lines stay edges to the last bit, lakes stay level and the boundary is the mesh's border, through
// every method that thins the full mesh.

#include "terrain/simplify/constraints/constraints.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "terrain/mesh/validity.h"
#include "terrain/mesh/vertical_error.h"
#include "terrain/simplify/methods.h"
#include "terrain/simplify/options.h"
#include "terrain/simplify/simplify.h"
#include "tests/support/support.h"

namespace tind {
namespace {

using test::rough_terrain;
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

VectorLine line(std::initializer_list<Vec2> points) {
  VectorLine l;
  for (const Vec2& p : points) l.push_back({p.x, p.y, kNaN});
  return l;
}

VectorPolygon ring(double x, double y, double radius, int corners) {
  VectorPolygon p;
  p.rings.emplace_back();
  for (int i = 0; i <= corners; ++i) {
    const double a = 6.283185307179586 * (i % corners) / corners;
    p.rings[0].push_back({x + radius * std::cos(a), y + radius * std::sin(a), kNaN});
  }
  return p;
}

/// Lines over a grid, every third deliberately defective.
std::vector<VectorLine> dirty_lines(const HeightGrid& g, int count, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> x(0, g.cols() - 1), y(1 - g.rows(), 0), step(-9, 9);
  std::vector<VectorLine> all;
  for (int i = 0; i < count; ++i) {
    VectorLine l = line({{x(random), y(random)}});
    for (int k = 0; k < 3; ++k)
      l.push_back({l.back().x + step(random), l.back().y + step(random), kNaN});
    if (i % 3 == 2) {
      switch (i / 3 % 7) {
        case 0:
          l = all[all.size() - 1];
          break;  // duplicate
        case 1:
          l[3] = l[1] + (l[0] - l[1]) * 0.5;
          l[2] = l[1];
          break;  // spike
        case 2:
          l = line({{x(random), y(random)}}), l.push_back(l[0]);
          break;  // no length
        case 3:
          l[2].x = kNaN;
          break;  // a hole
        case 4:
          l[0].x = 5.0 * g.cols();
          break;  // leaves the DEM
        case 5:
          for (Vec3& p : l = all[all.size() - 1]) p.x += 1e-5;
          break;  // a hair beside
        case 6:
          l = line({{2, -2}, {g.cols() - 3.0, 3.0 - g.rows()}});
          break;  // across all
      }
    }
    all.push_back(std::move(l));
  }
  return all;
}

const char* const kMethods[] = {
    "edge-cost",      "qem",    "memoryless", "attribute-qem", "triangle-collapse",
    "vertex-removal", "greedy", "bounded",    "cluster"};

void expect_kept(const std::shared_ptr<const Constraints>& c, double ratio) {
  const VerticalError full = vertical_error(c->mesh, c->dem.grid);
  EXPECT_EQ(full.uncovered, 0u);
  for (const char* method : kMethods) {
    SCOPED_TRACE(method);
    SimplifyOptions o;
    o.method = *method_named(method);
    o.stop.ratio = ratio;
    o.constraints = c;
    const auto made = simplify(c->dem, o);
    ASSERT_TRUE(made) << made.error().what;
    EXPECT_LT(made->tin.triangles.size(), c->mesh.triangles.size());
    const MeshValidity v = check_validity(made->tin);
    EXPECT_TRUE(v.ok()) << v.first_problem;
    EXPECT_EQ(vertical_error(made->tin, c->dem.grid).uncovered, 0u);
    const ConstraintCheck check = check_constraints(made->tin, *c);
    EXPECT_EQ(check.parts, c->parts.size());
    EXPECT_EQ(check.missing, 0u);
    EXPECT_EQ(check.not_level, 0u);
  }
}

std::shared_ptr<const Constraints> constrained(const HeightGrid& g, const ConstraintShapes& s) {
  auto c = constrain({g, 10, 10}, s);
  EXPECT_TRUE(c) << c.error().what;
  return std::make_shared<const Constraints>(std::move(*c));
}

class ConstrainedTerrain : public testing::Test {
 protected:
  void SetUp() override {
    if (!has_constrained_delaunay()) GTEST_SKIP() << "built without CGAL";
  }
};

TEST_F(ConstrainedTerrain, TheCheckSeesWhatIsMissing) {
  const HeightGrid g = rough_terrain(12, 12, 1);
  ConstraintShapes s;
  s.breaklines = {line({{1.3, -2.1}, {9.2, -7.7}})};
  const auto c = constrained(g, s);
  EXPECT_EQ(check_constraints(c->mesh, *c).missing, 0u);
  Tin moved = c->mesh;
  moved.vertices[c->inner[0]].y += 0x1p-30;
  EXPECT_EQ(check_constraints(moved, *c).missing, 1u);
}

TEST_F(ConstrainedTerrain, LinesAndLakesThroughEveryMethod) {
  const HeightGrid g = rough_terrain(120, 90, 3);
  ConstraintShapes s;
  s.breaklines = dirty_lines(g, 60, 9);
  s.flatten = {ring(30, -30, 8, 17), ring(36, -30, 5, 9), ring(80.5, -60.25, 11, 40)};
  const auto c = constrained(g, s);
  EXPECT_EQ(c->report.repairs.dropped, 0u);
  EXPECT_EQ(c->level[0], c->level[1]);  // they overlap
  EXPECT_NE(c->level[0], c->level[2]);
  EXPECT_LT(c->report.moved_posts, 0.01);
  expect_kept(c, 0.2);
}

TEST_F(ConstrainedTerrain, TheMedianOfOwnHeightsIsThatWhereverARingBegins) {
  const std::vector<Vec3> corners = {{1, -1, 600}, {7, -1, 602}, {7, -7, 640}, {1, -7, 650}};
  for (std::size_t first = 0; first < 4; ++first) {
    ConstraintShapes s;
    s.flatten.emplace_back().rings.emplace_back();
    for (std::size_t k = 0; k <= 4; ++k) s.flatten[0].rings[0].push_back(corners[(first + k) % 4]);
    EXPECT_EQ(constrained(rough_terrain(12, 12, 1), s)->level[0], 621) << first;
  }
}

TEST_F(ConstrainedTerrain, ABoundaryCutsTheMesh) {
  const HeightGrid g = rough_terrain(80, 70, 4);
  ConstraintShapes s;
  s.boundary = {ring(40, -35, 25, 50)};
  s.breaklines = dirty_lines(g, 20, 2);
  const auto c = constrained(g, s);
  EXPECT_GT(c->report.posts_outside, 3000u);
  expect_kept(c, 0.3);
  const double polygon = 0.5 * 50 * 25 * 25 * std::sin(6.283185307179586 / 50);
  EXPECT_NEAR(check_validity(c->mesh).area, polygon, 0.05);
}

TEST_F(ConstrainedTerrain, VoidsStayVoids) {
  HeightGrid g = rough_terrain(60, 50, 5);
  for (int r = 10; r < 30; ++r)
    for (int col = 15; col < 35; ++col)
      if ((col + r) % 7) g.at(col, r) = HeightGrid::kVoid;
  ConstraintShapes s;
  s.breaklines = {line({{2.5, -3.5}, {57.2, -44.1}}), line({{20, -2}, {21, -48}})};
  const auto full = vertical_error(constrain({g, 10, 10}, {})->mesh, g);
  const auto c = constrained(g, s);
  EXPECT_LE(vertical_error(c->mesh, g).uncovered, full.uncovered);
  EXPECT_TRUE(check_validity(c->mesh).ok()) << check_validity(c->mesh).first_problem;
  EXPECT_EQ(check_constraints(c->mesh, *c).missing, 0u);
}

TEST_F(ConstrainedTerrain, OwnHeightsAreKept) {
  const HeightGrid g(30, 30, 100);
  ConstraintShapes s;
  s.breaklines = {{{3, -3, 110}, {19, -11, 130}}};
  const auto c = constrained(g, s);
  ASSERT_EQ(c->parts.size(), 1u);
  EXPECT_EQ(c->mesh.vertices[c->parts[0].a].z, 110);
  EXPECT_EQ(c->mesh.vertices[c->parts[0].b].z, 130);
  EXPECT_NEAR(c->mesh.vertices[c->inner[(c->parts[0].first + c->parts[0].last) / 2]].z, 120, 2);
}

TEST_F(ConstrainedTerrain, InsertionMeetsItsBoundAndItsCount) {
  const HeightGrid g = rough_terrain(70, 60, 8);
  ConstraintShapes s;
  s.breaklines = {line({{3.3, -4.4}, {60.7, -31.2}, {12.1, -50.6}}), line({{0, -20}, {69, -20}})};
  const auto c = constrained(g, s);
  ASSERT_TRUE(c->beside.empty());
  SimplifyOptions o;
  o.constraints = c;
  for (const double bound : {0.1, 3.0, 50.0}) {
    std::size_t greedy = 0;
    for (const char* method : {"greedy", "bounded"}) {
      o.method = *method_named(method);
      o.stop = {.max_error_m = bound};
      const auto made = simplify(c->dem, o);
      ASSERT_TRUE(made) << made.error().what;
      EXPECT_LE(vertical_error(made->tin, c->dem.grid).max_m, bound + 1e-6) << method;
      EXPECT_EQ(made->note, "");
      EXPECT_EQ(check_constraints(made->tin, *c).missing, 0u);
      if (greedy > 0) {
        EXPECT_LT(made->tin.triangles.size(), greedy);
      }
      greedy = made->tin.triangles.size();
    }
  }
  o.method = GreedyOptions{};
  o.stop = {.triangles = 1000};
  const auto counted = simplify(c->dem, o);
  EXPECT_GE(counted->tin.triangles.size(), 995u);  // half a per cent, for the lowest error there
  EXPECT_LE(counted->tin.triangles.size(), 1000u);
  o.stop = {.triangles = 3};
  EXPECT_NE(simplify(c->dem, o)->note.find("the edges that must stay alone need"),
            std::string::npos);
}

TEST_F(ConstrainedTerrain, VertexRemovalThinsLinesDownToTheirEnds) {
  const HeightGrid g(40, 30, 5);
  ConstraintShapes s;
  s.breaklines = {line({{3.3, -4.4}, {31.7, -21.2}, {12.1, -25.6}})};
  s.boundary = {ring(20, -15, 14, 9)};
  const auto c = constrained(g, s);
  for (const Criterion criterion : {Criterion::plane, Criterion::degree, Criterion::k_degree}) {
    SimplifyOptions o;
    o.method = VertexRemovalOptions{.criterion = criterion};
    o.stop.triangles = 2;
    o.constraints = c;
    const auto made = simplify(c->dem, o);
    ASSERT_TRUE(made) << made.error().what;
    EXPECT_EQ(check_constraints(made->tin, *c).missing, 0u) << name_of(criterion);
    // What is left: the ends of the network's straight parts.
    EXPECT_LE(made->tin.vertices.size(), 2 * c->parts.size()) << name_of(criterion);
    EXPECT_LT(made->tin.vertices.size(), 25u) << name_of(criterion);
  }
}

TEST_F(ConstrainedTerrain, RandomLinesOverRandomGridsThroughEveryMethod) {
  for (unsigned seed = 1; seed <= 24; ++seed) {
    std::mt19937 random(seed);
    HeightGrid g = rough_terrain(20 + int(random() % 30), 20 + int(random() % 30), seed);
    if (seed % 3 == 0) {  // a void in the middle
      const int from = 6 + int(random() % 4), to = from + 3 + int(random() % 6);
      for (int r = from; r < to; ++r)
        for (int c = from; c < to; ++c) g.at(c, r) = HeightGrid::kVoid;
    }
    ConstraintShapes s;
    s.breaklines = dirty_lines(g, 3 + int(random() % 12), seed);
    if (seed % 2) s.flatten = {ring(12.5, -13.25, 2 + random() % 5, 3 + int(random() % 20))};
    if (seed % 4 == 1) s.boundary = {ring(10, -10, 6 + random() % 12, 3 + int(random() % 9))};
    auto made = constrain({g, 10, 10}, s);
    ASSERT_TRUE(made) << made.error().what;
    const auto c = std::make_shared<const Constraints>(std::move(*made));
    const std::uint64_t lonely = vertical_error(c->mesh, c->dem.grid).uncovered;
    for (const char* method : kMethods) {
      for (const StopAt& stop : {StopAt{.ratio = 0.15}, StopAt{.max_error_m = 20}}) {
        SCOPED_TRACE(std::string(method) + " " + std::to_string(seed));
        SimplifyOptions o;
        o.method = *method_named(method);
        o.stop = stop;
        o.constraints = c;
        const auto result = simplify(c->dem, o);
        ASSERT_TRUE(result) << result.error().what;
        const MeshValidity v = check_validity(result->tin);
        EXPECT_TRUE(v.ok()) << v.first_problem;
        EXPECT_LE(vertical_error(result->tin, c->dem.grid).uncovered, lonely);
        const ConstraintCheck check = check_constraints(result->tin, *c);
        EXPECT_EQ(check.missing, 0u) << "of " << check.parts;
        EXPECT_EQ(check.not_level, 0u);
        if (stop.max_error_m && result->note.empty()) {
          EXPECT_LE(vertical_error(result->tin, c->dem.grid).max_m, 20 + 1e-6);
        }
      }
    }
  }
}

}  // namespace
}  // namespace tind
