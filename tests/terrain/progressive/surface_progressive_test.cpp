// General meshes as progressive meshes and as streams: every state a manifold within its bound.

#include "terrain/progressive/stream/surface_progressive.h"

#include <gtest/gtest.h>

#include <set>

#include "proto/stream/mesh_stream.h"
#include "terrain/mesh/surface_distance.h"
#include "terrain/progressive/stream/progressive_cursor.h"
#include "terrain/progressive/stream/progressive_stream.h"
#include "terrain/simplify/methods.h"
#include "tests/terrain/progressive/expand.h"
#include "tests/terrain/progressive/shapes.h"

namespace tind {
namespace {

struct Made {
  Tin input;
  SpaceLattice lattice;
  ProgressiveMesh mesh;
  proto::MeshStream stream;
  std::vector<std::uint8_t> bytes;
};

Made make(Tin input, const std::string& method, double step) {
  Made m;
  const Tin* const meshes[] = {&input};
  const auto lattice = lattice_of_step(meshes, step);
  EXPECT_TRUE(lattice) << lattice.error().what;
  m.lattice = *lattice;
  SimplifyOptions o;
  o.method = *method_named(method);
  auto made = make_progressive_surface(input, o, 12, *lattice);
  EXPECT_TRUE(made) << made.error().what;
  m.mesh = std::move(made->mesh);
  auto stream = to_stream(m.mesh, *lattice);
  EXPECT_TRUE(stream) << stream.error().what;
  m.stream = std::move(*stream);
  auto bytes = encode(m.stream);
  EXPECT_TRUE(bytes) << bytes.error().what;
  m.bytes = std::move(*bytes);
  m.input = std::move(input);
  return m;
}

using Corners = std::set<std::array<double, 9>>;
Corners corners(const Tin& t) {
  Corners all;
  for (Triangle f : t.triangles) {
    const auto key = [&](std::uint32_t v) {
      const Vec3& p = t.vertices[v];
      return std::array{p.x, p.y, p.z};
    };
    std::ranges::rotate(f, std::ranges::min_element(f, {}, key));
    std::array<double, 9> c;
    for (int k = 0; k < 9; ++k) c[k] = key(f[k / 3])[k % 3];
    all.insert(c);
  }
  return all;
}

TEST(SurfaceProgressive, EveryStateIsAManifoldAndWithinItsBoundOfTheFineSurface) {
  const std::vector<std::pair<const char*, Tin>> shapes = {{"sphere", test::sphere(300)},
                                                           {"torus", test::torus(20, 12)},
                                                           {"hills", test::hills(15)},
                                                           {"tube", test::tube(12, 14)}};
  for (const auto& [name, shape] : shapes) {
    for (const char* method : {"qem", "attribute-qem", "triangle-collapse"}) {
      const Made m = make(shape, method, 1.0 / 4096);
      const ProgressiveMesh pm = from_stream(m.stream);
      ASSERT_GT(pm.splits.size(), 100u) << name;
      ASSERT_LE(pm.fine_error_m, m.lattice.rounding());
      Tin mesh = pm.base;
      for (std::size_t i = 0;; ++i) {
        const double bound = i < pm.splits.size() ? double(pm.splits[i].error_m) : pm.fine_error_m;
        if (i % 40 == 0 || i == pm.splits.size()) {
          const auto whole = HalfedgeMesh::from_tin(mesh);
          ASSERT_TRUE(whole) << name << " " << method << " " << i << ": " << whole.error().what;
          const auto apart = surface_distance(shape, mesh, {.face_samples = 3000});
          ASSERT_LE(apart.max, bound + 1e-12) << name << " " << method << " " << i;
        }
        if (i == pm.splits.size()) break;
        ASSERT_EQ(mesh.vertices[pm.splits[i].vertex], pm.splits[i].vertex_coarse);
        test::apply_split(mesh, pm.splits[i]);
      }
      Tin rounded = shape;
      for (Vec3& v : rounded.vertices) v = m.lattice.snap(v);
      EXPECT_EQ(corners(mesh), corners(rounded)) << name << " " << method;
    }
  }
}

TEST(SurfaceProgressive, WhatIsDecodedIsWhatWasEncoded) {
  for (const Tin& shape : {test::sphere(200), test::hills(12), test::torus(16, 10)}) {
    const Made m = make(shape, "qem", 0.001);
    const auto back = proto::decode_mesh_stream(m.bytes);
    ASSERT_TRUE(back) << back.error().what;
    EXPECT_EQ(back->frame, proto::StreamFrame::space);
    EXPECT_EQ(back->splits, m.stream.splits);
    EXPECT_EQ(back->blocks, m.stream.blocks);
    EXPECT_EQ(back->base_vertices, m.stream.base_vertices);
    EXPECT_EQ(back->base_triangles, m.stream.base_triangles);
    EXPECT_EQ(back->per_unit, 1000);
    EXPECT_EQ(*encode(*back), m.bytes);
  }
}

TEST(SurfaceProgressive, AStreamCutAnywhereIsAStateOfTheWholeOrSaysWhy) {
  const Made m = make(test::tube(10, 9), "qem", 1.0 / 1024);
  const ProgressiveMesh whole = from_stream(m.stream);
  std::size_t last = 0;
  for (std::size_t n = 0; n <= m.bytes.size(); ++n) {
    const auto part = proto::decode_mesh_stream(std::span(m.bytes).first(n));
    if (!part) {
      ASSERT_EQ(last, 0u) << n << ": " << part.error().what;
      continue;
    }
    const ProgressiveMesh pm = from_stream(*part);
    ASSERT_GE(pm.splits.size(), last);
    last = pm.splits.size();
    for (std::size_t i = 0; i < last; ++i) ASSERT_EQ(pm.splits[i].added, whole.splits[i].added);
    ASSERT_TRUE(ProgressiveCursor::open(pm)) << n;
  }
  EXPECT_EQ(last, whole.splits.size());
}

TEST(SpaceLattice, DecimalsAndFloatsComeBackToTheLastBit) {
  Tin decimals;
  decimals.vertices = {{2.292449, -0.871852, -0.8824}, {0.000001, 3, 100}};
  const Tin* const one[] = {&decimals};
  const auto ten = exact_lattice(one);
  ASSERT_TRUE(ten);
  EXPECT_EQ(ten->per_unit, 1e6);
  for (const Vec3& v : decimals.vertices) EXPECT_EQ(ten->snap(v), v);

  Tin floats;
  floats.vertices = {{double(0.1f), double(0.3f), double(0.7f)}, {500000.5, 500001, 500000}};
  const Tin* const near[] = {&floats};
  EXPECT_FALSE(exact_lattice(near));  // too wide for so fine a step
  floats.vertices.pop_back();
  const auto two = exact_lattice(near);
  ASSERT_TRUE(two);
  EXPECT_EQ(two->snap(floats.vertices[0]), floats.vertices[0]);

  const SpaceLattice finest = finest_lattice(one);
  for (const Vec3& v : decimals.vertices)
    EXPECT_LE(length(finest.snap(v) - v), finest.rounding() * 1.0000001);
  EXPECT_FALSE(lattice_of_step(one, 1e-9));
  EXPECT_FALSE(lattice_of_step(one, 0));
  EXPECT_EQ(lattice_of_step(one, 0.001)->per_unit, 1000);
}

}  // namespace
}  // namespace tind
