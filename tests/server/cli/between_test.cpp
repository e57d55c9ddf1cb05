#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <set>

#include "proto/mesh/mesh_io.h"
#include "terrain/mesh/mesh_file.h"
#include "terrain/mesh/mesh_frame.h"
#include "tests/support/program.h"
#include "tests/support/support.h"
#include "tests/terrain/progressive/expand.h"
#include "tests/terrain/progressive/shapes.h"

namespace tind {
namespace {

std::string write(const test::TempDir& dir, const char* name, const Tin& tin) {
  const std::string path = dir.file(name);
  EXPECT_TRUE(write_mesh(path, to_file_mesh(tin)));
  return path;
}

Tin read(const std::string& path) {
  auto file = read_mesh(path);
  EXPECT_TRUE(file) << file.error().what;
  return from_file_mesh(std::move(*file));
}

/// With few decimals, so that a lattice holds it.
Tin rounded(Tin t) {
  for (Vec3& v : t.vertices)
    v = {std::round(v.x * 1e4) / 1e4, std::round(v.y * 1e4) / 1e4, std::round(v.z * 1e4) / 1e4};
  return t;
}

TEST(Between, ExtractFindsBothModelsAtTheEnds) {
  const test::TempDir dir;
  const std::string tpm = dir.file("way.tpm"), out = dir.file("out.ply");
  const std::vector<std::pair<Tin, Tin>> pairs = {
      {rounded(test::sphere(500)), rounded(test::box({-1, -1, -1}, {1, 1, 1}))},
      {rounded(test::hills(12)), rounded(test::hills(2))}};
  for (const auto& [fine, coarse] : pairs) {
    const auto made = test::run_tind("between " + write(dir, "fine.ply", fine) + " " +
                                     write(dir, "coarse.ply", coarse) + " -o " + tpm + " --json");
    ASSERT_EQ(made.code, 0) << made.out;
    const auto figures = nlohmann::json::parse(made.answer);
    EXPECT_EQ(figures.at("positions_exact"), true);
    // Made by splitting edges at random, the fine one is full of slivers.
    EXPECT_LE(100 * figures.at("triangles_turned").get<int>(), figures.at("splits").get<int>());

    const auto extract = [&](const std::string& triangles) {
      const auto got =
          test::run_tind("extract " + tpm + " --triangles " + triangles + " -o " + out);
      EXPECT_EQ(got.code, 0) << got.out;
      return read(out);
    };
    const Tin first = extract(std::to_string(coarse.triangles.size())), last = extract("1000000");
    EXPECT_EQ(first.vertices, coarse.vertices);
    EXPECT_EQ(test::sorted_triangles(first), test::sorted_triangles(coarse));
    EXPECT_EQ(last.vertices.size(),
              coarse.vertices.size() + figures.at("splits").get<std::size_t>());
    std::set<std::array<double, 3>> there;
    for (const Vec3& v : last.vertices) there.insert({v.x, v.y, v.z});
    for (const Vec3& v : fine.vertices) EXPECT_TRUE(there.contains({v.x, v.y, v.z}));
  }
}

TEST(Between, RefusesInOneLineWithThePlace) {
  const test::TempDir dir;
  const std::string ball = write(dir, "ball.ply", test::sphere(50)),
                    sheet = write(dir, "sheet.ply", test::hills(2)), tpm = dir.file("x.tpm");
  const auto apart = test::run_tind("between " + ball + " " + sheet + " -o " + tpm);
  EXPECT_EQ(apart.code, 2) << apart.out;
  EXPECT_NE(apart.out.find("border at ("), std::string::npos) << apart.out;
  EXPECT_NE(test::run_tind("between " + ball + " nothing.ply -o " + tpm).code, 0);
  EXPECT_EQ(test::run_tind("between " + ball + " " + ball + " --step 1e-15 -o " + tpm).code, 2);
  EXPECT_EQ(test::run_tind("between " + ball + " " + ball + " -o /nowhere/x.tpm").code, 73);
}

}  // namespace
}  // namespace tind
