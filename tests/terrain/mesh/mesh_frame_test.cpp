#include "terrain/mesh/mesh_frame.h"

#include <gtest/gtest.h>

#include "terrain/mesh/validity.h"

namespace tind {
namespace {

Tin posts() { return {{{0, 0, 10}, {0, -1, 20}, {1, 0, 30}}, {{0, 1, 2}}, {}, {}, {}}; }

TEST(MeshFrame, SourceIsTheGeotransformAtPixelCentres) {
  DemInfo info;
  info.post_to_crs = {500015, 30, 0, 4200000, 0, -30};
  const Tin tin = mesh_map(info, MeshFrame::source, false).from_posts(posts());
  EXPECT_EQ(tin.vertices[1], (Vec3{500015, 4199970, 20}));
  EXPECT_EQ(tin.vertices[2], (Vec3{500045, 4200000, 30}));
}

TEST(MeshFrame, MetricCountsMetresFromTheFirstPost) {
  DemInfo info;
  info.spacing_x_m = 20;
  info.spacing_y_m = 30;
  const Tin tin = mesh_map(info, MeshFrame::metric, false).from_posts(posts());
  EXPECT_EQ(tin.vertices[1], (Vec3{0, -30, 20}));
  EXPECT_EQ(tin.vertices[2], (Vec3{20, 0, 30}));
}

TEST(MeshFrame, SourceUnitsOfHeight) {
  DemInfo info;
  info.z_unit_m = 0.5;
  const MeshMap map = mesh_map(info, MeshFrame::metric, true);
  EXPECT_EQ(map.from_posts(posts()).vertices[2].z, 60);
  EXPECT_EQ(map.to_posts(map.from_posts(posts())).vertices[2].z, 30);
}

TEST(MeshFrame, StaysCounterClockwiseWhereRowsGoNorthOrColumnsWest) {
  DemInfo info;
  for (const double col : {30.0, -30.0}) {
    for (const double row : {30.0, -30.0}) {
      info.post_to_crs = {100, col, 0, 200, 0, row};
      const MeshMap map = mesh_map(info, MeshFrame::source, false);
      const Tin tin = map.from_posts(posts());
      EXPECT_EQ(check_validity(tin).flipped, 0u) << col << " " << row;
      const Tin back = map.to_posts(tin);
      EXPECT_EQ(back.vertices, posts().vertices);
      EXPECT_EQ(back.triangles, posts().triangles);
    }
  }
}

}  // namespace
}  // namespace tind
