// The formats of meshes that tind itself reads back, and what they say of the place.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "proto/mesh/mesh_io.h"
#include "terrain/mesh/mesh_file.h"

namespace tind::proto {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using Triangle = std::array<std::uint32_t, 3>;

/// A grid with numbers of all their digits, triangles counter-clockwise.
Mesh grid_mesh(double x0, double y0, double step) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> share(0, 0.1);
  Mesh m;
  constexpr std::uint32_t kCols = 7, kRows = 5;
  for (std::uint32_t r = 0; r < kRows; ++r)
    for (std::uint32_t c = 0; c < kCols; ++c)
      m.positions.push_back(
          {x0 + step * (c + share(random)), y0 + step * (r + share(random)), 1000 * share(random)});
  for (std::uint32_t r = 0; r + 1 < kRows; ++r)
    for (std::uint32_t c = 0; c + 1 < kCols; ++c) {
      const std::uint32_t a = r * kCols + c, b = a + 1, d = a + kCols, e = d + 1;
      m.triangles.push_back({a, b, e});
      m.triangles.push_back({a, e, d});
    }
  return m;
}

Mesh must(Result<Mesh> mesh) {
  EXPECT_TRUE(mesh.has_value()) << mesh.error().what;
  return mesh.value_or(Mesh{});
}

TEST(MeshFormats, TextLosesNothing) {
  for (const Mesh& m : {grid_mesh(567890, 4801234, 30), grid_mesh(-179.9, 66.1, 1e-4)}) {
    const Mesh from_2dm = must(decode_2dm(encode_2dm(m)));
    EXPECT_EQ(from_2dm.positions, m.positions);
    EXPECT_EQ(from_2dm.triangles, m.triangles);
    const Mesh from_xml = must(decode_landxml(encode_landxml(m).value()));
    EXPECT_EQ(from_xml.positions, m.positions);
    EXPECT_EQ(from_xml.triangles, m.triangles);
  }
}

TEST(MeshFormats, PlyNamesTheCrsAsQgisReadsIt) {
  Mesh m = grid_mesh(0, 0, 1);
  m.place = {.epsg = 32611, .crs_wkt = "PROJCRS[\"x\"]", .vertical_datum = "egm96"};
  EXPECT_THAT(encode_ply(m), HasSubstr("\ncomment crs: EPSG:32611\n"));
  EXPECT_THAT(encode_ply(m), HasSubstr("\ncomment vertical datum: egm96\n"));
  m.place.epsg = 0;
  EXPECT_THAT(encode_ply(m), HasSubstr("\ncomment crs: PROJCRS[\"x\"]\n"));
  m.place = {.epsg = 32611, .local = true, .origin = {431234.5, 1e6}, .to_crs = {1, 0, 0, 2}};
  EXPECT_THAT(place_lines(m.place), ElementsAre("origin crs: EPSG:32611", "origin: 431234.5 1e+06",
                                                "metres to crs: 1 0 0 2"));
}

TEST(MeshFormats, GlbKeepsPostsExactlyInDegreesAndFarFromZero) {
  for (const auto& lattice : {std::array<double, 6>{391329, 30, 0, 3801000, 0, -30},
                              {-121.9 + 1.0 / 7, 1.0 / 3600, 0, 46.95, 0, -1.0 / 3600},
                              {500000, 0, 25, 4e6, 25, 0}}) {  // columns go north
    Mesh m;
    m.place.lattice = lattice;
    for (const double row : {0.0, 12.5, 10801.0})
      for (const double col : {0.0, 8191.0, 10800.0})
        m.positions.push_back({lattice[0] + col * lattice[1] + row * lattice[2],
                               lattice[3] + col * lattice[4] + row * lattice[5],
                               double(float(1234.56))});
    m.triangles = {{0, 3, 1}, {1, 3, 4}};
    const Mesh there = as_in_glb(m);
    for (std::size_t i = 0; i < m.positions.size(); ++i)
      for (std::size_t k = 0; k < 3; ++k)
        EXPECT_NEAR(there.positions[i][k], m.positions[i][k], 4e-16 * std::abs(m.positions[i][k]));
  }
}

TEST(MeshFormats, WithoutALatticeGlbIsRelativeToTheMiddle) {
  const Mesh m = grid_mesh(567890, 4801234, 30);
  const Mesh there = as_in_glb(m);
  for (std::size_t i = 0; i < m.positions.size(); ++i)
    for (std::size_t k = 0; k < 3; ++k) EXPECT_NEAR(there.positions[i][k], m.positions[i][k], 1e-5);
  EXPECT_TRUE(encode_glb(m));
  EXPECT_EQ(encode_glb(Mesh{}).error().code, Errc::invalid_argument);
}

TEST(MeshFormats, LandXmlRefusesWhatItHasNoWordFor) {
  Mesh m = grid_mesh(7, 46, 0.001);
  m.place.geographic = true;
  EXPECT_THAT(encode_landxml(m).error().what, HasSubstr("--frame metric"));
  m.place.local = true;
  EXPECT_TRUE(encode_landxml(m));
  m.place = {.unit_m = 1200.0 / 3937, .vertical_datum = "a \"b\" <c>"};
  EXPECT_THAT(encode_landxml(m).value(), HasSubstr("linearUnit=\"USSurveyFoot\""));
  EXPECT_THAT(encode_landxml(m).value(), HasSubstr("a &quot;b&quot; &lt;c&gt;"));
  m.place = {.unit_m = 1,
             .vertical_datum = "\x1b\xc3\xa5\xff\xfe\xe2\x82\xf0\x9f\x8f\x94\xed\xa0\x80."};
  EXPECT_THAT(encode_landxml(m).value(),
              HasSubstr(" \xc3\xa5\xef\xbf\xbd\xef\xbf\xbd\xef\xbf\xbd\xef\xbf\xbd\xf0\x9f\x8f\x94"
                        "\xef\xbf\xbd\xef\xbf\xbd\xef\xbf\xbd."))
      << "bytes that are no UTF-8 are no XML";
  m.place = {.unit_m = 1000};
  EXPECT_FALSE(encode_landxml(m));
}

TEST(MeshFormats, TwoDmOfOtherMakers) {
  const Mesh m =
      must(decode_2dm("MESH2D\r\nMESHNAME \"a b\"\nE4Q 1 10 20 30 40 1\nE3T 2 10 40 50 1\n"
                      "ND 10 0 0 1\nND 20 1 0 1.5e0\nND 30 1 1 2\nND 40 0 1 3\nND 50 -1 1 3\n"
                      "NS 10 20 -30\n"));
  EXPECT_EQ(m.positions.size(), 5u);
  EXPECT_THAT(m.triangles, ElementsAre(Triangle{0, 1, 2}, Triangle{0, 2, 3}, Triangle{0, 3, 4}));
  for (const auto& [text, why] : std::initializer_list<std::pair<const char*, const char*>>{
           {"ND 1 0 0 0\n", "MESH2D"},
           {"MESH2D\nND 1 0 0\n", "line 2"},
           {"MESH2D\nND 1 0 0 inf\n", "finite"},
           {"MESH2D\nND 1 0 0 0\nND 1 0 0 0\n", "already"},
           {"MESH2D\nND 1 0 0 0\nE3T 1 1 1 2 1\n", "node 2"},
           {"MESH2D\nE6T 1 1 2 3 4 5 6 1\n", "E6T"}})
    EXPECT_THAT(decode_2dm(text).error().what, HasSubstr(why)) << text;
}

TEST(MeshFormats, WhereAMeshIsIsReadBack) {
  Mesh m = grid_mesh(0, 0, 1);
  m.place = {.epsg = 2994, .vertical_datum = "EPSG:5703", .z_unit_m = 0.3048};
  Mesh local = m;
  local.place = {.crs_wkt = "PROJCRS[\"x\"]",
                 .vertical_datum = "egm96",
                 .local = true,
                 .origin = {567890.25, -12},
                 .to_crs = {0.5, 1, -1, 0.5}};
  for (const Mesh& mesh : {m, local})
    for (const MeshPlace& read :
         {must(decode_ply(encode_ply(mesh))).place, must(decode_obj(encode_obj(mesh))).place,
          must(decode_2dm(encode_2dm(mesh))).place,
          must(decode_landxml(encode_landxml(mesh).value())).place})
      EXPECT_EQ(place_lines(read), place_lines(mesh.place));
  MeshPlace none;
  for (const char* line : {"crs:", "crs: ", "origin: 1", "origin: 1 2 3", "metres to crs: a b c d",
                           "z unit in metres: -1", "z unit in metres: nan", "see crs: EPSG:1"})
    read_place_line(line, none);
  EXPECT_EQ(none.epsg, 0);
  EXPECT_EQ(none.crs_wkt, "");
  EXPECT_EQ(none.origin, (std::array<double, 2>{}));
  EXPECT_EQ(none.to_crs, (std::array<double, 4>{1, 0, 0, 1}));
  EXPECT_EQ(none.z_unit_m, 1);
}

TEST(MeshFormats, LinesEndAsOtherMachinesEndThem) {
  for (const std::string end : {"\n", "\r\n", "\r"}) {
    const std::string mark = "\xEF\xBB\xBF";
    const Mesh m = must(decode_2dm(mark + "mesh2d" + end + "nd 1 0 0 1" + end + "Nd 2 1 0 1" + end +
                                   "ND 3 0 1 1" + end + end + "e3t 1 1 2 3 1" + end));
    EXPECT_THAT(m.triangles, ElementsAre(Triangle{0, 1, 2}));
    EXPECT_THAT(must(decode_obj("v 0 0 0" + end + "v 1 0 0 \\" + end + " " + end + "v 0 1 0" + end +
                                "f 1 2 3"))
                    .triangles,
                ElementsAre(Triangle{0, 1, 2}));
  }
}

TEST(MeshFormats, AQuadIsPartedInside) {
  const std::string nodes = "ND 1 0 0 0\nND 2 4 0 0\nND 3 1 1 0\nND 4 0 4 0\n";  // a dart, in at 3
  EXPECT_THAT(must(decode_2dm("MESH2D\n" + nodes + "E4Q 1 1 2 3 4 1\n")).triangles,
              ElementsAre(Triangle{0, 1, 2}, Triangle{0, 2, 3}));
  EXPECT_THAT(must(decode_2dm("MESH2D\n" + nodes + "E4Q 1 2 3 4 1 1\n")).triangles,
              ElementsAre(Triangle{2, 3, 0}, Triangle{2, 0, 1}));
}

TEST(MeshFormats, LandXmlOfOtherMakersInFeetWithPrefixesAndQuads) {
  const std::string text =
      "<x:LandXML xmlns:x=\"http://www.landxml.org/schema/LandXML-1.2\"><x:Units><x:Imperial "
      "linearUnit=\"USSurveyFoot\" elevationUnit=\"feet\"/></x:Units><x:CoordinateSystem "
      "epsgCode=\"2994\"/><x:Surfaces><x:Surface><x:Definition><x:Pnts><x:P id=\"1\">0 0 "
      "5<x:Feature code=\"P\">9 9 9</x:Feature></x:P><x:P id=\"2\">0 4 5</x:P><x:P id=\"3\">4 4 "
      "5</x:P><x:P id=\"4\">4 0 5</x:P></x:Pnts><x:Faces><x:F>1 2 3 4<x:P "
      "id=\"5\"/></x:F></x:Faces></x:Definition></x:Surface></x:Surfaces></x:LandXML>";
  const Mesh m = must(decode_landxml(text));
  EXPECT_THAT(m.triangles, ElementsAre(Triangle{0, 1, 2}, Triangle{0, 2, 3}));
  EXPECT_EQ(m.positions.size(), 4u);
  EXPECT_EQ(m.place.epsg, 2994);
  EXPECT_DOUBLE_EQ(m.place.unit_m, 1200.0 / 3937);
  EXPECT_EQ(m.place.said_unit_m, m.place.unit_m);
  EXPECT_DOUBLE_EQ(m.place.z_unit_m, 1200.0 / 3937);
  const auto wrong = [&](std::string from, const std::string& to) {
    std::string changed = text;
    changed.replace(changed.find(from), from.size(), to);
    return decode_landxml(changed).error().what;
  };
  EXPECT_THAT(wrong("1 2 3 4<", "1 2 3 4 1<"), HasSubstr("more than four"));
  EXPECT_THAT(wrong("1 2 3 4<", "1 2 3 x<"), HasSubstr("no point"));
  EXPECT_THAT(wrong("USSurveyFoot", "ell"), HasSubstr("linear unit"));
}

TEST(MeshFormats, LandXmlOfOtherMakers) {
  const std::string head = "<?xml version=\"1.0\" encoding=\"ISO-8859-1\"?>\n<LandXML><Surfaces>";
  const std::string points =
      "<Pnts><P id=\"4\">20 10 1</P><P id=\"7\"> 20\n 11 2 </P><P id=\"9\">21 10 3</P></Pnts>";
  const std::string one = "<Surface><Definition>" + points +
                          "<Faces><F>4 7 9</F><F n=\"1 0 0\">4 9 7</F><F i=\"1\">4 7 9</F></Faces>"
                          "</Definition></Surface>";
  // Two surfaces number their points alike; hidden faces stay out; all faces look up.
  const Mesh m = must(decode_landxml(head + one + one + "</Surfaces></LandXML>"));
  EXPECT_EQ(m.positions.size(), 6u);
  EXPECT_EQ(m.positions[1], (std::array<double, 3>{11, 20, 2}));
  EXPECT_THAT(m.triangles, ElementsAre(Triangle{0, 1, 2}, Triangle{0, 1, 2}, Triangle{3, 4, 5},
                                       Triangle{3, 4, 5}));
  EXPECT_EQ(m.place.said_unit_m, 0) << "it says none";
  for (const auto& [text, why] : std::initializer_list<std::pair<std::string, const char*>>{
           {"", "LandXML"},
           {"<gml/>", "not LandXML"},
           {head + "</Surfaces></LandXML>", "without the faces"},
           {head + one, "line 3"},
           {head + "<Surface><Pnts><P id=\"1\">1 2</P></Pnts></Surface></Surfaces></LandXML>",
            "three"},
           {head + "<Surface>" + points +
                "<Faces><F>4 7 8</F></Faces></Surface></Surfaces></LandXML>",
            "point 8"},
           {"<!DOCTYPE a [<!ENTITY e SYSTEM \"/etc/passwd\">]><LandXML>&e;</LandXML>", "entities"}})
    EXPECT_THAT(decode_landxml(text).error().what, HasSubstr(why)) << text;
}

TEST(MeshFormats, LandXmlHasAllOfItsNumbersInTheFile) {
  // Read as 14 where only what is in the file counts.
  const auto landxml = [](const std::string& before, const std::string& z = "14&z;",
                          const std::string& unit = "meter") {
    return decode_landxml(
        before + "<LandXML><Units><Metric linearUnit=\"" + unit +
        "\"/></Units><Surfaces><Surface><Pnts><P id=\"1\">0 0 " + z +
        "</P><P id=\"2\">0 1 1</P><P id=\"3\">1 0 1</P></Pnts><Faces><F>1 2 3</F></Faces></Surface>"
        "</Surfaces></LandXML>");
  };
  EXPECT_EQ(must(landxml("", "14")).positions[0][2], 14);
  EXPECT_EQ(must(landxml("<!DOCTYPE LandXML>", "1&#52;")).positions[0][2], 14);
  for (const char* doctype :
       {"<!DOCTYPE l [<!ENTITY z SYSTEM \"rest.txt\">]>", "<!DOCTYPE l [<!ENTITY z \"0\">]>",
        "<!DOCTYPE l [<!ENTITY % p SYSTEM \"rest.dtd\">%p;]>",
        "<!DOCTYPE l [<!ENTITY % p SYSTEM \"rest.dtd\">%p;<!ENTITY z \"0\">]>"})
    EXPECT_THAT(landxml(doctype).error().what, HasSubstr("declares entities")) << doctype;
  const std::string elsewhere = "<!DOCTYPE l SYSTEM \"rest.dtd\">";
  for (const auto& read : {landxml(elsewhere), landxml(elsewhere, "14", "me&z;ter"),
                           landxml("<!DOCTYPE l PUBLIC \"-//L\" \"rest.dtd\">", "14")})
    EXPECT_THAT(read.error().what, HasSubstr("another file"));
  const std::string alone = "<?xml version=\"1.0\" standalone=\"yes\"?>" + elsewhere;
  EXPECT_EQ(must(landxml(alone, "14")).positions[0][2], 14) << "which says so itself";
  for (const auto& read :
       {landxml(""), landxml("<!DOCTYPE l>"), landxml(alone), landxml(alone, "14", "me&z;ter")})
    EXPECT_THAT(read.error().what, HasSubstr("undefined entity"));
}

TEST(MeshFormats, LandXmlNamesTheSurfacesThatItsFacesAreOf) {
  const auto surface = [](const std::string& name, const std::string& faces) {
    return "<Surface name=\"" + name +
           "\"><Definition><Pnts><P id=\"1\">0 0 1</P><P id=\"2\">0 1 1</P><P id=\"3\">1 0 1</P>"
           "</Pnts><Faces>" +
           faces + "</Faces></Definition></Surface>";
  };
  const std::string seen = "<F>1 2 3</F>", hidden = "<F i=\"1\">1 2 3</F>";
  const Mesh m =
      must(decode_landxml("<LandXML>" + surface("EG", seen) + surface("points", "") +
                          surface("FG", seen + seen) + surface("hidden", hidden) + "</LandXML>"));
  EXPECT_THAT(m.surfaces, ElementsAre("EG", "FG"));
  EXPECT_EQ(m.triangles.size(), 3u);
}

TEST(MeshTable, ANameOrAnExtensionSaysTheFormat) {
  EXPECT_STREQ(format_to_write("a.PLY").value()->name, "ply");
  EXPECT_STREQ(format_to_write("a.nc").value()->name, "ugrid");
  EXPECT_STREQ(format_to_write("/dev/stdout", "dxf").value()->name, "dxf");
  for (const MeshFormat& f : mesh_formats())
    EXPECT_THAT(format_to_write("a.xyz").error().what, HasSubstr(f.extensions.front()));
  EXPECT_THAT(format_to_write("a.ply", "xyz").error().what, HasSubstr("landxml"));
  EXPECT_EQ(format_to_read("a.gpkg"), nullptr);
  EXPECT_STREQ(format_to_read("b.LandXML")->name, "landxml");
}

TEST(MeshTable, EveryRowWritesTheSameBytesTwice) {
  Mesh m = grid_mesh(391329, 3801000, 30);
  m.colours.assign(m.positions.size(), {1, 0, 0});
  m.place.crs_wkt = "LOCAL_CS[\"here\"]";
  for (const MeshFormat& f : mesh_formats()) {
    const auto once = f.encode(m), twice = f.encode(m);
    ASSERT_TRUE(once) << f.name << once.error().what;
    EXPECT_EQ(*once, *twice) << f.name;
    EXPECT_EQ(lost_attributes(f, m), f.colours ? "" : "colours") << f.name;
    if (f.decode) {
      EXPECT_EQ(must(f.decode(*once)).triangles.size(), m.triangles.size()) << f.name;
    }
  }
}

}  // namespace
}  // namespace tind::proto
