#include "terrain/shapes/surface_shapes.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <filesystem>
#include <fstream>

#include "terrain/base/sqlite.h"
#include "terrain/raster/gdal/vectors/vector_source.h"
#include "terrain/shapes/shaped_dem.h"
#include "tests/support/listener.h"
#include "tests/support/made_up_source.h"
#include "tests/support/shapes_file.h"
#include "tests/support/support.h"
#include "tests/support/text_dem.h"

namespace tind {
namespace {

using test::MadeUpSource;
using test::square;
using Shapes = test::ShapesFile;

/// 61 x 61 posts, ten a degree, from (0, 6) to (6, 0): heights 100 + column.
std::shared_ptr<const DemSource> slope() {
  HeightGrid grid(61, 61);
  for (int r = 0; r < 61; ++r)
    for (int c = 0; c < 61; ++c) grid.at(c, r) = float(100 + c);
  return std::make_shared<MadeUpSource>(grid, Geographic{0, 6}, 0.1);
}

Result<std::shared_ptr<const SurfaceShapes>> flatten(const Shapes& shapes,
                                                     std::shared_ptr<const DemSource> dem) {
  ShapeFiles files;
  files.flatten.push_back(shapes.write());
  return SurfaceShapes::make(std::span(&dem, 1), files);
}

TEST(SurfaceShapes, a_raster_of_water_is_what_it_holds_and_not_which_file_it_is) {
  const test::TempDir folder;
  const auto dem = slope();
  const auto digest = [&](const std::string& raster) {
    ShapeFiles files;
    files.water = {raster};
    const auto made = SurfaceShapes::make(std::span(&dem, 1), files);
    return made ? (*made)->digest() : "error: " + made.error().what;
  };
  HeightGrid water(6, 6, 1);
  const auto named = [&](const std::string& name, Geographic corner) {
    test::text_dem(folder, name, water, corner, 1);
    std::ofstream(folder.file(name + ".prj"))
        << R"(GEOGCS["WGS 84",DATUM["WGS_1984",SPHEROID["WGS 84",6378137,298.257223563]],PRIMEM["Greenwich",0],UNIT["degree",0.0174532925199433]])";
    return folder.file(name + ".asc");
  };
  const std::string first = digest(named("a", {0, 1})), copy = digest(named("b", {0, 1}));
  EXPECT_EQ(first, copy);
  water.at(3, 3) = 0;
  EXPECT_NE(digest(named("c", {0, 1})), first);
  EXPECT_NE(digest(named("far", {60, 1})).find("nothing in it lies on the DEM"), std::string::npos);
  // One that is a raster, and cannot be used, says what is wrong with it as one.
  std::filesystem::copy(folder.file("a.prj"), folder.file("wild.prj"));
  std::ofstream(folder.file("wild.asc"))
      << "ncols 2\nnrows 2\nxllcenter 1e6\nyllcenter 1\ncellsize 1\n1 1\n1 1\n";
  EXPECT_NE(digest(folder.file("wild.asc")).find("lie outside of its CRS"), std::string::npos);
}

TEST(SurfaceShapes, level_is_the_median_of_own_heights_of_posts_or_of_the_outline) {
  const auto made = flatten(Shapes("median")
                                .polygon({square(1, 1, 1)}, 77.0)
                                .polygon({square(3.05, 3.05, 0.5)})    // columns 31 to 35
                                .polygon({square(5.01, 5.01, 0.02)}),  // between posts
                            slope());
  ASSERT_TRUE(made) << made.error().what;
  EXPECT_EQ((*made)->level_at({1.5, 1.5}), 77.0);
  EXPECT_EQ((*made)->level_at({3.3, 3.3}), 133.0);
  ASSERT_TRUE((*made)->level_at({5.02, 5.02}));
  EXPECT_NEAR(*(*made)->level_at({5.02, 5.02}), 150.2, 0.11);
  EXPECT_FALSE((*made)->level_at({4.5, 4.5}));
  EXPECT_EQ((*made)->report().flattened, 3u);
}

TEST(SurfaceShapes, the_median_of_own_heights_is_that_wherever_a_ring_begins) {
  const auto dem = slope();
  const std::array<const char*, 4> corners = {"[1,1,100]", "[2,1,102]", "[2,2,140]", "[1,2,150]"};
  for (int first = 0; first < 4; ++first) {
    const test::TempDir folder;
    ShapeFiles files;
    files.flatten = {folder.file("runway.geojson")};
    std::string ring;
    for (int k = 0; k <= 4; ++k) ring += (k ? "," : "") + std::string(corners[(first + k) % 4]);
    std::ofstream(files.flatten[0]) << R"({"type": "Polygon", "coordinates": [[)" << ring << "]]}";
    const auto made = SurfaceShapes::make(std::span(&dem, 1), files);
    ASSERT_TRUE(made) << made.error().what;
    EXPECT_EQ((*made)->level_at({1.5, 1.5}), 121.0) << first;
    ASSERT_EQ((*made)->report().warnings.size(), 1u);
    EXPECT_NE((*made)->report().warnings[0].find(
                  "1 of 1 polygons to be level have own heights that differ by more than 5 m"),
              std::string::npos);
    EXPECT_NE((*made)->report().warnings[0].find("50.0 m"), std::string::npos);
  }
}

TEST(SurfaceShapes, own_heights_that_are_none_of_the_earth_are_refused) {
  for (const double height : {1e9, -1e38, 1e300}) {
    const auto made = flatten(Shapes("high").polygon({square(1, 1, 1)}, height), slope());
    ASSERT_FALSE(made);
    EXPECT_EQ(made.error().code, Errc::invalid_argument);
    EXPECT_NE(made.error().what.find("none of the earth"), std::string::npos) << made.error().what;
  }
}

TEST(SurfaceShapes, of_a_breakline_neither) {
  const test::TempDir folder;
  const auto dem = slope();
  for (const char* height : {"50000", "-1e38", "1e999"}) {
    ShapeFiles files;
    files.breaklines = {folder.file("line.geojson")};
    std::ofstream(files.breaklines[0])
        << R"({"type": "LineString", "coordinates": [[1, 1, )" << height << "], [2, 2, 100]]}";
    const auto made = SurfaceShapes::make(std::span(&dem, 1), files);
    ASSERT_FALSE(made) << height;
    EXPECT_NE(made.error().what.find("none of the earth"), std::string::npos) << made.error().what;
    files.dem_heights = true;
    EXPECT_TRUE(SurfaceShapes::make(std::span(&dem, 1), files)) << height;
  }
}

TEST(SurfaceShapes, polygons_that_touch_or_lie_in_one_another_share_the_lowest_level) {
  const auto made = flatten(Shapes("touch")
                                .polygon({square(1, 1, 1)}, 50.0)
                                .polygon({square(2, 1, 1)}, 40.0)          // side by side
                                .polygon({square(2.25, 1.25, 0.5)}, 30.0)  // inside that
                                .polygon({square(4, 4, 1)}, 20.0),         // elsewhere
                            slope());
  ASSERT_TRUE(made) << made.error().what;
  EXPECT_EQ((*made)->level_at({1.5, 1.5}), 30.0);
  EXPECT_EQ((*made)->level_at({2.1, 1.1}), 30.0);
  EXPECT_EQ((*made)->level_at({2.5, 1.5}), 30.0);
  EXPECT_EQ((*made)->level_at({4.5, 4.5}), 20.0);
  const auto& warnings = (*made)->report().warnings;
  ASSERT_FALSE(warnings.empty());
  EXPECT_NE(warnings.back().find("2 of 4 polygons to be level touch one"), std::string::npos);
  EXPECT_NE(warnings.back().find("20.0 m"), std::string::npos) << warnings.back();
  // Where one water meets itself there is no shore: the two squares have one outline.
  EXPECT_EQ((*made)->lines().networks().size(), 2u);
  double length = 0;
  for (const ShapeChain& c : (*made)->lines().chains())
    for (std::size_t i = 1; i < c.points.size(); ++i)
      length += std::hypot(c.points[i].x - c.points[i - 1].x, c.points[i].y - c.points[i - 1].y);
  EXPECT_NEAR(length, 6 + 4, 1e-6);
}

TEST(SurfaceShapes, dirty_polygons_are_repaired) {
  // A bow tie, one with a hole that touches its outline, and one given twice.
  const auto made = flatten(Shapes("dirty")
                                .polygon({{{1, 1}, {2, 2}, {2, 1}, {1, 2}}}, 10.0)
                                .polygon({square(3, 1, 1), square(3, 1.25, 0.5)}, 20.0)
                                .polygon({square(5, 1, 0.5)}, 30.0)
                                .polygon({square(5, 1, 0.5)}, 35.0),
                            slope());
  ASSERT_TRUE(made) << made.error().what;
  EXPECT_GE((*made)->report().repairs.crossings, 1u);
  EXPECT_EQ((*made)->level_at({1.1, 1.5}), 10.0);
  EXPECT_EQ((*made)->level_at({1.9, 1.5}), 10.0);
  EXPECT_FALSE((*made)->level_at({1.5, 1.1}));
  EXPECT_FALSE((*made)->level_at({3.1, 1.5}));  // in the hole
  EXPECT_EQ((*made)->level_at({3.8, 1.5}), 20.0);
  EXPECT_EQ((*made)->level_at({5.2, 1.2}), 30.0);
}

TEST(SurfaceShapes, an_outline_that_folds_onto_itself_floods_nothing_else) {
  // A spike, there and back; a hole along the rim; a hole that is the whole of its polygon.
  const auto made = flatten(
      Shapes("fold")
          .polygon({{{1, 1}, {2, 1}, {2, 2}, {1.5, 2}, {1.5, 4}, {1.5, 2}, {1, 2}}}, 20.0)
          .polygon({square(3, 1, 1), {{3, 1.25}, {3.5, 1.25}, {3.5, 1.75}, {3, 1.75}}}, 30.0)
          .polygon({square(5, 1, 0.5), square(5, 1, 0.5)}, 40.0),
      slope());
  ASSERT_TRUE(made) << made.error().what;
  for (double lat = 0.53; lat < 5; lat += 0.1)
    for (double lon = 0.03; lon < 6; lon += 0.1) {
      const auto in = [&](double west, double south, double east, double north) {
        return lon > west && lon < east && lat > south && lat < north;
      };
      const bool first = in(1, 1, 2, 2), second = in(3, 1, 4, 2) && !in(3, 1.25, 3.5, 1.75);
      EXPECT_EQ((*made)->level_at({lon, lat}).value_or(0), first    ? 20
                                                           : second ? 30
                                                                    : 0)
          << lon << " " << lat;
    }
}

TEST(SurfaceShapes, levels_far_from_the_ground_around_them_are_doubted) {
  const auto far = flatten(
      Shapes("far").polygon({square(1, 1, 1)}, 60.0).polygon({square(3, 3, 0.5)}, 131.0), slope());
  ASSERT_TRUE(far) << far.error().what;
  ASSERT_EQ((*far)->report().warnings.size(), 1u);
  EXPECT_NE((*far)->report().warnings[0].find("1 of 2 polygons"), std::string::npos)
      << (*far)->report().warnings[0];
  EXPECT_NE((*far)->report().warnings[0].find("m below it at"), std::string::npos);
  EXPECT_EQ((*far)->report().warnings[0].find("exactly 0"), std::string::npos);
  const auto zero = flatten(Shapes("zero")
                                .polygon({square(1, 1, 1)}, 0.0)
                                .polygon({square(3, 1, 0.5)}, 60.0)
                                .polygon({square(3, 3, 0.5)}, 131.0),
                            slope());
  ASSERT_TRUE(zero) << zero.error().what;
  ASSERT_EQ((*zero)->report().warnings.size(), 1u);
  for (const char* words :
       {"2 of 3 polygons", "1 of these is exactly 0", "Shapefiles hold", "--line-heights dem"})
    EXPECT_NE((*zero)->report().warnings[0].find(words), std::string::npos)
        << (*zero)->report().warnings[0];
  const auto near = flatten(Shapes("near").polygon({square(1, 1, 1)}, 110.0), slope());
  ASSERT_TRUE(near) << near.error().what;
  EXPECT_TRUE((*near)->report().warnings.empty());
}

TEST(SurfaceShapes, posts_in_polygons_are_level_and_voids_stay) {
  HeightGrid grid(11, 11);
  for (float& z : grid.values()) z = 5;
  grid.at(5, 5) = HeightGrid::kVoid;
  std::shared_ptr<const DemSource> dem =
      std::make_shared<MadeUpSource>(grid, Geographic{0, 1}, 0.1);
  const auto made = flatten(Shapes("posts").polygon({square(0.35, 0.35, 0.3)}, 2.0), dem);
  ASSERT_TRUE(made) << made.error().what;
  const auto shaped = shaped_dem(dem, *made);
  EXPECT_NE(shaped->info().fingerprint, dem->info().fingerprint);
  for (const int step : {1, 2}) {
    const int side = 10 / step + 1;
    const auto posts =
        step == 1 ? shaped->read(0, 0, side, side) : shaped->read_decimated(0, 0, side, side, step);
    ASSERT_TRUE(posts);
    for (int r = 0; r < side; ++r)
      for (int c = 0; c < side; ++c) {
        const int col = c * step, row = r * step;
        const bool in = col >= 4 && col <= 6 && row >= 4 && row <= 6;
        if (col == 5 && row == 5)
          EXPECT_TRUE(std::isnan(posts->at(c, r)));
        else
          EXPECT_EQ(posts->at(c, r), in ? 2 : 5) << col << " " << row;
      }
  }
}

TEST(SurfaceShapes, posts_outside_the_boundary_are_void_and_have_no_tiles) {
  const auto dem = slope();
  Shapes land("land");
  ShapeFiles files;
  files.boundary = {land.polygon({square(0.95, 0.95, 1.1)}).write()};
  const auto made = SurfaceShapes::make(std::span(&dem, 1), files);
  ASSERT_TRUE(made) << made.error().what;
  const auto shaped = shaped_dem(dem, *made);
  const auto posts = shaped->read(0, 0, 61, 61);
  ASSERT_TRUE(posts);
  int valid = 0;
  for (const float z : posts->values()) valid += !std::isnan(z);
  EXPECT_EQ(valid, 11 * 11);
  EXPECT_LT(shaped->info().bounds.east, 2.3);
  EXPECT_GT(shaped->info().bounds.west, 0.7);
}

TEST(SurfaceShapes, a_polygon_across_the_antimeridian_is_on_both_sides) {
  HeightGrid grid(3601, 21);
  for (float& z : grid.values()) z = 9;
  std::shared_ptr<const DemSource> dem =
      std::make_shared<MadeUpSource>(grid, Geographic{-180, 1}, 0.1);
  for (const double turn : {0.0, -360.0}) {
    // From 179.5 to 180.5, as it is or with the step of a map that ends at 180.
    const auto made = flatten(
        Shapes("antimeridian")
            .polygon({{{179.5, 0}, {180.5 + turn, 0}, {180.5 + turn, 0.5}, {179.5, 0.5}}}, 3.0),
        dem);
    ASSERT_TRUE(made) << made.error().what;
    EXPECT_EQ((*made)->level_at({179.9, 0.2}), 3.0);
    EXPECT_EQ((*made)->level_at({-179.9, 0.2}), 3.0);
    EXPECT_FALSE((*made)->level_at({0, 0.2}));
    EXPECT_FALSE((*made)->level_at({-179.4, 0.2}));
  }
}

TEST(SurfaceShapes, what_cannot_be_used_says_why) {
  const auto dem = slope();
  const auto failure = [&](const std::string& path, auto member) {
    ShapeFiles files;
    (files.*member).push_back(path);
    const auto made = SurfaceShapes::make(std::span(&dem, 1), files);
    return made ? Errc{} : made.error().code;
  };
  Shapes lines("lines"), far("far"), none("none");
  lines.line({{1, 1}, {2, 2}});
  far.polygon({square(50, 50, 1)});
  EXPECT_EQ(failure(lines.write(), &ShapeFiles::flatten), Errc::bad_data);
  EXPECT_EQ(failure(lines.write(), &ShapeFiles::water), Errc::bad_data);
  EXPECT_EQ(failure(far.write(), &ShapeFiles::flatten), Errc::bad_data);
  EXPECT_EQ(failure(none.write(), &ShapeFiles::breaklines), Errc::bad_data);
  EXPECT_EQ(failure("nowhere.gpkg", &ShapeFiles::flatten), Errc::not_found);
  EXPECT_EQ(failure("nowhere.gpkg", &ShapeFiles::water), Errc::not_found);
}

/// A GeoPackage whose only layer is what `create` makes, `lakes` with fid and geom.
std::string package_of(const test::TempDir& folder, const std::string& name,
                       const std::string& create) {
  const std::string path = folder.file(name);
  auto db = Sqlite::open(path, Sqlite::Open::write);
  EXPECT_TRUE(db);
  EXPECT_TRUE(db->run(
      "PRAGMA application_id=1196444487; PRAGMA user_version=10300;"
      "CREATE TABLE gpkg_spatial_ref_sys(srs_name TEXT, srs_id INTEGER PRIMARY KEY, organization "
      "TEXT, organization_coordsys_id INTEGER, definition TEXT, description TEXT);"
      "INSERT INTO gpkg_spatial_ref_sys VALUES('WGS 84', 4326, 'EPSG', 4326, 'GEOGCS[\"WGS 84\","
      "DATUM[\"WGS_1984\",SPHEROID[\"WGS 84\",6378137,298.257223563]],PRIMEM[\"Greenwich\",0],"
      "UNIT[\"degree\",0.0174532925199433]]', '');"
      "CREATE TABLE gpkg_contents(table_name TEXT PRIMARY KEY, data_type TEXT, identifier TEXT, "
      "description TEXT, last_change TEXT, min_x DOUBLE, min_y DOUBLE, max_x DOUBLE, max_y DOUBLE, "
      "srs_id INTEGER);"
      "INSERT INTO gpkg_contents VALUES('lakes', 'features', 'lakes', '', '2024-01-01T00:00:00Z', "
      "0, 0, 6, 6, 4326);"
      "CREATE TABLE gpkg_geometry_columns(table_name TEXT, column_name TEXT, geometry_type_name "
      "TEXT, srs_id INTEGER, z TINYINT, m TINYINT);"
      "INSERT INTO gpkg_geometry_columns VALUES('lakes', 'geom', 'POLYGON', 4326, 0, 0);" +
      create));
  return path;
}

Errc facts_error(const std::string& path) {
  const auto facts = vector_facts(path);
  return facts ? Errc{} : facts.error().code;
}

TEST(VectorFile, of_a_database_only_tables_are_read) {
  const test::TempDir folder;
  const std::string one = "000000000000f03f", two = "0000000000000040";
  const std::string triangle =
      "x'47500001e6100000"
      "01030000000100000004000000" +
      one + one + two + one + two + two + one + one + "'";
  const auto error = [&](const std::string& name, const std::string& create) {
    return facts_error(package_of(folder, name, create));
  };
  const std::string endless =
      "WITH RECURSIVE c(x) AS (SELECT 1 UNION ALL SELECT x + 1 FROM c) SELECT x AS fid, ";
  EXPECT_EQ(error("a.gpkg", "CREATE VIEW lakes AS " + endless + triangle + " AS geom FROM c"),
            Errc::unsupported);
  EXPECT_EQ(error("b.gpkg", "CREATE VIEW lakes AS " + endless + "x AS geom FROM c WHERE x < 0"),
            Errc::unsupported);
  EXPECT_EQ(error("c.gpkg",
                  "CREATE TABLE lakes(fid INTEGER PRIMARY KEY, geom BLOB, more BLOB GENERATED "
                  "ALWAYS AS (zeroblob(900000000)))"),
            Errc::unsupported);

  const std::string table =
      "CREATE TABLE lakes(fid INTEGER PRIMARY KEY, geom BLOB); INSERT INTO "
      "lakes VALUES(1, " +
      triangle + ");";
  const auto sound = vector_facts(
      package_of(folder, "d.gpkg", table + "CREATE VIEW st_geometry_columns AS SELECT 1 AS a"));
  ASSERT_TRUE(sound) << sound.error().what;
  ASSERT_EQ(sound->layers.size(), 1u);
  EXPECT_EQ(sound->layers[0].polygons, 1u);
}

TEST(VectorFile, shapes_that_name_one_another_take_no_more_than_their_file_accounts_for) {
  const test::TempDir folder;
  // A block of one long line, put into the drawing again and again.
  const auto drawing = [&](const std::string& name, int times) {
    std::string text =
        "0\nSECTION\n2\nHEADER\n0\nENDSEC\n0\nSECTION\n2\nBLOCKS\n0\nBLOCK\n8\n0\n2\nB\n70\n0\n10\n"
        "0\n20\n0\n3\nB\n0\nLWPOLYLINE\n8\n"
        "0\n"
        "90\n2000\n70\n0\n";
    for (int i = 0; i < 2000; ++i)
      text += "10\n" + std::to_string(i % 9) + "\n20\n" + std::to_string(i % 7) + "\n";
    text += "0\nENDBLK\n8\n0\n0\nENDSEC\n0\nSECTION\n2\nENTITIES\n";
    for (int i = 0; i < times; ++i) text += "0\nINSERT\n8\n0\n2\nB\n10\n0\n20\n0\n";
    std::ofstream(folder.file(name)) << text << "0\nENDSEC\n0\nEOF\n";
    return folder.file(name);
  };
  EXPECT_EQ(facts_error(drawing("few.dxf", 20)), Errc{});
  EXPECT_EQ(facts_error(drawing("many.dxf", 4000)), Errc::unsupported);
}

TEST(VectorFile, leaves_no_file_behind_and_asks_nobody) {
  const test::TempDir folder;
  std::ofstream(folder.file("a.gml"))
      << R"(<gml:FeatureCollection xmlns:gml="http://www.opengis.net/gml"><gml:featureMember><a>)"
         R"(<gml:lineStringProperty><gml:LineString><gml:coordinates>8,46 9,47</gml:coordinates>)"
         R"(</gml:LineString></gml:lineStringProperty></a></gml:featureMember></gml:FeatureCollection>)";
  EXPECT_EQ(facts_error(folder.file("a.gml")), Errc{});
  EXPECT_FALSE(std::filesystem::exists(folder.file("a.gfs")));

  const test::Listener server;
  std::ofstream(folder.file("a.geojson"))
      << R"({"type":"FeatureCollection","crs":{"type":"link","properties":{"type":"proj4","href":")"
      << server.url() << R"(/crs"}},"features":[{"type":"Feature","properties":{},"geometry":)"
      << R"({"type":"LineString","coordinates":[[8,46],[9,47]]}}]})";
  facts_error(folder.file("a.geojson"));
  EXPECT_FALSE(server.was_asked());
}

TEST(ShapeFiles, are_set_by_name) {
  ShapeFiles files;
  EXPECT_TRUE(set_shape_option(files, "flatten", "a.gpkg"));
  EXPECT_TRUE(set_shape_option(files, "flatten", "b.gpkg"));
  EXPECT_TRUE(set_shape_option(files, "line_heights", "dem"));
  EXPECT_EQ(files.flatten, (std::vector<std::string>{"a.gpkg", "b.gpkg"}));
  EXPECT_TRUE(files.dem_heights);
  EXPECT_FALSE(set_shape_option(files, "line_heights", "sky"));
  EXPECT_FALSE(set_shape_option(files, "flaten", "a"));
  EXPECT_FALSE(set_shape_option(files, "water", ""));
}

}  // namespace
}  // namespace tind
