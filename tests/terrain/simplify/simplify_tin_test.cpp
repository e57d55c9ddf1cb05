// What holds for every method that takes a TIN, over TINs in the frames and outlines that there
// are: valid, the border where it was, the count or the bound kept as the referee sees it, the same
// every time.

#include "terrain/simplify/simplify_tin.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <set>
#include <tuple>

#include "terrain/mesh/constrained_delaunay.h"
#include "terrain/mesh/terrain_tin.h"
#include "terrain/mesh/validity.h"
#include "terrain/mesh/vertical_error.h"
#include "terrain/simplify/method_text.h"
#include "terrain/simplify/methods.h"
#include "terrain/simplify/simplify.h"
#include "tests/support/support.h"

namespace tind {
namespace {

using testing::HasSubstr;

/// A DEM thinned out: triangles of all sizes, in the frame that `place` brings posts to.
TerrainTin thinned(const HeightGrid& grid, const std::function<Vec3(const Vec3&)>& place) {
  SimplifyOptions o;
  o.method = QemOptions{};
  o.stop.ratio = 0.5;
  Tin tin = simplify({grid, 1, 1}, o)->tin;
  for (Vec3& p : tin.vertices) p = place(p);
  return {*as_terrain(std::move(tin))};
}

HeightGrid with_a_hole(int cols, int rows, unsigned seed) {
  HeightGrid grid = test::rough_terrain(cols, rows, seed);
  for (int r = 0; r < rows; ++r)
    for (int c = 0; c < cols; ++c)
      if ((c > 8 && c < 14 && r > 5 && r < 12) || (c + r < 7) || (c > 20 && r > 15))
        grid.at(c, r) = std::numeric_limits<float>::quiet_NaN();
  return grid;
}

struct World {
  const char* name;
  TerrainTin terrain;
};

const std::vector<World>& worlds() {
  static const std::vector<World> all = [] {
    const HeightGrid plain = test::rough_terrain(31, 24, 1), torn = with_a_hole(31, 24, 2);
    const auto utm = [](const Vec3& p) {
      return Vec3{537211.37 + 10.3 * p.x, 5188123.91 + 10.3 * p.y, p.z};
    };
    const auto degrees = [](const Vec3& p) {
      return Vec3{-121.7 + p.x / 3600, 46.8 + p.y / 3600, p.z};
    };
    const auto astride = [](const Vec3& p) { return Vec3{3.7 * (p.x - 11), 3.7 * p.y + 9, p.z}; };
    const auto turned = [](const Vec3& p) {
      return Vec3{0.8 * p.x - 0.6 * p.y, 0.6 * p.x + 0.8 * p.y, p.z};
    };
    std::vector<World> made = {{"metres", thinned(plain, utm)},
                               {"degrees", thinned(plain, degrees)},
                               {"feet", thinned(plain, astride)},
                               {"flat", thinned(HeightGrid(20, 20, 7), utm)},
                               {"oblique", thinned(plain, turned)},
                               {"torn", thinned(torn, utm)},
                               {"torn and oblique", thinned(torn, turned)}};
    made[1].terrain.x_unit_m = 76000, made[1].terrain.y_unit_m = 111000;
    made[2].terrain.x_unit_m = made[2].terrain.y_unit_m = made[2].terrain.z_unit_m = 0.3048;
    Tin two;
    two.vertices = {{0, 0, 1}, {9, 0, 2}, {9, 7, 3}, {1, 6, 4}};
    two.triangles = {{0, 1, 2}, {0, 2, 3}};
    made.push_back({"two triangles", {two}});
    return made;
  }();
  return all;
}

std::vector<SimplifyOptions> every_method() {
  std::vector<SimplifyOptions> all;
  for (const char* text :
       {"bounded effort=fast", "bounded", "qem", "qem subset-placement=on",
        "qem border-constraints=on", "memoryless", "greedy", "attribute-qem", "edge-cost",
        "edge-cost placement=fit", "triangle-collapse", "triangle-collapse placement=centroid",
        "vertex-removal", "vertex-removal criterion=degree", "vertex-removal criterion=k-degree"})
    all.emplace_back().method = *method_from_text(text);
  return all;
}

/// The least height of a triangle.
double least_breadth(const Tin& tin) {
  double least = HUGE_VAL;
  for (const Triangle& t : tin.triangles) {
    const Vec3 &a = tin.vertices[t[0]], &b = tin.vertices[t[1]], &c = tin.vertices[t[2]];
    const double longest =
        std::max({std::hypot(a.x - b.x, a.y - b.y), std::hypot(b.x - c.x, b.y - c.y),
                  std::hypot(c.x - a.x, c.y - a.y)});
    least = std::min(least, orient2d(a, b, c) / longest);
  }
  return least;
}

/// Vertices of the border that do not lie on the rectangle around the TIN.
std::vector<Vec3> inner_border(const Tin& tin) {
  std::map<std::pair<std::uint32_t, std::uint32_t>, int> sides;
  for (const Triangle& t : tin.triangles)
    for (int k = 0; k < 3; ++k) ++sides[std::minmax(t[k], t[(k + 1) % 3])];
  const auto [west, east] = std::ranges::minmax(tin.vertices, {}, &Vec3::x);
  const auto [south, north] = std::ranges::minmax(tin.vertices, {}, &Vec3::y);
  std::vector<Vec3> all;
  for (const auto& [side, triangles] : sides)
    for (const std::uint32_t v : {side.first, side.second}) {
      const Vec3& p = tin.vertices[v];
      if (triangles == 1 && p.x > west.x && p.x < east.x && p.y > south.y && p.y < north.y)
        all.push_back(p);
    }
  return all;
}

using Places = std::set<std::tuple<double, double, double>>;
Places places(const Tin& tin) {
  Places all;
  for (const Vec3& p : tin.vertices) all.insert({p.x, p.y, p.z});
  return all;
}

/// Seen from above it is what it was, to the rounding of a sum.
void expect_valid(const Simplified& made, const TerrainTin& of) {
  const MeshValidity v = check_validity(made.tin);
  EXPECT_TRUE(v.ok()) << v.first_problem;
  const double before = check_validity(of.tin).area;
  EXPECT_NEAR(v.area, before, 1e-9 * before);
  EXPECT_EQ(vertical_error(made.tin, of.tin.vertices, of.z_unit_m).uncovered, 0u);
  EXPECT_TRUE(as_terrain(made.tin));
  const double apart = std::sqrt(before / double(of.tin.vertices.size()));
  EXPECT_GT(least_breadth(made.tin), std::min(5e-7 * apart, 0.5 * least_breadth(of.tin)));
}

/// The methods that start from the outline need CGAL where that is no rectangle.
bool can_start(const SimplifyOptions& o, const std::string& world) {
  const bool outline = std::holds_alternative<GreedyOptions>(o.method) ||
                       std::holds_alternative<BoundedOptions>(o.method);
  const bool rectangle =
      world == "metres" || world == "degrees" || world == "feet" || world == "flat";
  return !outline || rectangle || has_constrained_delaunay();
}

class EveryTinMethod : public testing::TestWithParam<SimplifyOptions> {
 protected:
  void on_each(const std::function<void(const TerrainTin&)>& f) {
    for (const World& world : worlds()) {
      SCOPED_TRACE(world.name);
      if (can_start(GetParam(), world.name)) f(world.terrain);
    }
  }
};

TEST_P(EveryTinMethod, NeverLeavesMoreThanTheCountOrSaysWhy) {
  on_each([&](const TerrainTin& terrain) {
    for (const StopAt& stop :
         {StopAt{.ratio = 0.6}, StopAt{.ratio = 0.1}, StopAt{.triangles = 1}, StopAt{.ratio = 1}}) {
      SimplifyOptions o = GetParam();
      o.stop = stop;
      const auto made = simplify_tin(terrain, o);
      ASSERT_TRUE(made) << made.error().what;
      expect_valid(*made, terrain);
      EXPECT_EQ(made->input_triangles, terrain.tin.triangles.size());
      const double target = stop.ratio ? *stop.ratio * double(terrain.tin.triangles.size()) : 1;
      if (double(made->tin.triangles.size()) > target) {
        EXPECT_NE(made->note, "") << made->tin.triangles.size() << " of " << target;
      }
      const auto again = simplify_tin(terrain, o);
      EXPECT_EQ(again->tin.vertices, made->tin.vertices);
      EXPECT_EQ(again->tin.triangles, made->tin.triangles);
    }
  });
}

TEST_P(EveryTinMethod, KeepsTheErrorBoundOverTheVertices) {
  on_each([&](const TerrainTin& terrain) {
    for (const double bound : {1e-3, 7.0, 300.0}) {
      SimplifyOptions o = GetParam();
      o.stop.max_error_m = bound;
      const auto made = simplify_tin(terrain, o);
      ASSERT_TRUE(made) << made.error().what;
      expect_valid(*made, terrain);
      const VerticalError e = vertical_error(made->tin, terrain.tin.vertices, terrain.z_unit_m);
      EXPECT_LE(e.max_m, bound * (1 + 1e-9) + 1e-8);
      EXPECT_EQ(made->note, "");
    }
  });
}

TEST_P(EveryTinMethod, LeavesTheBorderWhereItWas) {
  on_each([&](const TerrainTin& terrain) {
    SimplifyOptions o = GetParam();
    o.stop.ratio = 0.05;
    const auto made = simplify_tin(terrain, o);
    ASSERT_TRUE(made) << made.error().what;
    // Each of its corners is there to the bit.
    const auto has = [](const Tin& tin, const Vec3& p) {
      return std::ranges::any_of(tin.vertices,
                                 [&](const Vec3& q) { return q.x == p.x && q.y == p.y; });
    };
    const auto [west, east] = std::ranges::minmax(terrain.tin.vertices, {}, &Vec3::x);
    const auto [south, north] = std::ranges::minmax(terrain.tin.vertices, {}, &Vec3::y);
    for (const Vec3& p : {west, east, south, north}) {
      const bool on_side = std::ranges::count(terrain.tin.vertices, p.x, &Vec3::x) > 1 ||
                           std::ranges::count(terrain.tin.vertices, p.y, &Vec3::y) > 1;
      EXPECT_TRUE(on_side || has(made->tin, p)) << p.x << " " << p.y;
    }
  });
}

TEST_P(EveryTinMethod, KeepsEachVertexOfABorderThatIsNoSideOfTheRectangle) {
  on_each([&](const TerrainTin& terrain) {
    const std::vector<Vec3> border = inner_border(terrain.tin);
    for (const StopAt& stop : {StopAt{.ratio = 0.05}, StopAt{.max_error_m = 100.0}}) {
      SimplifyOptions o = GetParam();
      o.stop = stop;
      const auto made = simplify_tin(terrain, o);
      ASSERT_TRUE(made) << made.error().what;
      std::set<std::pair<double, double>> kept;
      for (const Vec3& p : made->tin.vertices) kept.insert({p.x, p.y});
      for (const Vec3& p : border) EXPECT_TRUE(kept.contains({p.x, p.y})) << p.x << " " << p.y;
    }
  });
}

INSTANTIATE_TEST_SUITE_P(Table, EveryTinMethod, testing::ValuesIn(every_method()),
                         [](const testing::TestParamInfo<SimplifyOptions>& row) {
                           std::string name =
                               method_name(row.param.method) + std::to_string(row.index);
                           std::erase(name, '-');
                           return name;
                         });

TEST(SimplifyTin, VerticesOfMethodsThatKeepSomeAreThoseOfTheTinToTheBit) {
  for (const char* text : {"vertex-removal", "greedy"}) {
    for (const World& world : worlds()) {
      SimplifyOptions o;
      o.method = *method_from_text(text);
      if (!can_start(o, world.name)) continue;
      o.stop.ratio = 0.3;
      const auto made = simplify_tin(world.terrain, o);
      ASSERT_TRUE(made) << made.error().what;
      EXPECT_TRUE(std::ranges::includes(places(world.terrain.tin), places(made->tin)))
          << text << " " << world.name;
    }
  }
}

/// A TIN of all posts is the DEM's own mesh, so both ways lead to the same.
TEST(SimplifyTin, OfAllPostsIsWhatTheDemGives) {
  const HeightGrid grid = test::rough_terrain(33, 21, 4);
  for (const char* text : {"edge-cost", "edge-cost placement=fit", "vertex-removal",
                           "vertex-removal criterion=k-degree", "qem", "memoryless"}) {
    SimplifyOptions o;
    o.method = *method_from_text(text);
    SimplifyOptions all;
    all.method = QemOptions{};
    all.stop.ratio = 1;
    TerrainTin full{simplify({grid, 1, 1}, all)->tin};
    full.x_unit_m = 30, full.y_unit_m = 20;
    o.stop = {.ratio = 0.2};
    const auto of_dem = simplify({grid, 30, 20}, o), of_tin = simplify_tin(full, o);
    ASSERT_TRUE(of_dem && of_tin);
    EXPECT_NEAR(double(of_tin->tin.triangles.size()), double(of_dem->tin.triangles.size()), 1)
        << text;
    // Of two vertices or edges that are as cheap another may go first.
    const double dem = vertical_error(of_dem->tin, grid).rms_m;
    EXPECT_NEAR(vertical_error(of_tin->tin, full.tin.vertices, 1).rms_m, dem, 0.1 * dem) << text;
  }
}

TEST(SimplifyTin, RefusesWhatItCannotSayInOneLine) {
  const TerrainTin& terrain = worlds()[0].terrain;
  SimplifyOptions o;
  o.stop.ratio = 0.5;
  o.method = ClusterOptions{};
  auto made = simplify_tin(terrain, o);
  ASSERT_FALSE(made);
  EXPECT_THAT(made.error().what, HasSubstr("'cluster' is for rasters"));
  EXPECT_THAT(made.error().what, HasSubstr("vertex-removal"));
  o.method = BoundedOptions{.side = Side::above};
  made = simplify_tin(terrain, o);
  ASSERT_FALSE(made);
  EXPECT_THAT(made.error().what, HasSubstr("--max-error"));
  o.method = QemOptions{};
  o.stop.max_error_m = 3;
  EXPECT_FALSE(simplify_tin(terrain, o));
}

TEST(SimplifyTin, BoundedKeepsToOneSide) {
  for (const Side side : {Side::above, Side::below}) {
    SimplifyOptions o;
    o.method = BoundedOptions{.side = side};
    o.stop.max_error_m = 10;
    const TerrainTin& terrain = worlds()[0].terrain;
    const auto made = simplify_tin(terrain, o);
    ASSERT_TRUE(made) << made.error().what;
    const VerticalError e = vertical_error(made->tin, terrain.tin.vertices, 1);
    EXPECT_LE(side == Side::above ? e.max_below_m : e.max_above_m, 1e-8);
    EXPECT_GT(side == Side::above ? e.max_above_m : e.max_below_m, 1);
  }
}

/// The paper's midpoint cuts crests off; its fit does not. On a DEM and on a TIN.
TEST(EdgeCostPlacement, FitFollowsTheSamplesCloserThanTheMidpoint) {
  const HeightGrid grid = test::rough_terrain(80, 60, 9);
  const TerrainTin tin = thinned(grid, [](const Vec3& p) { return p; });
  double dem_rms[2], tin_rms[2];
  for (const auto placement : {EdgePlacement::midpoint, EdgePlacement::fit}) {
    SimplifyOptions o;
    o.method = EdgeCostOptions{.placement = placement};
    o.stop.ratio = 0.15;
    const auto made = simplify({grid, 1, 1}, o);
    ASSERT_TRUE(made);
    EXPECT_TRUE(check_validity(made->tin).ok());
    dem_rms[int(placement)] = vertical_error(made->tin, grid).rms_m;
    tin_rms[int(placement)] = vertical_error(simplify_tin(tin, o)->tin, tin.tin.vertices, 1).rms_m;
  }
  EXPECT_LT(dem_rms[1], 0.8 * dem_rms[0]);
  EXPECT_LT(tin_rms[1], 0.8 * tin_rms[0]);
}

}  // namespace
}  // namespace tind
