#include "terrain/raster/gdal/vectors/vector_files.h"

#include <gtest/gtest.h>
#include <sys/stat.h>

#include <filesystem>
#include <fstream>

#include "terrain/base/file_io.h"
#include "terrain/base/sqlite.h"
#include "terrain/raster/gdal/vectors/vector_source.h"
#include "terrain/raster/vector_file.h"
#include "tests/support/as_somebody_else.h"
#include "tests/support/support.h"

namespace tind {
namespace {

namespace fs = std::filesystem;

/// Its first byte is at an address where nothing is: read(2) says EIO.
constexpr const char* kFailingDisk = "/proc/self/mem";
constexpr std::string_view kLine =
    R"({"type":"FeatureCollection","features":[{"type":"Feature","properties":{"n":1},)"
    R"("geometry":{"type":"LineString","coordinates":[[8,46],[9,47]]}}]})";
constexpr std::string_view kGmlLine =
    R"(<gml:FeatureCollection xmlns:gml="http://www.opengis.net/gml"><gml:featureMember><a>)"
    R"(<gml:lineStringProperty><gml:LineString><gml:coordinates>8,46 9,47</gml:coordinates>)"
    R"(</gml:LineString></gml:lineStringProperty></a></gml:featureMember></gml:FeatureCollection>)";

void write(const std::string& path, std::string_view bytes) {
  std::ofstream(path, std::ios::binary) << bytes;
}

Error error_of(const std::string& path) {
  const auto facts = vector_facts(path);
  return facts ? Error{Errc{}, ""} : facts.error();
}

TEST(VectorFiles, what_the_disk_does_not_give_is_no_fault_of_the_format) {
  const test::TempDir folder;
  for (const char* const name :
       {"a.geojson", "a.shp", "a.gpkg", "a.tab", "a.gml", "a.kml", "a.csv", "a.fgb", "a.dxf"}) {
    const std::string path = folder.file(name);
    fs::create_symlink(kFailingDisk, path);
    const Error error = error_of(path);
    EXPECT_EQ(error.code, Errc::io) << name;
    EXPECT_EQ(error.what, "cannot read " + path + ": Input/output error");
    fs::remove(path);
  }
}

TEST(VectorFiles, nor_is_what_it_does_not_give_of_the_files_beside) {
  const test::TempDir folder;
  const std::pair<const char*, const char*> pairs[] = {
      {"a.shp", "a.shx"}, {"a.shp", "a.dbf"}, {"a.SHP", "a.PRJ"}, {"a.tab", "a.map"},
      {"a.tab", "A.Dat"}, {"a.mif", "a.mid"}, {"a.gml", "a.xsd"}, {"a.csv", "a.csvt"}};
  for (const auto& [name, beside] : pairs) {
    write(folder.file(name), name == std::string("a.gml") ? kGmlLine : "something");
    const std::string path = folder.file(beside);
    fs::create_symlink(kFailingDisk, path);
    const Error error = error_of(folder.file(name));
    EXPECT_EQ(error.code, Errc::io) << name;
    EXPECT_EQ(error.what, "cannot read " + path + ": Input/output error");
    fs::remove(path);
    fs::create_symlink(path, path);  // around in a circle
    const Error circle = error_of(folder.file(name));
    EXPECT_EQ(circle.code, Errc::io) << name;
    EXPECT_EQ(circle.what, "cannot read " + path + ": Too many levels of symbolic links");
    fs::remove(path);
    fs::remove(folder.file(name));
  }
}

TEST(VectorFiles, nor_what_may_not_be_read) {
  const test::TempDir folder;
  write(folder.file("a.shp"), "something");
  write(folder.file("a.dbf"), "something");
  write(folder.file("b.geojson"), kLine);
  test::give_to_somebody(folder.path().string());
  for (const auto& [name, closed] :
       {std::pair("a.shp", "a.dbf"), std::pair("b.geojson", "b.geojson")}) {
    const test::Closed none(folder.file(closed));
    const test::AsSomebodyElse somebody;
    const Error error = error_of(folder.file(name));
    EXPECT_EQ(error.code, Errc::io);
    EXPECT_EQ(error.what, "cannot read " + folder.file(closed) + ": Permission denied");
  }
}

TEST(VectorFiles, nor_is_it_in_a_folder) {
  const test::TempDir folder;
  write(folder.file("a.shp"), "something");
  fs::create_symlink(kFailingDisk, folder.file("a.shx"));
  fs::create_symlink(kFailingDisk, folder.file("b.dat"));  // of no Shapefile
  const Error error = error_of(folder.path().string());
  EXPECT_EQ(error.code, Errc::io);
  EXPECT_EQ(error.what, "cannot read " + folder.file("a.shx") + ": Input/output error");
}

TEST(VectorFiles, a_pipe_beside_keeps_nobody_waiting) {
  const test::TempDir folder;
  write(folder.file("a.shp"), "something");
  ASSERT_EQ(::mkfifo(folder.file("a.dbf").c_str(), 0600), 0);
  const Error error = error_of(folder.file("a.shp"));
  EXPECT_EQ(error.code, Errc::bad_data);
  EXPECT_TRUE(error.what.starts_with(folder.file("a.dbf") + ": ")) << error.what;
}

TEST(VectorFiles, small_ones_are_in_memory_and_named_as_they_are_on_disk) {
  const test::TempDir folder;
  const std::string path = folder.file("a.geojson");
  write(path, kLine);
  std::string target;
  {
    FileStates states;
    const auto files = gdal::VectorFiles::read(path, &states);
    ASSERT_TRUE(files) << files.error().what;
    target = files->target();
    EXPECT_TRUE(target.starts_with("/vsimem/")) << target;
    EXPECT_TRUE(target.ends_with("/a.geojson")) << target;
    EXPECT_EQ(files->shown(target + ": what?"), path + ": what?");
    EXPECT_EQ(files->size_of(target), kLine.size());
    ASSERT_EQ(states.entries().size(), 1u);
    EXPECT_EQ(states.entries()[0].path, path);
  }
  // And no longer than it is used.
  EXPECT_EQ(gdal::VectorFiles::read(path, nullptr)->size_of(target), 0u);

  const auto facts = vector_facts(path);
  ASSERT_TRUE(facts) << facts.error().what;
  ASSERT_EQ(facts->layers.size(), 1u);
  EXPECT_EQ(facts->layers[0].name, "a");
  EXPECT_EQ(facts->layers[0].lines, 1u);
}

TEST(VectorFiles, no_message_names_the_copy) {
  const test::TempDir folder;
  for (const char* const name : {"a.shp", "a.tab", "a.mif", "a.gml", "a.csv", "a.fgb", "a.kml"}) {
    write(folder.file(name), std::string(200, '<'));
    const Error error = error_of(folder.file(name));
    EXPECT_EQ(error.code, Errc::bad_data) << name;
    EXPECT_TRUE(error.what.starts_with(folder.file(name) + ": ")) << error.what;
    EXPECT_EQ(error.what.find("vsimem"), error.what.npos) << error.what;
  }
}

TEST(VectorFiles, those_beside_are_found_in_memory) {
  const test::TempDir folder;
  write(folder.file("a.MIF"),
        "Version 300\nCharset \"Neutral\"\nDelimiter \",\"\nColumns 1\n  n Integer\nData\n\n"
        "Line 8 46 9 47\n");
  write(folder.file("a.MID"), "7\n");
  const auto attributes = read_attributes(folder.file("a.MIF"));
  ASSERT_TRUE(attributes) << attributes.error().what;
  ASSERT_EQ(attributes->of_feature.size(), 1u);
  EXPECT_EQ(attributes->of_feature[0][0], VectorAttributes::Value(std::int64_t(7)));
}

TEST(VectorFiles, what_has_no_size_is_opened_where_it_is) {
  const test::TempDir folder;
  fs::create_symlink("/proc/self/status", folder.file("a.csv"));
  const auto files = gdal::VectorFiles::read(folder.file("a.csv"), nullptr);
  ASSERT_TRUE(files) << files.error().what;
  EXPECT_EQ(files->target(), folder.file("a.csv"));
}

TEST(VectorFiles, one_without_a_byte_is_none) {
  const test::TempDir folder;
  for (const char* const name : {"a.geojson", "a.shp", "a.tab", "a.fgb"}) {
    write(folder.file(name), "");
    EXPECT_EQ(error_of(folder.file(name)).code, Errc::bad_data) << name;
  }
}

TEST(VectorFiles, large_ones_are_opened_where_they_are) {
  const test::TempDir folder;
  const std::string path = folder.file("a.geojson");
  write(path, kLine);
  fs::resize_file(path, gdal::kMostInMemory + 1);
  const auto files = gdal::VectorFiles::read(path, nullptr);
  ASSERT_TRUE(files) << files.error().what;
  EXPECT_EQ(files->target(), path);
  EXPECT_EQ(files->size_of(path), gdal::kMostInMemory + 1);
}

TEST(VectorFiles, a_database_that_had_a_log_is_read_where_it_is) {
  const test::TempDir folder;
  const std::string path = folder.file("a.gpkg");
  TriangleFeatures mesh;
  const std::array<double, 3> corners[] = {{0, 0, 1}, {1, 0, 1}, {0, 1, 1}};
  const std::array<std::uint32_t, 3> triangle[] = {{0, 1, 2}};
  mesh.positions = corners;
  mesh.triangles = triangle;
  const auto bytes = encode_triangles(VectorFormat::geopackage, mesh);
  ASSERT_TRUE(bytes) << bytes.error().what;
  write(path, *bytes);
  {
    auto db = Sqlite::open(path, Sqlite::Open::write);
    ASSERT_TRUE(db);
    ASSERT_TRUE(db->run("PRAGMA journal_mode=WAL"));
    ASSERT_TRUE(db->run("UPDATE gpkg_contents SET identifier = 'in the log'"));
    ASSERT_TRUE(fs::exists(path + "-wal"));
    const Error open = error_of(path);
    EXPECT_NE(open.what.find(path + "-wal: a program has the database open"), open.what.npos)
        << open.what;
  }
  const auto facts = vector_facts(path);
  ASSERT_TRUE(facts) << facts.error().what;
  ASSERT_EQ(facts->layers.size(), 1u);
  EXPECT_EQ(facts->layers[0].polygons, 1u);
  const auto files = gdal::VectorFiles::read(path, nullptr);
  ASSERT_TRUE(files) << files.error().what;
  EXPECT_EQ(files->target(), path);
}

}  // namespace
}  // namespace tind
