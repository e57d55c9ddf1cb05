// What every method promises, over grids that are as degenerate as a lattice can be.

#include "terrain/simplify/simplify.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <random>

#include "terrain/mesh/validity.h"
#include "terrain/mesh/vertical_error.h"
#include "terrain/simplify/common/simplified.h"
#include "terrain/simplify/common/terrain_mesh.h"
#include "terrain/simplify/methods.h"
#include "terrain/simplify/options.h"
#include "tests/support/support.h"

namespace tind {
namespace {

using test::grid_from;
using test::rough_terrain;

struct Variant {
  const char* name;
  std::function<void(SimplifyOptions&)> set;
};

/// The collapse methods and their options.
const std::vector<Variant>& variants() {
  static const std::vector<Variant> all = {
      {"edge-cost", [](SimplifyOptions& o) { o.method = EdgeCostOptions{}; }},
      {"length", [](SimplifyOptions& o) { o.method = EdgeCostOptions{.term = Term::length}; }},
      {"height", [](SimplifyOptions& o) { o.method = EdgeCostOptions{.term = Term::height}; }},
      {"degree", [](SimplifyOptions& o) { o.method = EdgeCostOptions{.term = Term::degree}; }},
      {"weighted", [](SimplifyOptions& o) { o.method = EdgeCostOptions{.alpha = 5, .beta = 2}; }},
      {"qem", [](SimplifyOptions& o) { o.method = QemOptions{}; }},
      {"subset", [](SimplifyOptions& o) { o.method = QemOptions{.subset_placement = true}; }},
      {"border", [](SimplifyOptions& o) { o.method = QemOptions{.border_constraints = true}; }},
      {"memoryless", [](SimplifyOptions& o) { o.method = MemorylessOptions{}; }},
  };
  return all;
}

std::vector<HeightGrid> worlds() {
  std::vector<HeightGrid> all = {HeightGrid(12, 9, 7), grid_from("1 2 / 3 4"),
                                 grid_from("0 9 0 / 9 0 9"), HeightGrid(2, 17, 3),
                                 HeightGrid(23, 3, 1)};
  std::mt19937 random(11);
  for (int kind = 0; kind < 7; ++kind) {
    HeightGrid g = rough_terrain(9 + int(random() % 30), 9 + int(random() % 30), unsigned(kind));
    for (int r = 0; r < g.rows(); ++r) {
      for (int c = 0; c < g.cols(); ++c) {
        float& z = g.at(c, r);
        if (kind == 1) z = float(int(z) / 100 * 100);               // plateaus
        if (kind == 2) z = random() % 40 == 0 ? 9000.f : 0.f;       // spikes
        if (kind == 3) z = c < g.cols() / 2 ? 0.f : 3000.f;         // a step
        if (kind == 4) z = (c + r) % 2 ? 500.f : -500.f;            // a checkerboard
        if (kind == 5) z = float(random() % 1000);                  // noise
        if (kind == 6 && random() % 8 == 0) z = HeightGrid::kVoid;  // holes
      }
    }
    all.push_back(std::move(g));
  }
  HeightGrid lake = rough_terrain(40, 33, 8);  // one large void, and half a plain
  for (int r = 5; r < 20; ++r)
    for (int c = 0; c < 18; ++c) lake.at(c, r) = HeightGrid::kVoid;
  for (int r = 20; r < 33; ++r)
    for (int c = 0; c < 40; ++c) lake.at(c, r) = 100;
  all.push_back(std::move(lake));
  return all;
}

/// Valid, and every post that the full mesh covers still covered. Returns the referee's verdict.
VerticalError expect_promises(const Simplified& s, const HeightGrid& grid) {
  const MeshValidity v = check_validity(s.tin);
  EXPECT_TRUE(v.ok()) << v.first_problem;
  const VerticalError e = vertical_error(s.tin, grid);
  const Tin full = terrain_mesh({grid, 1, 1})->mesh.to_tin();
  EXPECT_EQ(e.uncovered, vertical_error(full, grid).uncovered);
  EXPECT_DOUBLE_EQ(v.area, check_validity(full).area);
  return e;
}

TEST(Simplify, KeepsItsPromisesAtEveryCount) {
  for (const HeightGrid& grid : worlds()) {
    for (const Variant& variant : variants()) {
      for (const double ratio : {0.7, 0.3, 0.05}) {
        SCOPED_TRACE(std::string(variant.name) + " " + std::to_string(grid.cols()) + "x" +
                     std::to_string(grid.rows()) + " to " + std::to_string(ratio));
        SimplifyOptions o;
        variant.set(o);
        o.stop.ratio = ratio;
        const Result<Simplified> s = simplify({grid, 30, 20}, o);
        ASSERT_TRUE(s) << s.error().what;
        expect_promises(*s, grid);
        // A collapse takes two triangles, or one of the border.
        const auto target = std::uint64_t(ratio * double(s->input_triangles) + 1e-9);
        EXPECT_GE(s->tin.triangles.size() + 1, target);
        EXPECT_EQ(s->note.empty(), s->tin.triangles.size() <= target);
      }
    }
  }
}

TEST(Simplify, NeverExceedsTheErrorBound) {
  for (const HeightGrid& grid : worlds()) {
    for (const Variant& variant : variants()) {
      for (const double bound : {0.0, 0.1, 5.0, 400.0}) {
        SCOPED_TRACE(std::string(variant.name) + " within " + std::to_string(bound));
        SimplifyOptions o;
        variant.set(o);
        o.stop.max_error_m = bound;
        const Result<Simplified> s = simplify({grid, 30, 20}, o);
        ASSERT_TRUE(s) << s.error().what;
        EXPECT_LE(expect_promises(*s, grid).max_m, bound);
      }
    }
  }
}

TEST(Simplify, ReachesTheCountExactlyOnARoughTerrain) {
  const HeightGrid grid = rough_terrain(90, 70, 3);
  for (const Variant& variant : variants()) {
    for (const std::uint64_t n : {9000u, 4001u, 1200u}) {
      SimplifyOptions o;
      variant.set(o);
      o.stop.triangles = n;
      const Result<Simplified> s = simplify({grid, 30, 30}, o);
      ASSERT_TRUE(s);
      EXPECT_EQ(s->note, "") << variant.name;
      EXPECT_GE(s->tin.triangles.size(), n - 1) << variant.name;
      EXPECT_LE(s->tin.triangles.size(), n) << variant.name;
    }
  }
}

TEST(Simplify, FlatTerrainBecomesTwoTrianglesWhereTheBorderMayMove) {
  for (const char* method : {"qem", "memoryless"}) {
    SimplifyOptions o;
    o.method = *method_named(method);
    o.stop.max_error_m = 0;
    const Result<Simplified> s = simplify({HeightGrid(33, 20, 12), 30, 30}, o);
    ASSERT_TRUE(s);
    EXPECT_EQ(s->tin.triangles.size(), 2u) << method;
  }
}

TEST(Simplify, SaysWhyItStoppedShort) {
  SimplifyOptions o;
  o.method = EdgeCostOptions{};
  o.stop.triangles = 1;
  const Result<Simplified> s = simplify({rough_terrain(20, 20, 1), 30, 30}, o);
  ASSERT_TRUE(s);
  EXPECT_NE(s->note.find("stopped at"), std::string::npos) << s->note;
  o.stop.triangles = 1'000'000;
  EXPECT_NE(simplify({rough_terrain(20, 20, 1), 30, 30}, o)->note.find("only 722"),
            std::string::npos);
  o.method = {};
  EXPECT_NE(simplify({rough_terrain(20, 20, 1), 30, 30}, o)->note, "");
}

TEST(Simplify, IsDeterministic) {
  const HeightGrid grid = rough_terrain(60, 50, 2);
  for (const Variant& variant : variants()) {
    SimplifyOptions o;
    variant.set(o);
    o.stop.ratio = 0.1;
    const Result<Simplified> a = simplify({grid, 30, 30}, o), b = simplify({grid, 30, 30}, o);
    EXPECT_EQ(a->tin.vertices, b->tin.vertices) << variant.name;
    EXPECT_EQ(a->tin.triangles, b->tin.triangles) << variant.name;
  }
}

TEST(Simplify, SubsetPlacementKeepsOnlySamples) {
  const HeightGrid grid = rough_terrain(50, 40, 6);
  SimplifyOptions o;
  o.method = QemOptions{.subset_placement = true};
  o.stop.ratio = 0.1;
  const Result<Simplified> s = simplify({grid, 30, 30}, o);
  for (const Vec3& v : s->tin.vertices) {
    ASSERT_EQ(v.x, std::round(v.x));
    ASSERT_EQ(v.y, std::round(v.y));
    EXPECT_EQ(v.z, double(grid.at(int(v.x), int(-v.y))));
  }
}

TEST(Simplify, EdgeCostNeverTouchesTheBorder) {
  const HeightGrid grid = rough_terrain(21, 17, 6);
  SimplifyOptions o;
  o.method = EdgeCostOptions{};
  o.stop.triangles = 1;
  const Result<Simplified> s = simplify({grid, 30, 30}, o);
  EXPECT_EQ(check_validity(s->tin).border_edges, 2u * (20 + 16));
}

TEST(Simplify, EdgeCostWeightsAreDimensionless) {
  // Ten times the heights and ten times the spacing: the same mesh but for the scale.
  HeightGrid small = rough_terrain(40, 40, 9), large = small;
  for (float& z : small.values()) z = std::round(z);
  for (int i = 0; i < int(large.size()); ++i) large.values()[i] = small.values()[i] * 16;
  SimplifyOptions o;
  o.method = EdgeCostOptions{.alpha = 3, .beta = 2};
  o.stop.ratio = 0.2;
  const Result<Simplified> a = simplify({small, 8, 8}, o), b = simplify({large, 128, 128}, o);
  EXPECT_EQ(a->tin.triangles, b->tin.triangles);
  EXPECT_NEAR(b->details.at("alpha_scale") / a->details.at("alpha_scale"), 16, 1e-6);
  EXPECT_NEAR(b->details.at("beta_scale") / a->details.at("beta_scale"), 256, 1e-6);
}

TEST(Simplify, FindsTheRidgeOfARoof) {
  // A roof: two planes that meet in a straight ridge. Six corners describe it without any error.
  HeightGrid roof(41, 21, 0);
  for (int r = 0; r < 21; ++r)
    for (int c = 0; c < 41; ++c) roof.at(c, r) = float(10 - std::abs(r - 10));
  for (const char* method : {"qem", "memoryless"}) {
    SimplifyOptions o;
    o.method = *method_named(method);
    o.stop.triangles = 4;
    const Result<Simplified> s = simplify({roof, 30, 30}, o);
    EXPECT_LT(vertical_error(s->tin, roof).max_m, 0.1) << method;
  }
}

TEST(Simplify, RefusesNonsenseInOneLine) {
  const HeightGrid grid = rough_terrain(9, 9, 1);
  const auto error = [&](auto&& change) {
    SimplifyOptions o;
    o.method = EdgeCostOptions{};
    o.stop.ratio = 0.5;
    change(o);
    const Result<Simplified> s = simplify({grid, 30, 30}, o);
    EXPECT_FALSE(s);
    return s ? Error{} : s.error();
  };
  EXPECT_EQ(error([](auto& o) { o.stop.triangles = 5; }).code, Errc::invalid_argument);
  EXPECT_EQ(error([](auto& o) { o.stop.ratio = 1.5; }).code, Errc::invalid_argument);
  EXPECT_EQ(error([](auto& o) { o.stop.ratio = 0; }).code, Errc::invalid_argument);
  EXPECT_EQ(error([](auto& o) { o.stop = {}; }).code, Errc::invalid_argument);
  EXPECT_EQ(error([](auto& o) { o.stop = {.max_error_m = -1}; }).code, Errc::invalid_argument);
  EXPECT_EQ(error([](auto& o) { o.stop = {.max_error_m = NAN}; }).code, Errc::invalid_argument);
  EXPECT_EQ(error([](auto& o) { o.method = EdgeCostOptions{.alpha = 1e30}; }).code,
            Errc::invalid_argument);
  EXPECT_EQ(error([](auto& o) { o.method = EdgeCostOptions{.alpha = -1}; }).code,
            Errc::invalid_argument);
  SimplifyOptions o;
  o.stop.ratio = 0.5;
  EXPECT_EQ(simplify({HeightGrid(9, 1, 0), 30, 30}, o).error().code, Errc::bad_data);
  EXPECT_EQ(simplify({HeightGrid(9, 9), 30, 30}, o).error().code, Errc::bad_data);
  EXPECT_EQ(simplify({grid, 0, 30}, o).error().code, Errc::invalid_argument);
}

TEST(Methods, EachHasOneRowUnderItsOwnName) {
  const std::vector<MethodOptions> all = all_methods();
  ASSERT_EQ(all.size(), std::variant_size_v<MethodOptions>);
  for (std::size_t i = 0; i < all.size(); ++i) {
    EXPECT_EQ(all[i].index(), i);
    EXPECT_EQ(method_name(all[i]), methods()[i].name);
    EXPECT_EQ(method_named(methods()[i].name)->index(), i);
  }
}

TEST(Methods, ForOneThatThereIsNotThoseThatThereAreAreNamed) {
  for (const char* text : {"magic", "", "Qem", "qem:magic", "magic:best"}) {
    const auto method = method_variant(text);
    ASSERT_FALSE(method) << text;
    EXPECT_EQ(method.error().code, Errc::invalid_argument);
    EXPECT_NE(method.error().what.find("edge-cost"), std::string::npos) << method.error().what;
  }
}

TEST(Methods, AVariantIsTheValueOfOneOption) {
  const auto removal = method_variant("vertex-removal:k-degree");
  ASSERT_TRUE(removal);
  EXPECT_EQ(std::get<VertexRemovalOptions>(*removal).criterion, Criterion::k_degree);
  const auto attributed = method_variant("attribute-qem:ignored");
  ASSERT_TRUE(attributed);
  EXPECT_EQ(std::get<AttributeQemOptions>(*attributed).metric, AttributeMetric::ignored);
  EXPECT_EQ(method_variant("bounded:better").error().what,
            "there is no effort 'better': choose fast, normal or best");
}

TEST(Simplify, StopsWhenTold) {
  std::stop_source source;
  source.request_stop();
  SimplifyOptions o;
  o.stop.ratio = 0.1;
  const Result<Simplified> s =
      simplify({rough_terrain(30, 30, 1), 30, 30}, o, {nullptr, source.get_token()});
  ASSERT_FALSE(s);
  EXPECT_EQ(s.error().code, Errc::cancelled);
}

}  // namespace
}  // namespace tind
