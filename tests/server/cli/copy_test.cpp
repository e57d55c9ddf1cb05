// Copy, verify and repair as their users run them.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "terrain/base/file_io.h"
#include "terrain/store/folder/folder_lock.h"
#include "tests/support/program_json.h"
#include "tests/support/shapes_file.h"

namespace tind {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

nlohmann::json json_of(const test::Ran& ran) {
  return nlohmann::json::parse(ran.answer, nullptr, false);
}

class Copies : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = std::make_unique<test::TempDir>();
    ASSERT_EQ(test::run_tind("build " + dem() + " -o " + tiles() + " --deepest 11").code, 0);
  }
  static void TearDownTestSuite() { folder_.reset(); }

  static std::string dem() { return test::testdata("rainier.tif"); }
  static std::string tiles() { return folder_->file("tiles"); }
  static std::string file(const std::string& name) { return folder_->file(name); }
  static test::Ran copy(const std::string& from, const std::string& to) {
    return test::run_tind("copy " + from + " " + to);
  }
  /// One byte of it is another now.
  static void damage(const std::string& path, std::size_t at) {
    std::string bytes = *read_whole_file(path);
    ASSERT_LT(at, bytes.size());
    bytes[at] = char(bytes[at] ^ 16);
    std::ofstream(path, std::ios::binary) << bytes;
  }

  inline static std::unique_ptr<test::TempDir> folder_;
};

TEST_F(Copies, EveryKindGivesTheFolderBack) {
  ASSERT_EQ(copy(tiles(), file("a.pmtiles")).code, 0);
  ASSERT_EQ(copy(file("a.pmtiles"), file("a.mbtiles")).code, 0);
  ASSERT_EQ(copy(file("a.mbtiles"), file("back")).code, 0);
  std::size_t files = 0;
  for (const auto& entry : fs::recursive_directory_iterator(tiles())) {
    if (!entry.is_regular_file()) continue;
    const auto twin = file("back") / entry.path().lexically_relative(tiles());
    ASSERT_TRUE(*read_whole_file(entry.path()) == read_whole_file(twin).value_or("")) << twin;
    ++files;
  }
  EXPECT_GT(files, 50u);
  // A build goes on with it as with its own.
  const auto again =
      test::run_tind("build " + dem() + " -o " + file("back") + " --deepest 11 --json");
  EXPECT_EQ(json_of(again)["built"], 0);
}

TEST_F(Copies, CommandsTakeAnArchiveWhereTheyTakeAFolder) {
  for (const std::string name : {"b.pmtiles", "b.mbtiles"}) {
    const auto copied = test::run_tind("copy " + tiles() + " " + file(name) + " --json");
    ASSERT_EQ(copied.code, 0) << copied.out;
    const auto count = json_of(copied)["tiles"];
    EXPECT_EQ(json_of(copied)["unvouched"], 0);
    const auto check = test::run_tind("check " + file(name) + " --json --source " + dem());
    EXPECT_EQ(check.code, 0) << check.out;
    EXPECT_EQ(json_of(check)["warnings"], 0);
    EXPECT_EQ(test::run_tind("explain " + file(name) + " 10/330/777").code, 0);
    EXPECT_EQ(json_of(test::run_tind("info " + file(name) + " --json"))["name"], "rainier");
    const auto verified = test::run_tind("verify " + file(name) + " --json");
    EXPECT_EQ(verified.code, 0);
    EXPECT_EQ(json_of(verified)["sound"], count);
  }
}

TEST_F(Copies, WhatIsBrokenIsFoundAndMended) {
  for (const std::string name : {"c.pmtiles", "c.mbtiles", "c"}) {
    ASSERT_EQ(copy(tiles(), file(name)).code, 0);
    const std::string broken = name == "c" ? file(name) + "/10/330/777.terrain" : file(name);
    const std::string good = *read_whole_file(broken);
    damage(broken, good.size() / 2);
    const auto found = test::run_tind("verify " + file(name) + " --json");
    EXPECT_EQ(found.code, 65);
    EXPECT_FALSE(json_of(found)["ok"]);
    const std::string again = "verify " + file(name) + " --repair --json --source ";
    const auto mended = test::run_tind(again + dem());
    EXPECT_EQ(mended.code, 0) << mended.out;
    EXPECT_TRUE(json_of(mended)["ok"]);
    EXPECT_FALSE(json_of(mended)["before"]["ok"]);
    EXPECT_TRUE(*read_whole_file(broken) == good) << name;
  }
}

TEST_F(Copies, AnotherRegionOfTheSameGridReplacesNothing) {
  // Sheets of one survey: their posts lie on one grid.
  const auto sheet = [&](const char* name, double west) {
    std::ofstream out(file(name));
    out << "ncols 65\nnrows 65\nxllcenter " << west << "\nyllcenter 46\ncellsize 0.0009765625\n";
    for (int i = 0; i < 65 * 65; ++i) out << (i * 7) % 31 + i / 65 << ((i + 1) % 65 ? " " : "\n");
    return file(name) + " --crs EPSG:4326 --from-datum ellipsoid";
  };
  const std::string near = sheet("near.asc", 7), far = sheet("far.asc", 9);
  ASSERT_EQ(test::run_tind("build " + near + " -o " + file("near")).code, 0);
  ASSERT_EQ(test::run_tind("build " + far + " -o " + file("far")).code, 0);
  ASSERT_EQ(copy(file("near"), file("near.pmtiles")).code, 0);
  const std::string before = *read_whole_file(file("near.pmtiles"));
  EXPECT_EQ(copy(file("far"), file("near.pmtiles")).code, 2);
  EXPECT_EQ(copy(file("far"), file("near")).code, 2);
  EXPECT_EQ(test::run_tind("build " + far + " -o " + file("near")).code, 2);
  EXPECT_EQ(*read_whole_file(file("near.pmtiles")), before);
  EXPECT_EQ(json_of(test::run_tind("build " + near + " -o " + file("near") + " --json"))["built"],
            0);
  EXPECT_EQ(copy("--force " + file("far"), file("near.pmtiles")).code, 0);
}

TEST_F(Copies, MostTilesAreNotTakenAwayUnasked) {
  const auto strip = [&](const char* name, int from, int cols) {
    std::ofstream out(file(name));
    out << "ncols " << cols << "\nnrows 65\nxllcenter " << 7 + from / 1024. << "\nyllcenter 46\n"
        << "cellsize 0.0009765625\n";
    for (int i = 0; i < cols * 65; ++i)
      out << ((from + i % cols) * 7) % 31 + i / cols << ((i + 1) % cols ? " " : "\n");
    return file(name) + " ";
  };
  const std::string west = strip("w.asc", 0, 65), middle = strip("m.asc", 64, 193),
                    east = strip("e.asc", 256, 769);
  const std::string options =
      "--crs EPSG:4326 --from-datum ellipsoid -o " + file("strips") + " --json";
  ASSERT_EQ(test::run_tind("build " + west + middle + east + options).code, 0);
  const auto some = test::run_tind("build " + middle + east + options);
  EXPECT_EQ(some.code, 0) << some.out;
  for (const char* asked : {"", " --dry-run"}) {
    const auto few = test::run_tind("build " + middle + options + asked);
    EXPECT_EQ(few.code, 2) << asked;
    EXPECT_NE(few.out.find("would be taken away"), std::string::npos) << few.out;
  }
  EXPECT_EQ(json_of(test::run_tind("build " + middle + east + options))["built"], 0);
  EXPECT_EQ(test::run_tind("build " + middle + options + " --force").code, 0);
}

TEST_F(Copies, OfAnotherSourceNothingIsMended) {
  for (const std::string name : {"d.pmtiles", "d"}) {
    ASSERT_EQ(copy(tiles(), file(name)).code, 0);
    const std::string broken = name == "d" ? file(name) + "/10/330/777.terrain" : file(name);
    damage(broken, read_whole_file(broken)->size() / 2);
    const std::string bad = *read_whole_file(broken);
    const auto other = test::run_tind("verify " + file(name) + " --repair --source " +
                                      test::testdata("bigtujunga_crop.tif"));
    EXPECT_EQ(other.code, 2);
    EXPECT_THAT(other.out, HasSubstr("cannot be made again of this source"));
    EXPECT_TRUE(*read_whole_file(broken) == bad);
  }
}

TEST_F(Copies, WhatWasFoundIsSaidThoughItCannotBeMended) {
  const std::string at = file("found");
  ASSERT_EQ(copy(tiles(), at).code, 0);
  fs::remove(at + "/10/330/778.terrain");
  const std::string again = "verify " + at + " --repair --source ";
  for (const auto& [source, code] :
       {std::pair{test::testdata("bigtujunga_crop.tif"), 2}, {file("no such.tif"), 69}}) {
    const auto text = test::run_tind(again + "'" + source + "'");
    EXPECT_EQ(text.code, code) << text.out;
    EXPECT_THAT(text.answer, HasSubstr("1 missing: 10/330/778"));
    const auto said = test::run_tind(again + "'" + source + "' --json");
    EXPECT_EQ(said.code, code) << said.out;
    const auto found = json_of(said);
    ASSERT_TRUE(found.is_object()) << said.out;
    EXPECT_EQ(found, json_of(test::run_tind("verify " + at + " --json")));
    EXPECT_EQ(found["ok"], false);
    EXPECT_EQ(found["missing"]["tiles"][0], "10/330/778");
  }
}

TEST_F(Copies, WhatARefusedRepairAsksForMendsTheTiles) {
  const auto sheet = [&](const char* name, int posts, double corner, double step) {
    std::ofstream out(file(name));
    out << "ncols " << posts << "\nnrows " << posts << "\nxllcenter " << 7 + corner
        << "\nyllcenter " << 46 + corner << "\ncellsize " << step << "\n";
    for (int i = 0; i < posts * posts; ++i)
      out << (i * 7) % 31 + i / posts << ((i + 1) % posts ? " " : "\n");
    return file(name);
  };
  test::ShapesFile lake("copies-lake");
  lake.polygon({test::square(7.03, 46.03, 0.02)});
  const std::string layers = " --layer a=" + sheet("coarse.asc", 33, 0, 0.00390625) +
                             " --layer b=" + sheet("fine.asc", 65, 0.0234375, 0.0009765625) +
                             " --crs EPSG:4326 --from-datum ellipsoid";
  const std::string shapes = " --flatten " + lake.write() + " --water " + lake.write();
  const std::string joined = " --layer-error a=50 --blend b=100.5";
  const std::string at = file("asked"), again = "verify " + at + " --repair" + layers;
  const auto built = test::run_tind("build" + layers + shapes + joined + " --deepest 9 -o " + at);
  ASSERT_EQ(built.code, 0) << built.out;
  std::string tile;
  for (const auto& entry : fs::recursive_directory_iterator(at))
    if (entry.path().extension() == ".terrain") tile = entry.path();
  const std::string good = *read_whole_file(tile);
  fs::remove(tile);
  const auto bare = test::run_tind(again);
  EXPECT_EQ(bare.code, 2);
  for (const char* option : {"--layer-error a=50", "--blend b=100.5", "--flatten", "--water"})
    EXPECT_THAT(bare.out, HasSubstr(option));
  EXPECT_FALSE(fs::exists(tile));
  const auto mended = test::run_tind(again + shapes + joined);
  EXPECT_EQ(mended.code, 0) << mended.out;
  EXPECT_TRUE(read_whole_file(tile).value_or("") == good);
}

TEST_F(Copies, MissingTilesComeBackAndForeignOnesAreNamed) {
  const std::string at = file("e");
  ASSERT_EQ(copy(tiles(), at).code, 0);
  const std::string good = *read_whole_file(at + "/10/330/778.terrain");
  fs::remove(at + "/10/330/778.terrain");
  fs::create_directories(at + "/10/3");
  std::ofstream(at + "/10/3/4.terrain") << "somebody's";
  std::ofstream(at + "/notes.txt") << "somebody's";
  const auto mended = test::run_tind("verify " + at + " --repair --json --source " + dem());
  EXPECT_EQ(mended.code, 65) << "the foreign one stays";
  const auto said = json_of(mended);
  EXPECT_EQ(said["made"], 1);
  EXPECT_EQ(said["before"]["missing"]["tiles"][0], "10/330/778");
  EXPECT_EQ(said["missing"]["count"], 0);
  EXPECT_EQ(said["foreign"]["tiles"][0], "10/3/4");
  EXPECT_EQ(said["others"][0], "notes.txt");
  EXPECT_TRUE(*read_whole_file(at + "/10/330/778.terrain") == good);
  EXPECT_EQ(*read_whole_file(at + "/10/3/4.terrain"), "somebody's");
}

TEST_F(Copies, TilesThatLayerJsonNoLongerNamesAreNotLeftOut) {
  const std::string from = file("fewer"), layer = from + "/layer.json";
  fs::copy(tiles(), from, fs::copy_options::recursive);
  auto json = nlohmann::ordered_json::parse(*read_whole_file(layer));
  auto& deepest = json["available"].back().back();
  ASSERT_GT(deepest["endX"].get<int>(), deepest["startX"].get<int>());
  deepest["endX"] = deepest["endX"].get<int>() - 1;
  std::ofstream(layer) << json.dump();
  EXPECT_EQ(test::run_tind("verify " + from).code, 65);
  for (const char* to : {"fewer.pmtiles", "fewer.mbtiles", "fewer2"}) {
    const auto ran = copy(from, file(to));
    EXPECT_EQ(ran.code, 65) << to << ran.out;
    EXPECT_THAT(ran.out, HasSubstr(layer)) << to;
    EXPECT_FALSE(fs::exists(file(to))) << to;
  }
  // Of what has no ledger, layer.json alone says what there is.
  fs::remove(from + "/tind-tiles.ledger");
  EXPECT_EQ(copy(from, file("fewer.pmtiles")).code, 0);
}

TEST_F(Copies, RangesThatOverlapAreNoTilesTwice) {
  const std::string from = file("overlap"), layer = from + "/layer.json";
  fs::copy(tiles(), from, fs::copy_options::recursive);
  auto json = nlohmann::ordered_json::parse(*read_whole_file(layer));
  json["available"].back().push_back(json["available"].back().back());  // as others may
  std::ofstream(layer) << json.dump();
  for (const auto& entry : fs::directory_iterator(from))
    if (entry.path().filename().string().starts_with("tind-")) fs::remove_all(entry.path());
  ASSERT_EQ(copy(from, file("overlap2")).code, 0);
  const auto again = copy(file("overlap2"), file("overlap.pmtiles"));
  EXPECT_EQ(again.code, 0) << again.out;
}

TEST_F(Copies, WhatCannotBeReadIsNotLeftOut) {
  const std::string from = file("unreadable");
  fs::copy(tiles(), from, fs::copy_options::recursive);
  fs::remove(from + "/tind-build.json");
  fs::create_symlink(from + "/tind-build.json", from + "/tind-build.json");  // nobody can open it
  EXPECT_EQ(copy(from, file("without.pmtiles")).code, 74);
  EXPECT_FALSE(fs::exists(file("without.pmtiles")));
}

TEST_F(Copies, WhatCannotBeReadIsNotSaidToBeDamaged) {
  const std::string at = file("unread"), tile = at + "/10/330/777.terrain";
  fs::copy(tiles(), at, fs::copy_options::recursive);
  for (const std::string& path : {tile, at + "/tind-tiles.ledger", at + "/layer.json"}) {
    fs::rename(path, file("away"));
    fs::create_symlink(path, path);  // a loop, which nobody can open
    const auto found = test::run_tind("verify " + at + " --json");
    EXPECT_EQ(found.code, 74) << path << found.out;
    EXPECT_EQ(json_of(found)["unread"]["count"], path == tile ? 1 : 0);
    EXPECT_EQ(json_of(found)["damaged"]["count"], 0);
    if (path.ends_with("layer.json")) {
      EXPECT_EQ(json_of(found)["sound"], json_of(found)["tiles"]) << "the ledger tells them, too";
      EXPECT_GT(json_of(found)["tiles"], 0);
    }
    fs::remove(path);
    fs::rename(file("away"), path);
  }
  EXPECT_EQ(test::run_tind("verify " + at).code, 0);
}

TEST_F(Copies, WhereNothingCanBeMadeIsSaidBeforeTheWork) {
  const std::string closed = file("closed");
  fs::create_directory(closed);
  std::ofstream(closed + "/a file");
  for (const char* name : {"/a file/x.pmtiles", "/a file/x"}) {
    const auto ran = copy(tiles(), "'" + closed + name + "'");
    EXPECT_EQ(ran.code, 73) << ran.out;
  }
}

TEST_F(Copies, NothingIsMadeInALevelOfATileSet) {
  ASSERT_EQ(copy(tiles(), file("other")).code, 0);
  const std::string build = "build " + dem() + " --levels 0-3 -o ", inside = tiles() + "/1/new";
  const std::string in_it = "cd " + tiles() + ";", in_level = "cd " + tiles() + "/1;";
  for (const auto& [line, before] : {std::pair{build + tiles() + "/0", std::string()},
                                     {build + inside, ""},
                                     {build + inside + " --dry-run", ""},
                                     {build + "new", in_level},
                                     {build + inside + " --format 3dtiles", ""},
                                     {"build " + dem() + " --format terrarium -o " + inside, ""},
                                     {"build " + dem() + " --format flightgear -o " + inside, ""},
                                     {"export " + dem() + " --format cdb -o " + inside, ""},
                                     {"copy " + file("other") + " " + inside, ""},
                                     {"copy " + tiles() + " " + inside, ""},
                                     {"copy . new", in_it},
                                     {"copy . new.pmtiles", in_it}}) {
    const auto ran = test::run_tind(line, before);
    EXPECT_EQ(ran.code, 2) << line << "\n" << ran.out;
    EXPECT_EQ(std::ranges::count(ran.out, '\n'), 1) << line << "\n" << ran.out;
    EXPECT_FALSE(fs::exists(inside)) << line;
    EXPECT_FALSE(fs::exists(tiles() + "/new")) << line;
    EXPECT_FALSE(fs::exists(tiles() + "/new.pmtiles")) << line;
  }
  EXPECT_EQ(test::run_tind(build + tiles() + "/beside").code, 0);
  EXPECT_EQ(test::run_tind("verify " + tiles()).code, 0);
  // What belongs to the tiles lies in their folder.
  const auto with_3dtiles =
      test::run_tind("build " + dem() + " --deepest 11 --format 3dtiles -o " + file("other"));
  EXPECT_EQ(with_3dtiles.code, 0) << with_3dtiles.out;
}

TEST_F(Copies, WhatIsBeingBuiltIsCopiedLater) {
  const std::string at = file("under way"), quoted = "'" + at + "'";
  ASSERT_EQ(copy(tiles(), quoted).code, 0);
  fs::remove(at + "/layer.json");
  {
    const auto building = FolderLock::take(at);
    ASSERT_TRUE(building) << building.error().what;
    const auto early = copy(quoted, file("early"));
    EXPECT_EQ(early.code, 75) << early.out;
    EXPECT_THAT(early.out, HasSubstr("is being built by another tind"));
  }
  EXPECT_EQ(copy(quoted, file("early")).code, 69);
}

TEST_F(Copies, BadInputIsOneLine) {
  EXPECT_EQ(test::run_tind("verify " + file("none.pmtiles")).code, 69);
  EXPECT_EQ(copy(tiles(), file("tiles.zip")).code, 2);
  EXPECT_FALSE(fs::exists(file("tiles.zip")));
  EXPECT_EQ(test::run_tind("verify " + dem()).code, 2);
  EXPECT_EQ(test::run_tind("verify " + tiles() + " --repair").code, 2);
  EXPECT_EQ(test::run_tind("verify " + tiles() + " --source " + dem()).code, 2);
  EXPECT_EQ(copy(dem(), file("f.pmtiles")).code, 2);
  EXPECT_EQ(copy(file("none.mbtiles"), file("f.pmtiles")).code, 69);
  std::ofstream(file("text.pmtiles")) << "no archive at all";
  EXPECT_EQ(copy(file("text.pmtiles"), file("f.pmtiles")).code, 65);
  EXPECT_EQ(copy(tiles(), file("text.pmtiles")).code, 2);
  EXPECT_EQ(test::run_tind("build " + dem() + " -o " + file("g.pmtiles")).code, 2);
  EXPECT_FALSE(fs::exists(file("f.pmtiles")));
}

}  // namespace
}  // namespace tind
