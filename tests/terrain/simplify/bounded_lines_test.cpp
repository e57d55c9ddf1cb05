// `bounded` beside lines that stay: what insertion gives up there is mended.

#include <gtest/gtest.h>

#include <cmath>

#include "terrain/mesh/triangle_plane.h"
#include "terrain/simplify/bounded/bounded_mesher.h"

namespace tind {
namespace {

constexpr double kSide = 32767;

/// Water in the south, flat land in the north, and a post 11 units south of the line between the
/// two places where the shore goes out of its way: 167 m above the water, and not on the grid.
class ShoreBesidePost : public testing::Test {
 protected:
  const Vec3 post_{11941.75, 20854.38, 582.6};
  const std::vector<Vec3> shore_{{11843, 20840, 416}, {11849, 20816, 416}, {11871, 20784, 416},
                                 {11903, 20762, 416}, {11942, 20754, 416}, {11980, 20762, 416},
                                 {12012, 20784, 416}, {12034, 20816, 416}, {12042, 20854, 416},
                                 {12035, 20889, 416}};

  double worst(bool turned) const {
    const std::vector<Vec3> posts{post_, {11942, 21475, 589}};
    const ScatteredSamples samples(posts, kSide);
    Tin corners;
    corners.vertices = {{0, 0, 416}, {kSide, 0, 416}, {kSide, kSide, 590}, {0, kSide, 590}};
    corners.triangles = {{0, 1, 2}, {0, 2, 3}};
    HalfedgeMesh mesh = *HalfedgeMesh::from_tin(corners);
    InsertionOptions frame;
    frame.x_scale = 0.69;
    DelaunayInsertion<ScatteredSamples> insertion(mesh, samples, frame);
    LinePoints kept;
    HalfedgeMesh::Index before = HalfedgeMesh::kNone;
    for (const Vec3& p : shore_) EXPECT_TRUE(insertion.insert_point(p));
    for (HalfedgeMesh::Index v = 4; v < mesh.vertex_slots(); before = v++)
      if (before != HalfedgeMesh::kNone) {
        EXPECT_NE(mesh.find_edge(before, v), HalfedgeMesh::kNone);
        kept.add_edge(before, v);
      }
    MesherOptions o;
    o.eps = 2.4;
    o.relief = 174;
    o.x_scale = frame.x_scale;
    o.locked_border = o.integer_lattice = true;
    o.lattice_max = kSide;
    o.height_step = 0.25;
    o.turns = true;
    o.pinned = std::uint32_t(mesh.vertex_slots());
    if (!turned) return insertion_alone(mesh, samples, kept, o);
    BoundedMesher<ScatteredSamples> mesher(std::move(mesh), samples, o);
    mesher.keep(&kept);
    mesher.run();
    return error(mesher.mesh(), samples);
  }

 private:
  static double insertion_alone(HalfedgeMesh& mesh, const ScatteredSamples& samples,
                                LinePoints& kept, const MesherOptions& o) {
    InsertionOptions i;
    i.limit = o.eps, i.x_scale = o.x_scale, i.height_step = o.height_step;
    i.locked_border = i.integer_lattice = true;
    i.lattice_max = o.lattice_max;
    DelaunayInsertion<ScatteredSamples> insertion(mesh, samples, i);
    insertion.keep(&kept);
    insertion.run_passes({});
    return error(mesh, samples);
  }

  static double error(const HalfedgeMesh& mesh, const ScatteredSamples& samples) {
    EXPECT_EQ(mesh.check(), "");
    const Tin tin = mesh.to_tin();
    double most = 0;
    for (const Triangle& t : tin.triangles) {
      const Vec3 &a = tin.vertices[t[0]], &b = tin.vertices[t[1]], &c = tin.vertices[t[2]];
      const TrianglePlane plane(a, b, c);
      samples.scan(a, b, c, [&](double x, double y, double z, std::size_t) {
        most = std::max(most, std::abs(plane.at(x, y) - z));
        return true;
      });
    }
    return most;
  }
};

TEST_F(ShoreBesidePost, an_edge_from_shore_to_shore_just_beside_a_high_post_is_turned) {
  EXPECT_GT(worst(false), 4);  // else this shows nothing
  EXPECT_LE(worst(true), 2.4);
}

}  // namespace
}  // namespace tind
