#include "proto/mesh/mesh_io.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>

#include <algorithm>
#include <cmath>
#include <csignal>
#include <cstring>
#include <filesystem>
#include <random>

#include "terrain/base/file_io.h"
#include "terrain/mesh/mesh_file.h"
#include "tests/support/support.h"

namespace tind::proto {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using Triangle = std::array<std::uint32_t, 3>;

/// A piece of UTM terrain with every attribute, numbers with all their digits.
Mesh full_mesh(std::size_t vertices = 50) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> share(0, 1);
  Mesh m;
  for (std::size_t i = 0; i < vertices; ++i) {
    m.positions.push_back(
        {567890 + 1000 * share(random), 4801234 + 1000 * share(random), 1800 + share(random) / 3});
    m.normals.push_back({float(share(random)), float(share(random)), 1});
    m.colours.push_back({float(i % 256) / 255, 0, 1});
    m.texcoords.push_back({float(share(random)), float(share(random))});
  }
  for (std::uint32_t i = 0; i + 2 < vertices; ++i) m.triangles.push_back({i, i + 1, i + 2});
  m.texture = "ortho photo.png";
  return m;
}

Mesh must(Result<Mesh> mesh) {
  EXPECT_TRUE(mesh.has_value()) << mesh.error().what;
  return mesh.value_or(Mesh{});
}

void expect_same(const Mesh& a, const Mesh& b) {
  EXPECT_EQ(a.positions, b.positions);
  EXPECT_EQ(a.triangles, b.triangles);
  EXPECT_EQ(a.normals, b.normals);
  EXPECT_EQ(a.colours, b.colours);
  EXPECT_EQ(a.texcoords, b.texcoords);
}

TEST(MeshIo, PlyLosesNothing) {
  const Mesh m = full_mesh();
  const Mesh back = must(decode_ply(encode_ply(m)));
  expect_same(m, back);
  EXPECT_EQ(back.texture, m.texture);
  expect_same(m, must(decode_ply(encode_ply(m, {.float_colours = true}))));
  Mesh bare;
  bare.positions = m.positions;
  bare.triangles = m.triangles;
  expect_same(bare, must(decode_ply(encode_ply(bare))));
}

TEST(MeshIo, ObjLosesNothing) {
  const tind::test::TempDir dir;
  const Mesh m = full_mesh();
  ASSERT_TRUE(write_mesh(dir.file("a.obj"), m));
  const Mesh back = must(read_mesh(dir.file("a.obj")));
  expect_same(m, back);
  EXPECT_EQ(back.texture, m.texture);
  EXPECT_THAT(back.material_libraries, ElementsAre("a.mtl"));
  Mesh only_normals = m;
  only_normals.texcoords.clear();
  expect_same(only_normals, must(decode_obj(encode_obj(only_normals))));
}

TEST(MeshIo, StlIsRelativeToAnOriginSoThatFloatSuffices) {
  const Mesh m = full_mesh();
  const Stl stl = encode_stl(m);
  EXPECT_EQ(stl.bytes.size(), 84 + 50 * m.triangles.size());
  EXPECT_NE(stl.origin[0], 0);
  EXPECT_EQ(stl.origin[2], 0);  // 1800 m is near enough to zero for a mesh of 1400 m
  EXPECT_EQ(stl.origin[1], std::round(stl.origin[1]));
  const Mesh back = must(decode_stl(stl.bytes));
  ASSERT_EQ(back.triangles.size(), m.triangles.size());
  for (std::size_t t = 0; t < m.triangles.size(); ++t)
    for (int k = 0; k < 3; ++k)
      for (int i = 0; i < 3; ++i)
        EXPECT_NEAR(back.positions[back.triangles[t][k]][i], m.positions[m.triangles[t][k]][i],
                    1e-4);
  Mesh small;
  small.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0.5}};
  small.triangles = {{0, 1, 2}};
  EXPECT_EQ(encode_stl(small).origin, (std::array<double, 3>{}));
}

TEST(MeshIo, StlWeldsCorners) {
  Mesh square;
  square.positions = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};
  square.triangles = {{0, 1, 2}, {0, 2, 3}};
  const Mesh back = must(decode_stl(encode_stl(square).bytes));
  EXPECT_EQ(back.positions, square.positions);
  EXPECT_EQ(back.triangles, square.triangles);
}

TEST(MeshIo, AsciiStl) {
  const Mesh m =
      must(decode_stl("solid a\nfacet normal 0 0 1\n outer loop\n  vertex 0 0 0\n  vertex 1.5 0 0\n"
                      "  vertex -0 1e0 0\n endloop\nendfacet\nendsolid a\n"));
  EXPECT_THAT(m.triangles, ElementsAre(Triangle{0, 1, 2}));
  EXPECT_EQ(m.positions[1][0], 1.5);
  const Mesh shouted =
      must(decode_stl("\xef\xbb\xbf  SOLID A\nFACET NORMAL 0 0 1\n OUTER LOOP\n VERTEX 0 0 0\n"
                      "VERTEX 1 0 0\nVERTEX 0 1 0\n ENDLOOP\nENDFACET\nENDSOLID A\n"));
  EXPECT_THAT(shouted.triangles, ElementsAre(Triangle{0, 1, 2}));
  EXPECT_THAT(decode_stl("solid a\nouter loop\nvertex 1 2\n").error().what, HasSubstr("line 3"));
  const std::string loop = "solid\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\n";
  EXPECT_THAT(decode_stl(loop + "endloop\nendsolid\n").error().what, HasSubstr("line 7"))
      << "its triangles would be there twice";
}

TEST(MeshIo, AsciiPlyWithEverything) {
  const Mesh m = must(decode_ply(
      "ply\r\nformat ascii 1.0\r\ncomment TextureFile a b.png\r\n"
      "element vertex 4\r\nproperty float x\r\nproperty float y\r\nproperty float z\r\n"
      "property list uchar int extra\r\nproperty uchar red\r\nproperty uchar green\r\n"
      "property uchar blue\r\nelement thing 1\r\nproperty int a\r\nelement face 2\r\n"
      "property uchar flag\r\nproperty list uchar int vertex_index\r\nend_header\r\n"
      "0 0 0 0 255 0 51\r\n+1 0 0 2 7 7 0 0 0\r\n1 1 0 0 0 0 0\r\n0 1 1e1 0 0 0 0\r\n9\r\n"
      "1 4 0 1 2 3\r\n0 3 0 1 2\r\n"));
  EXPECT_EQ(m.positions.size(), 4u);
  EXPECT_THAT(m.triangles, ElementsAre(Triangle{0, 1, 2}, Triangle{0, 2, 3}, Triangle{0, 1, 2}));
  EXPECT_EQ(m.colours[0], (std::array<float, 3>{1, 0, 0.2f}));
  EXPECT_EQ(m.positions[3][2], 10);
  EXPECT_EQ(m.texture, "a b.png");
}

TEST(MeshIo, BigEndianPlyWithStrips) {
  std::string bytes =
      "ply\nformat binary_big_endian 1.0\nelement vertex 5\nproperty short x\nproperty short y\n"
      "property short z\nelement tristrips 1\nproperty list int int vertex_indices\nend_header\n";
  for (int i = 0; i < 5; ++i)
    for (const int x : {i, i % 2, 256}) bytes += {char(x >> 8), char(x)};
  for (const int x : {8, 0, 1, 2, 3, -1, 2, 3, 4})
    bytes += {char(x >> 24), char(x >> 16), char(x >> 8), char(x)};
  const Mesh m = must(decode_ply(bytes));
  EXPECT_EQ(m.positions[3], (std::array<double, 3>{3, 1, 256}));
  EXPECT_THAT(m.triangles, ElementsAre(Triangle{0, 1, 2}, Triangle{2, 1, 3}, Triangle{2, 3, 4}));
}

TEST(MeshIo, ObjIndexForms) {
  const Mesh m = must(decode_obj(
      "# c\nmtllib a.mtl\nv 0 0 0\nv 1 0 0 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvn 0 0 1\n"
      "usemtl stone\nf 1 2 3\nf -4// -2// -1//\nf 1/1/1 3/2/1 4//1 # end\nf 1 2 \\\n 3 4\n"));
  ASSERT_EQ(m.positions.size(), 7u);  // the third face's corners have attributes: split
  EXPECT_THAT(m.triangles, ElementsAre(Triangle{0, 1, 2}, Triangle{0, 2, 3}, Triangle{4, 5, 6},
                                       Triangle{0, 1, 2}, Triangle{0, 2, 3}));
  EXPECT_EQ(m.positions[5], m.positions[2]);
  EXPECT_EQ(m.texcoords[5], (std::array<float, 2>{1, 0}));
  EXPECT_EQ(m.normals[6], (std::array<float, 3>{0, 0, 1}));
  EXPECT_EQ(m.colours[1], (std::array<float, 3>{1, 0, 0}));
  EXPECT_EQ(m.colours[0], (std::array<float, 3>{1, 1, 1}));
  EXPECT_THAT(m.materials, ElementsAre("stone"));
}

TEST(MeshIo, ABackslashJoinsLinesOfObjAlone) {
  const Mesh m = must(
      decode_obj("# made in C:\\maps\\\nv 9 9 9\n  # and C:\\\nv 1 0 0\nv 0 1 0\nf 1 \\\n2 3\n"));
  ASSERT_EQ(m.positions.size(), 3u);
  EXPECT_EQ(m.positions[0], (std::array<double, 3>{9, 9, 9}));
  EXPECT_THAT(m.triangles, ElementsAre(Triangle{0, 1, 2}));
  const Mesh two = must(
      decode_2dm("MESH2D\nMESHNAME \"C:\\\nND 1 0 0 0\nND 2 1 0 0\nND 3 0 1 0\nE3T 1 1 2 3 1\n"));
  EXPECT_EQ(two.positions.size(), 3u);
}

TEST(MeshIo, FacesOfVeryManyCornersAreHalved) {
  constexpr int kCorners = 1000;
  std::string obj, face = "f",
                   ply =
                       "ply\nformat ascii 1.0\nelement vertex 1000\n"
                       "property double x\nproperty double y\nproperty double z\n"
                       "element face 1\nproperty list int int vertex_indices\n"
                       "end_header\n",
                   row = "1000";
  for (int i = 0; i < kCorners; ++i) {
    const double a = 2 * 3.14159265358979 * i / kCorners;
    const std::string at = std::to_string(std::cos(a)) + " " + std::to_string(std::sin(a)) + " 0\n";
    obj += "v " + at, ply += at;
    face += " " + std::to_string(i + 1), row += " " + std::to_string(i);
  }
  const auto mesh = decode_obj(obj + face + "\n");
  ASSERT_TRUE(mesh) << mesh.error().what;
  const auto same = decode_ply(ply + row + "\n");
  ASSERT_TRUE(same) << same.error().what;
  EXPECT_EQ(mesh->triangles, same->triangles);
  ASSERT_EQ(mesh->triangles.size(), std::size_t(kCorners - 2));
  std::vector<int> triangles(kCorners, 0);
  double area = 0;
  for (const auto& t : mesh->triangles) {
    for (const auto v : t) ++triangles[v];
    const auto &a = mesh->positions[t[0]], &b = mesh->positions[t[1]], &c = mesh->positions[t[2]];
    const double twice = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
    EXPECT_GT(twice, 0);
    area += twice / 2;
  }
  EXPECT_NEAR(area, 3.14159, 1e-3);
  EXPECT_LE(*std::ranges::max_element(triangles), 20);  // two for each of ten halvings
  const auto square = decode_obj("v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv -1 .5 0\nf 1 2 3 4 5\n");
  ASSERT_TRUE(square);
  EXPECT_EQ(square->triangles,
            (std::vector<std::array<std::uint32_t, 3>>{{0, 1, 2}, {0, 2, 3}, {0, 3, 4}}));
}

TEST(MeshIo, MaterialsNameTheirTexture) {
  const char* mtl =
      "newmtl a\nKd 1 1 1\nmap_Kd a.png\nnewmtl b\nmap_Kd -s 1 1 1 -clamp on dir/b c.png\n";
  EXPECT_EQ(diffuse_texture(mtl, "b"), "dir/b c.png");
  EXPECT_EQ(diffuse_texture(mtl, ""), "a.png");
  EXPECT_EQ(diffuse_texture(mtl, "c"), "");
}

TEST(MeshIo, MaterialLibrariesOutsideTheFolderAreNotFollowed) {
  const tind::test::TempDir dir;
  std::filesystem::create_directory(dir.path() / "in");
  ASSERT_TRUE(write_whole_file(dir.file("secret.mtl"), "newmtl a\nmap_Kd leaked.png\n"));
  for (const std::string& name : {std::string("../secret.mtl"), dir.file("secret.mtl")}) {
    ASSERT_TRUE(write_whole_file(dir.file("in/a.obj"), "mtllib " + name + "\nv 0 0 0\n"));
    EXPECT_EQ(must(read_mesh(dir.file("in/a.obj"))).texture, "");
  }
}

TEST(MeshIo, SaysWhereItIsWrong) {
  const auto why = [](Result<Mesh> m) { return m ? "read" : m.error().what; };
  EXPECT_THAT(why(decode_obj("v 0 0 0\nv 1 x 0\n")), HasSubstr("line 2"));
  EXPECT_THAT(why(decode_obj("v 0 0 0\nf 1 1 2\n")), HasSubstr("line 2"));
  EXPECT_THAT(why(decode_obj("v 0 0 0\nf 1 0 1\n")), HasSubstr("line 2"));
  EXPECT_THAT(why(decode_obj("v 0 0 nan\n")), HasSubstr("line 1"));
  EXPECT_THAT(why(decode_ply("plx\n")), HasSubstr("not a PLY"));
  EXPECT_THAT(why(decode_ply("ply\nformat ascii 1.0\n")), HasSubstr("end_header"));
  EXPECT_THAT(why(decode_ply("ply\nformat morse 1.0\n")), HasSubstr("line 2"));
  const std::string head =
      "ply\nformat ascii 1.0\nelement vertex 1\nproperty double x\n"
      "property double y\nproperty double z\nelement face 1\n"
      "property list uchar int vertex_indices\nend_header\n";
  EXPECT_THAT(why(decode_ply(head + "0 0 0\n3 0 0 1\n")), HasSubstr("vertex 1 of 1"));
  EXPECT_THAT(why(decode_ply(head + "0 0 0\n3 0 0 -1\n")), HasSubstr("line 11"));
  EXPECT_THAT(why(decode_ply(head + "0 0 0\n255 0 0\n")), HasSubstr("a list of 255 values"));
  EXPECT_THAT(why(decode_ply(head + "0 inf 0\n3 0 0 0\n")), HasSubstr("not finite"));
  EXPECT_THAT(why(decode_ply(head + "0 0\n")), HasSubstr("PLY line"));
  EXPECT_THAT(why(decode_stl(std::string(84, '\xff'))), HasSubstr("4294967295"));
}

TEST(MeshIo, AttributesAreFiniteAsFloatsToo) {
  const auto ply = [](const char* red) {
    return std::string(
               "ply\nformat ascii 1.0\nelement vertex 3\nproperty double x\nproperty double y\n"
               "property double z\nproperty double red\nproperty double green\nproperty double "
               "blue\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0 0 "
               "0 0\n1 0 0 0 0 0\n0 1 0 ") +
           red + " 0 0\n3 0 1 2\n";
  };
  EXPECT_TRUE(decode_ply(ply("0.5")));
  for (const char* red : {"nan", "inf", "1e300"}) {
    const auto mesh = decode_ply(ply(red));
    ASSERT_FALSE(mesh) << red;
    EXPECT_NE(mesh.error().what.find("an attribute of vertex 2"), std::string::npos);
  }
  const std::string shape = "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\n";
  EXPECT_TRUE(decode_obj(shape + "f 1/1 2/1 3/1\n"));
  for (const char* line : {"vt 1e300 0\n", "vn 0 0 1e300\n", "v 0 0 0 1e300 0 0\n"})
    EXPECT_FALSE(decode_obj(shape + line + "f 1/1 2/1 3/1\n")) << line;
}

TEST(MeshIo, AFaceHasThreeCorners) {
  const std::string head =
      "ply\nformat ascii 1.0\nelement vertex 3\nproperty double x\nproperty double y\nproperty "
      "double z\nelement face 2\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 "
      "0\n0 1 0\n3 0 1 2\n";
  EXPECT_TRUE(decode_ply(head + "3 2 1 0\n"));
  EXPECT_FALSE(decode_ply(head + "2 0 1\n"));
}

TEST(MeshIo, HeadersThatPromiseTooMuchCostNothing) {
  const std::string head =
      "ply\nformat binary_little_endian 1.0\nelement nothing 18446744073709551615\n"
      "element vertex 4000000000\nproperty float x\nproperty float y\n"
      "property float z\nend_header\n";
  EXPECT_THAT(decode_ply(head + std::string(1000, 'x')).error().what, HasSubstr("4000000000"));
}

TEST(MeshIo, AFailedWriteLeavesNothingBehind) {
  const tind::test::TempDir dir;
  const Mesh m = full_mesh(2000);
  EXPECT_THAT(write_mesh(dir.file("no/such/a.ply"), m).error().what, HasSubstr("No such file"));
  EXPECT_THAT(write_mesh(dir.file("a.xyz"), m).error().what, HasSubstr(".ply, .obj, .stl"));
  EXPECT_THAT(write_mesh("/dev/full", m).error().what, HasSubstr("cannot tell the format"));
  EXPECT_THAT(write_whole_file("/dev/full", "x").error().what, HasSubstr("No space left"));

  ASSERT_TRUE(write_whole_file(dir.file("a.ply"), "old"));
  rlimit before;
  getrlimit(RLIMIT_FSIZE, &before);
  const rlimit small{20000, before.rlim_max};
  const auto old_handler = std::signal(SIGXFSZ, SIG_IGN);
  setrlimit(RLIMIT_FSIZE, &small);  // a disk that is full after 20 kB
  const auto result = write_mesh(dir.file("a.ply"), m);
  setrlimit(RLIMIT_FSIZE, &before);
  std::signal(SIGXFSZ, old_handler);
  EXPECT_THAT(result.error().what, HasSubstr("File too large"));
  EXPECT_EQ(read_whole_file(dir.file("a.ply")).value(), "old");
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(dir.path()), {}), 1);
}

TEST(MeshIo, RealMeshesOfOtherMakers) {
  struct Known {
    const char* name;
    std::size_t positions, triangles;
  };
  for (const Known known :
       {Known{"mesh/horse.ply", 48485, 96966}, Known{"mesh/cow.obj", 2903, 5804},
        Known{"mesh/stanford-bunny.obj", 35947, 69451}, Known{"mesh/fandisk.obj", 6475, 12946}}) {
    TIND_NEEDS_SHARED_DATA(path, known.name);
    const Mesh m = must(read_mesh(path));
    EXPECT_EQ(m.triangles.size(), known.triangles) << known.name;
    EXPECT_EQ(m.positions.size(), known.positions) << known.name;
  }
  TIND_NEEDS_SHARED_DATA(spot, "mesh/spot.obj");
  const Mesh m = must(read_mesh(spot));
  EXPECT_EQ(m.texcoords.size(), m.positions.size());
  EXPECT_GT(m.positions.size(), 2930u);  // seams of the texture are split
}

}  // namespace
}  // namespace tind::proto
