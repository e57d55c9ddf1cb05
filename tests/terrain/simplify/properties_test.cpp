// What holds for every method in the table, over the most awkward inputs there are: valid, all
// posts covered, the same every time, and stopped exactly where asked, or with a word that says why
// not. A method that is added is tested without a change here.

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <random>

#include "terrain/mesh/manifold.h"
#include "terrain/mesh/validity.h"
#include "terrain/mesh/vertical_error.h"
#include "terrain/simplify/common/simplified.h"
#include "terrain/simplify/methods.h"
#include "terrain/simplify/options.h"
#include "terrain/simplify/simplify.h"
#include "terrain/simplify/simplify_mesh.h"
#include "tests/support/support.h"

namespace tind {
namespace {

using test::grid_from;
using test::rough_terrain;

struct World {
  const char* name;
  std::function<HeightGrid(unsigned seed)> grid;
};

HeightGrid of_each_post(unsigned seed,
                        const std::function<float(int c, int r, float z, unsigned chance)>& f) {
  std::mt19937 random(seed);
  HeightGrid g = rough_terrain(5 + int(random() % 25), 5 + int(random() % 25), seed);
  for (int r = 0; r < g.rows(); ++r)
    for (int c = 0; c < g.cols(); ++c) g.at(c, r) = f(c, r, g.at(c, r), unsigned(random()));
  return g;
}

const std::vector<World>& worlds() {
  static const std::vector<World> all = {
      {"plateaus",
       [](unsigned s) {
         return of_each_post(s,
                             [](int, int, float z, unsigned) { return std::floor(z / 100) * 100; });
       }},
      {"spikes",
       [](unsigned s) {
         return of_each_post(
             s, [](int, int, float, unsigned chance) { return chance % 30 ? 0.f : 9000.f; });
       }},
      {"noise",
       [](unsigned s) {
         return of_each_post(s,
                             [](int, int, float, unsigned chance) { return float(chance % 1000); });
       }},
      {"flat",
       [](unsigned s) { return of_each_post(s, [](int, int, float, unsigned) { return -3.5f; }); }},
      {"checkerboard",
       [](unsigned s) {
         return of_each_post(
             s, [](int c, int r, float, unsigned) { return (c + r) % 2 ? 500.f : -500.f; });
       }},
      {"voids",
       [](unsigned s) {
         return of_each_post(s, [](int, int, float z, unsigned chance) {
           return chance % 9 ? z : std::numeric_limits<float>::quiet_NaN();
         });
       }},
      {"mostly void",
       [](unsigned s) {
         return of_each_post(s, [](int c, int r, float z, unsigned chance) {
           const bool lake = c > 3 && c < 9 && r > 2;
           return chance % 5 < 2 && !lake && c + r > 0 ? z
                                                       : std::numeric_limits<float>::quiet_NaN();
         });
       }},
      {"steep",
       [](unsigned s) {
         return of_each_post(s, [](int c, int r, float z, unsigned) {
           return z + 4000.f * float(c) - 2500.f * float(r);
         });
       }},
      {"2 x 2", [](unsigned s) { return s % 2 ? grid_from("1 2 / 3 4") : grid_from("0 9 / 9 0"); }},
      {"2 x n", [](unsigned s) { return rough_terrain(2, 5 + int(s), s); }},
      {"n x 3", [](unsigned s) { return rough_terrain(9 + int(s), 3, s); }},
  };
  return all;
}

/// Each method of the table, and each value of each of its options that has names.
std::vector<SimplifyOptions> every_method() {
  std::vector<SimplifyOptions> all;
  const auto add = [&](const MethodOptions& method) { all.emplace_back().method = method; };
  for (const MethodOptions& method : all_methods()) {
    add(method);
    std::visit(
        [&](const auto& defaults) {
          defaults.each_option([&](const char*, auto member, const char*) {
            using Field = std::remove_cvref_t<decltype(defaults.*member)>;
            auto other = defaults;
            if constexpr (NamedEnum<Field> && !std::is_same_v<Field, AttributeChoice>) {
              for (const auto& entry : EnumNames<Field>::kAll) {
                other.*member = entry.first;
                if (entry.first != defaults.*member) add(other);
              }
            } else if constexpr (std::is_same_v<Field, bool>) {
              other.*member = true;
              add(other);
            }
          });
        },
        method);
  }
  return all;
}

/// How many posts stay uncovered in the best of cases: those that no triangle of posts holds.
std::uint64_t lonely_posts(const HeightGrid& g) {
  SimplifyOptions o;
  o.method = QemOptions{};
  o.stop.ratio = 1;
  const auto full = simplify({g, 30, 20}, o);
  return full ? vertical_error(full->tin, g).uncovered : g.size();
}

void expect_valid(const Simplified& s, const HeightGrid& g, std::uint64_t lonely) {
  const MeshValidity v = check_validity(s.tin);
  EXPECT_TRUE(v.ok()) << v.first_problem;
  EXPECT_LE(vertical_error(s.tin, g).uncovered, lonely);
}

void expect_same(const Simplified& a, const Simplified& b) {
  EXPECT_EQ(a.tin.vertices, b.tin.vertices);
  EXPECT_EQ(a.tin.triangles, b.tin.triangles);
}

class EveryMethod : public testing::TestWithParam<SimplifyOptions> {
 protected:
  void on_each(const std::function<void(const HeightGrid&, std::uint64_t lonely)>& f) {
    for (const World& world : worlds()) {
      for (unsigned seed = 1; seed <= 2; ++seed) {
        SCOPED_TRACE(std::string(world.name) + " " + std::to_string(seed));
        const HeightGrid g = world.grid(seed);
        f(g, lonely_posts(g));
      }
    }
  }
};

/// Of both kinds of DEM: with posts farther apart from west to east, and from north to south.
constexpr double kSpacings[][2] = {{30, 20}, {18, 31}};

TEST_P(EveryMethod, NeverLeavesMoreThanTheCountOrSaysWhy) {
  unsigned n = 0;
  on_each([&](const HeightGrid& g, std::uint64_t lonely) {
    std::vector<StopAt> stops;
    for (const double ratio : {0.6, 0.2, 0.03}) stops.push_back({.ratio = ratio});
    for (const unsigned count : {1, 2, 3, 17, 100}) stops.push_back({.triangles = count});
    for (const StopAt& stop : stops) {
      const auto& [sx, sy] = kSpacings[++n % 2];
      SimplifyOptions o = GetParam();
      o.stop = stop;
      const auto made = simplify({g, sx, sy}, o);
      ASSERT_TRUE(made) << made.error().what;
      expect_valid(*made, g, lonely);
      if (stop.ratio) expect_same(*made, *simplify({g, sx, sy}, o));
      const double target =
          stop.ratio ? *stop.ratio * double(made->input_triangles) : double(*stop.triangles);
      const auto left = double(made->tin.triangles.size());
      if (left > target + 1e-9 || left < std::min(0.99 * target - 1, target - 2)) {
        EXPECT_NE(made->note, "") << left << " of " << target;
      }
      // More than asked only where no step is left to take.
      if (left > target + 1e-9) {
        SimplifyOptions least = o;
        least.stop = {.triangles = 1};
        EXPECT_EQ(simplify({g, sx, sy}, least)->tin.triangles.size(), made->tin.triangles.size());
      }
    }
  });
}

TEST_P(EveryMethod, KeepsTheErrorBound) {
  unsigned n = 0;
  on_each([&](const HeightGrid& g, std::uint64_t lonely) {
    for (const double bound : {1e-6, 0.01, 7.0, 300.0}) {
      const auto& [sx, sy] = kSpacings[++n % 2];
      SimplifyOptions o = GetParam();
      o.stop.max_error_m = bound;
      const auto made = simplify({g, sx, sy}, o);
      ASSERT_TRUE(made) << made.error().what;
      expect_valid(*made, g, lonely);
      expect_same(*made, *simplify({g, sx, sy}, o));
      const VerticalError error = vertical_error(made->tin, g);
      EXPECT_LE(error.max_m, bound * (1 + 1e-9) + 1e-8);
      const auto* const bounded = std::get_if<BoundedOptions>(&o.method);
      const Side side = bounded ? bounded->side : Side::both;
      if (side == Side::above) {
        EXPECT_LE(error.max_below_m, 1e-8);
      }
      if (side == Side::below) {
        EXPECT_LE(error.max_above_m, 1e-8);
      }
      EXPECT_EQ(made->note, "");
    }
  });
}

TEST_P(EveryMethod, RefusesWhatHasNoTriangles) {
  SimplifyOptions o = GetParam();
  o.stop.ratio = 0.5;
  for (const HeightGrid& g : {HeightGrid(1, 1, 0), HeightGrid(1, 9, 0), HeightGrid(9, 1, 0)}) {
    const auto made = simplify({g, 30, 30}, o);
    ASSERT_FALSE(made);
    EXPECT_EQ(made.error().code, Errc::bad_data);
    EXPECT_NE(made.error().what.find("2 x 2"), std::string::npos) << made.error().what;
  }
  EXPECT_EQ(simplify({HeightGrid(9, 9), 30, 30}, o).error().code, Errc::bad_data);
}

INSTANTIATE_TEST_SUITE_P(Table, EveryMethod, testing::ValuesIn(every_method()),
                         [](const testing::TestParamInfo<SimplifyOptions>& row) {
                           std::string name =
                               method_name(row.param.method) + std::to_string(row.index);
                           std::erase(name, '-');
                           return name;
                         });

/// Triangles among random points, as a scanner that lost its mind would give them.
Tin soup(unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> at(-1, 1);
  Tin tin;
  const unsigned points = 4 + random() % 40;
  for (unsigned i = 0; i < points; ++i)
    tin.vertices.push_back({at(random), at(random), seed % 3 ? at(random) : 0});
  for (unsigned i = 0; i < 4 + random() % 80; ++i)
    tin.triangles.push_back(
        {unsigned(random() % points), unsigned(random() % points), unsigned(random() % points)});
  return tin;
}

/// A closed surface with bumps.
Tin ball(unsigned seed) {
  std::mt19937 random(seed);
  const unsigned n = 6 + random() % 20, m = 4 + random() % 12;
  Tin tin;
  for (unsigned j = 0; j <= m; ++j) {
    for (unsigned i = 0; i < n; ++i) {
      const double a = 6.283185307179586 * i / n, b = 3.141592653589793 * j / m;
      const double r = 1 + double(random() % 100) / 500;
      tin.vertices.push_back(
          {r * std::sin(b) * std::cos(a), r * std::sin(b) * std::sin(a), r * std::cos(b)});
    }
  }
  for (unsigned j = 0; j < m; ++j) {
    for (unsigned i = 0; i < n; ++i) {
      const unsigned p = j * n + i, q = j * n + (i + 1) % n;
      tin.triangles.push_back({p, p + n, q});
      tin.triangles.push_back({q, p + n, q + n});
    }
  }
  return tin;
}

TEST(EveryMeshMethod, LeavesAManifoldAndStopsAtTheCountOrSaysWhyNot) {
  for (const char* method : {"qem", "attribute-qem", "triangle-collapse"}) {
    for (unsigned seed = 1; seed <= 40; ++seed) {
      const Tin tin = seed % 2 ? soup(seed) : ball(seed);
      for (const double ratio : {0.7, 0.2}) {
        SCOPED_TRACE(std::string(method) + " " + std::to_string(seed));
        SimplifyOptions o;
        o.method = *method_named(method);
        if (auto* const attributed = std::get_if<AttributeQemOptions>(&o.method))
          attributed->attributes = AttributeChoice::normal;
        o.stop.ratio = ratio;
        const auto result = simplify_mesh(tin, o);
        if (!result) {
          EXPECT_EQ(result.error().code, Errc::bad_data) << result.error().what;
          continue;
        }
        const Simplified& made = result->made;
        Tin again = made.tin;
        EXPECT_FALSE(make_manifold(again).changed());
        for (const Vec3& v : made.tin.vertices) EXPECT_TRUE(std::isfinite(v.x + v.y + v.z));
        expect_same(made, simplify_mesh(tin, o)->made);
        const double target = ratio * double(made.input_triangles);
        if (std::abs(double(made.tin.triangles.size()) - target) > 2) {
          EXPECT_NE(made.note, "") << made.tin.triangles.size() << " of " << target;
        }
      }
    }
  }
}

TEST(EdgeCost, WeightsThatAreNoNumbersAreRefused) {
  const HeightGrid g = test::grid_from("0 1 2 / 3 4 9 / 5 2 7");
  for (const double wrong : {std::nan(""), HUGE_VAL, -1.0, 1e200})
    for (const bool first : {true, false}) {
      SimplifyOptions o;
      o.stop.triangles = 4;
      o.method = EdgeCostOptions{.alpha = first ? wrong : 1, .beta = first ? 1 : wrong};
      const auto made = simplify({g, 1, 1}, o);
      ASSERT_FALSE(made) << wrong;
      EXPECT_EQ(made.error().code, Errc::invalid_argument);
    }
}

}  // namespace
}  // namespace tind
