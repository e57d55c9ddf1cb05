// 3D Tiles as tind makes them are right, as a folder and as an archive; what is taken away, added
// or changed is found.

#include "terrain/check/check_tileset.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <fstream>
#include <functional>
#include <nlohmann/json.hpp>
#include <random>
#include <utility>

#include "proto/zip.h"
#include "terrain/base/bytes.h"
#include "terrain/base/file_io.h"
#include "terrain/check/check_glb.h"
#include "tests/support/as_somebody_else.h"
#include "tests/support/program.h"

namespace tind {
namespace {

namespace fs = std::filesystem;

class CheckTileset : public ::testing::Test {
 protected:
  const test::TempDir dir_;
  const std::string folder_ = dir_.file("tiles/3dtiles"), file_ = dir_.file("a.3tz");

  void SetUp() override {
    const auto built =
        test::run_tind("build " + test::testdata("desert.asc") + " --levels 0-4 -o " +
                       dir_.file("tiles") + " --format 3dtiles --archive " + file_);
    ASSERT_EQ(built.code, 0) << built.out;
  }
  static TilesetReport check(const std::string& location) {
    const auto files = TilesetFiles::open(location);
    if (!files) throw std::runtime_error(files.error().what);
    return *check_tileset(**files);
  }
  std::string any(const std::string& ending) const {
    for (const auto& entry : fs::recursive_directory_iterator(folder_))
      if (entry.path().string().ends_with(ending) &&
          entry.path().string().find("/0/0/0") == std::string::npos)
        return entry.path().string();
    return {};
  }
};

TEST_F(CheckTileset, WhatTindMakesIsRightInAFolderAndAnArchive) {
  const auto folder = check(folder_), archive = check(file_);
  EXPECT_TRUE(folder.ok()) << folder.examples[0];
  EXPECT_TRUE(archive.ok()) << archive.examples[0];
  EXPECT_GE(folder.contents, 6u);
  EXPECT_EQ(folder.contents, archive.contents);
  EXPECT_EQ(folder.subtrees, archive.subtrees);
  const auto files = TilesetFiles::open(file_);
  ASSERT_TRUE(files);
  const auto facts = tileset_facts(**files);
  ASSERT_TRUE(facts) << facts.error().what;
  EXPECT_EQ(facts->contents, archive.contents);
  EXPECT_EQ(facts->compression, "none");
  EXPECT_EQ(facts->generator, "tind");
  EXPECT_TRUE(facts->implicit);
  EXPECT_EQ(facts->levels.size(), 5u);
}

TEST_F(CheckTileset, WhatIsMissingOrTooMuchOrCutOffIsFound) {
  const std::string glb = any(".glb"), bytes = *read_whole_file(glb);
  fs::remove(glb);
  EXPECT_EQ(check(folder_).violations, 1u);
  std::ofstream(glb, std::ios::binary) << bytes.substr(0, bytes.size() - 1);
  EXPECT_EQ(check(folder_).violations, 1u);
  std::ofstream(glb, std::ios::binary) << bytes;
  fs::create_directories(folder_ + "/east/4/1");
  fs::copy_file(glb, folder_ + "/east/4/1/1.glb");
  EXPECT_EQ(check(folder_).violations, 1u);
  fs::remove(folder_ + "/east/4/1/1.glb");
  EXPECT_TRUE(check(folder_).ok());
  const std::string subtree = any(".subtree");
  std::ofstream(subtree, std::ios::binary) << "subt";
  EXPECT_FALSE(check(folder_).ok());
  std::ofstream(folder_ + "/tileset.json") << "{}";
  EXPECT_FALSE(check(folder_).ok());
}

TEST_F(CheckTileset, WhatCannotBeReadIsNotSaidToBeWrong) {
  const std::string glb = any(".glb");
  test::give_to_somebody(folder_);
  fs::permissions(dir_.file("tiles"), fs::perms(0755));
  fs::permissions(dir_.file(""), fs::perms(0755));
  fs::permissions(glb, fs::perms::none);
  const test::AsSomebodyElse now;
  const auto report = check(folder_);
  EXPECT_EQ(report.violations, 0u);
  EXPECT_EQ(report.unread, 1u);
  EXPECT_FALSE(report.ok());
  const std::string subtree = any(".subtree");
  fs::permissions(subtree, fs::perms::none);  // what it leads to nobody knows
  EXPECT_EQ(check(folder_).violations, 0u);
  EXPECT_GE(check(folder_).unread, 1u);
  fs::permissions(folder_ + "/tileset.json", fs::perms::none);
  const auto files = TilesetFiles::open(folder_);
  ASSERT_TRUE(files.has_value());
  EXPECT_EQ(check_tileset(**files).error().code, Errc::io);
}

TEST_F(CheckTileset, NoByteOfAnArchiveMayBeAnother) {
  const std::string whole = *read_whole_file(file_);
  std::mt19937 random(5);
  int found = 0, rounds = 0;
  for (; rounds < 200; ++rounds) {
    std::string bytes = whole;
    const std::size_t at = random() % bytes.size();
    if (rounds % 4 == 0)
      bytes.resize(at);
    else
      bytes[at] = char(bytes[at] + 1 + random() % 255);
    std::ofstream(file_, std::ios::binary) << bytes;
    const auto files = TilesetFiles::open(file_);
    found += !files || !check_tileset(**files)->ok();
  }
  EXPECT_GT(found, rounds * 9 / 10);  // dates and versions may say what they like
}

/// A triangle as a GLB, its JSON changed by `change`.
std::string triangle_glb(const std::function<void(nlohmann::json&)>& change,
                         std::array<std::uint16_t, 4> indices = {0, 1, 2, 0}) {
  nlohmann::json json = nlohmann::json::parse(R"({"asset": {"version": "2.0"},
    "buffers": [{"byteLength": 44}],
    "bufferViews": [{"buffer": 0, "byteOffset": 0, "byteLength": 36, "byteStride": 12},
                    {"buffer": 0, "byteOffset": 36, "byteLength": 8}],
    "accessors": [{"bufferView": 0, "byteOffset": 0, "componentType": 5126, "type": "VEC3", "count": 3},
                  {"bufferView": 1, "byteOffset": 0, "componentType": 5123, "type": "SCALAR", "count": 3}],
    "materials": [{}],
    "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1, "material": 0, "mode": 4}]}]})");
  change(json);
  std::string text = json.dump();
  text.resize((text.size() + 3) / 4 * 4, ' ');
  std::string glb(12 + 8 + text.size() + 8 + 44, '\0');
  char* at = glb.data();
  for (const std::uint32_t word :
       {0x46546c67u, 2u, std::uint32_t(glb.size()), std::uint32_t(text.size()), 0x4e4f534au})
    store(word, at), at += 4;
  at = std::ranges::copy(text, at).out;
  for (const std::uint32_t word : {44u, 0x004e4942u}) store(word, at), at += 4;
  at += 36;
  for (const std::uint16_t index : indices) store(index, at), at += 2;
  return glb;
}

TEST(CheckGlb, ANumberThatIsThereMustBeRight) {
  using Json = nlohmann::json;
  EXPECT_EQ(wrong_with_glb(triangle_glb([](Json&) {})), "");
  EXPECT_EQ(wrong_with_glb(triangle_glb([](Json& j) {
              j["bufferViews"][0].erase("byteOffset");
              j["bufferViews"][0].erase("byteStride");
              j["accessors"][1].erase("byteOffset");
              for (const char* name : {"indices", "material", "mode"})
                j["meshes"][0]["primitives"][0].erase(name);
            })),
            "");
  const std::pair<const char*, Json> kWrong[] = {
      {"/bufferViews/0/byteOffset", -4},
      {"/bufferViews/0/byteOffset", 12},
      {"/bufferViews/0/byteOffset", "0"},
      {"/bufferViews/0/byteOffset", 0.5},
      {"/bufferViews/0/byteStride", 0},
      {"/bufferViews/0/byteStride", 2},
      {"/bufferViews/0/byteStride", 8},  // shorter than what it is of
      {"/bufferViews/0/byteStride", 14},
      {"/bufferViews/0/byteStride", 256},
      {"/bufferViews/0/byteStride", nullptr},
      {"/bufferViews/1/byteOffset", 37},  // no multiple of two
      {"/bufferViews/1/buffer", 1},
      {"/accessors/0/byteOffset", -12},
      {"/accessors/0/byteOffset", 4},
      {"/accessors/0/byteOffset", true},
      {"/accessors/1/byteOffset", 1},
      {"/accessors/0/bufferView", 2},
      {"/accessors/0/count", 4},
      {"/accessors/1/componentType", 5126},
      {"/accessors/1/type", "VEC2"},
      {"/meshes/0/primitives/0/indices", 2},
      {"/meshes/0/primitives/0/indices", -1},
      {"/meshes/0/primitives/0/indices", 0},  // floats
      {"/meshes/0/primitives/0/attributes/POSITION", 7},
      {"/meshes/0/primitives/0/attributes", Json::object()},
      {"/meshes/0/primitives/0/material", 1},
      {"/meshes/0/primitives/0/mode", 7},
      {"/meshes/0/primitives", Json::array()}};
  for (const auto& [where, value] : kWrong)
    EXPECT_NE(wrong_with_glb(triangle_glb([&](Json& j) { j[Json::json_pointer(where)] = value; })),
              "")
        << where << " " << value;
  EXPECT_NE(wrong_with_glb(triangle_glb([](Json&) {}, {0, 1, 3, 0})), "");
  EXPECT_EQ(wrong_with_glb(triangle_glb([](Json&) {}, {0, 1, 2, 9})), "");  // not used
}

TEST_F(CheckTileset, ASubtreeOfOnesIsNotFollowedForEver) {
  const std::string json = R"({"tileAvailability":{"constant":1},)"
                           R"("contentAvailability":[{"constant":1}],)"
                           R"("childSubtreeAvailability":{"constant":1}}   )";
  std::string subtree(24, '\0');
  store(std::uint32_t(0x74627573), subtree.data());
  store(std::uint32_t(1), &subtree[4]);
  store(std::uint64_t(json.size()), &subtree[8]);
  const std::string folder = dir_.file("ones");
  fs::create_directories(folder + "/0/0");
  std::ofstream(folder + "/0/0/0.subtree", std::ios::binary) << subtree + json;
  const auto with_uri = [&](const std::string& uri) {
    std::ofstream(folder + "/tileset.json")
        << R"({"asset":{"version":"1.1"},"geometricError":9,"root":{"boundingVolume":{},)"
        << R"("geometricError":9,"content":{"uri":"{level}/{x}/{y}.glb"},"implicitTiling":)"
        << R"({"subdivisionScheme":"QUADTREE","subtreeLevels":10,"availableLevels":30,)"
        << R"("subtrees":{"uri":")" << uri << R"("}}}})";
    return check(folder);
  };
  const TilesetReport all = with_uri("{level}/{x}/{y}.subtree");
  EXPECT_TRUE(all.ended_early());
  EXPECT_EQ(all.violations, TilesetReport::kMost);
  EXPECT_EQ(all.examples.size(), TilesetReport::kExamples);
  const TilesetReport one = with_uri("0/0/0.subtree");  // the same file for all
  EXPECT_EQ(one.subtrees, 0u);
  EXPECT_FALSE(one.ok());
}

TEST_F(CheckTileset, TilesNestedTooDeepAreSaidToBe) {
  std::string tile = R"({"boundingVolume":{},"geometricError":0})";
  for (int i = 0; i < 200; ++i)
    tile = R"({"boundingVolume":{},"geometricError":9,"children":[)" + tile + "]}";
  const std::string folder = dir_.file("deep");
  fs::create_directories(folder);
  std::ofstream(folder + "/tileset.json")
      << R"({"asset":{"version":"1.1"},"geometricError":9,"root":)" << tile << "}";
  std::ofstream(folder + "/any.glb") << "";  // of which nobody can say that no tile leads to it
  const TilesetReport report = check(folder);
  EXPECT_EQ(report.violations, 1u);
  EXPECT_NE(report.examples[0].find("nested more than 100 deep"), std::string::npos)
      << report.examples[0];
  const auto files = TilesetFiles::open(folder);
  ASSERT_TRUE(files);
  EXPECT_EQ(tileset_facts(**files).error().code, Errc::out_of_range);
}

/// A sparse file of 5 GB, and an archive of one entry that says so of itself.
TEST_F(CheckTileset, AFileOfGigabytesIsNotRead) {
  fs::resize_file(any(".glb"), 5ull << 30);
  const TilesetReport report = check(folder_);
  EXPECT_EQ(report.violations, 1u);
  EXPECT_NE(report.examples[0].find("MiB"), std::string::npos);
  proto::ZipEntry entry{.name = "tileset.json", .packed = 1u << 31, .size = 1u << 31};
  std::ofstream(file_, std::ios::binary) << proto::encode_local_header(entry);
  const std::uint64_t end = proto::encode_local_header(entry).size() + entry.size;
  fs::resize_file(file_, end);
  std::ofstream(file_, std::ios::binary | std::ios::app)
      << proto::encode_directory({&entry, 1}, end);
  const auto files = TilesetFiles::open(file_);
  ASSERT_TRUE(files) << files.error().what;
  const auto read = (*files)->read("tileset.json");
  ASSERT_FALSE(read);
  EXPECT_EQ(read.error().code, Errc::out_of_range);
}

TEST_F(CheckTileset, TheProgramTellsThemFromOtherTiles) {
  for (const std::string& location : {folder_, folder_ + "/tileset.json", file_}) {
    const auto info = test::run_tind("info " + location);
    EXPECT_EQ(info.code, 0) << info.out;
    EXPECT_NE(info.out.find("3D Tiles"), std::string::npos) << info.out;
    EXPECT_EQ(test::run_tind("check " + location).code, 0);
  }
  EXPECT_EQ(test::run_tind("check " + folder_ + " --levels 0-2").code, 2);
  fs::remove(any(".glb"));
  const auto broken = test::run_tind("check " + folder_);
  EXPECT_EQ(broken.code, 65);
  EXPECT_NE(broken.out.find("1 violations"), std::string::npos) << broken.out;
  EXPECT_EQ(test::run_tind("info " + dir_.file("tiles")).code, 0);
  EXPECT_EQ(test::run_tind("check " + dir_.file("none.3tz")).code, 69);
}

}  // namespace
}  // namespace tind
