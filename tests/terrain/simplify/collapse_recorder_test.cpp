#include "terrain/simplify/common/collapse_recorder.h"

#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "terrain/mesh/halfedge_mesh.h"
#include "terrain/simplify/methods.h"
#include "terrain/simplify/simplify.h"

namespace tind {
namespace {

using Index = HalfedgeMesh::Index;
constexpr Index kNone = HalfedgeMesh::kNone;

/// Plays what it hears on a mesh of its own.
class Player : public CollapseRecorder {
 public:
  using CollapseRecorder::CollapseRecorder;

  HalfedgeMesh mesh;
  std::vector<std::string> heard;
  std::size_t collapses = 0;
  Tin last;

  void fine(const HalfedgeMesh& m) override { mesh = m, heard.push_back("fine"); }
  void collapse(const Collapse& c) override {
    ASSERT_EQ(mesh.origin(c.edge), c.removed);
    ASSERT_EQ(mesh.dest(c.edge), c.kept);
    EXPECT_EQ(mesh.apex(c.edge), c.left);
    EXPECT_EQ(mesh.twin(c.edge) == kNone ? kNone : mesh.apex(mesh.twin(c.edge)), c.right);
    EXPECT_EQ(mesh.position(c.removed), c.removed_position);
    EXPECT_EQ(mesh.position(c.kept), c.kept_before);
    EXPECT_EQ(lattice.snap(c.kept_after), c.kept_after);
    mesh.collapse(c.edge);
    mesh.position(c.kept) = c.kept_after;
    ++collapses;
  }
  void base(const HalfedgeMesh& m) override { last = m.to_tin(), heard.push_back("base"); }
};

TEST(CollapseRecorder, HearsAllThatLeadsFromTheFineMeshToTheBase) {
  Terrain dem{HeightGrid(21, 17), 30, 30};
  for (int r = 0; r < 17; ++r)
    for (int c = 0; c < 21; ++c)
      dem.grid.at(c, r) = float(20 * std::sin(c * 0.7) * std::cos(r * 0.5) + c * r * 0.1);
  for (const char* method :
       {"edge-cost", "qem", "memoryless", "attribute-qem", "triangle-collapse"}) {
    Player player({4, 0.25}, 60);
    SimplifyOptions o;
    o.method = *method_named(method);
    o.stop.ratio = 0.5;
    o.recorder = &player;
    const Result<Simplified> made = simplify(dem, o);
    ASSERT_TRUE(made) << method;
    EXPECT_EQ(player.heard, (std::vector<std::string>{"fine", "base"})) << method;
    EXPECT_GT(player.collapses, 20u) << method;
    EXPECT_EQ(player.mesh.to_tin().triangles, player.last.triangles) << method;
    EXPECT_EQ(player.mesh.to_tin().vertices, player.last.vertices) << method;
    EXPECT_EQ(made->tin.vertices, player.last.vertices) << method;
    EXPECT_LE(player.last.triangles.size(), 74u) << method << " (edge-cost keeps the border)";
  }
}

TEST(CollapseRecorder, OfABorderEdgeThereIsNoRightApex) {
  Tin tin;
  tin.vertices = {{0, 0, 1}, {2, 0, 2}, {2, 2, 3}, {0, 2, 4}};
  tin.triangles = {{0, 1, 2}, {0, 2, 3}};
  const HalfedgeMesh m = *HalfedgeMesh::from_tin(tin);
  const Collapse side = collapse_of(m, m.find(0, 1), {1, 0, 9});
  EXPECT_EQ(side.left, 2u);
  EXPECT_EQ(side.right, kNone);
  EXPECT_EQ(side.kept_after, (Vec3{1, 0, 9}));
  const Collapse diagonal = collapse_of(m, m.find(0, 2), {});
  EXPECT_EQ(diagonal.left, 3u);
  EXPECT_EQ(diagonal.right, 1u);
}

}  // namespace
}  // namespace tind
