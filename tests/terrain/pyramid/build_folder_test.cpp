// The folder of a build: what a power cut, a fault of the disk, another build or somebody's own
// files do to it.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iterator>
#include <map>
#include <nlohmann/json.hpp>
#include <random>

#include "terrain/check/check.h"
#include "terrain/pyramid/build/build.h"
#include "terrain/store/folder/folder_lock.h"
#include "terrain/store/folder/folder_writer.h"
#include "terrain/store/folder/tile_ledger.h"
#include "terrain/store/open/stored_tiles.h"
#include "tests/support/flat_dem.h"
#include "tests/support/support.h"
#include "tests/support/watched_files.h"

namespace tind {
namespace {

namespace fs = std::filesystem;
using nlohmann::ordered_json;
using test::TempDir;
using testing::HasSubstr;

constexpr int kCols = 150, kRows = 120;
/// On the disk before anything else of a build is, so that it is there after every cut.
constexpr const char* kLeftLock = "tind build: process 1 on elsewhere since 2020-01-01T00:00:00Z\n";
using Files = std::map<std::string, std::string>;

std::string bytes_of(const fs::path& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
}

void write(const fs::path& path, const std::string& bytes) {
  fs::create_directories(path.parent_path());
  std::ofstream(path, std::ios::binary) << bytes;
}

/// Every file below, with what is in it; of links where they lead.
Files files_in(const fs::path& folder) {
  Files all;
  if (!fs::exists(folder)) return all;
  for (const auto& entry : fs::recursive_directory_iterator(folder)) {
    const std::string name = fs::relative(entry.path(), folder).string();
    if (entry.is_symlink())
      all[name] = "-> " + fs::read_symlink(entry.path()).string();
    else if (entry.is_regular_file())
      all[name] = bytes_of(entry.path());
  }
  return all;
}

bool is_tile(const std::string& name) { return name.ends_with(".terrain"); }

/// Locks a folder that is written this way.
auto by(const std::shared_ptr<FolderFiles>& files) {
  return [files](const std::string& output) { return lock_folder(output, files); };
}

class BuildFolderTest : public testing::Test {
 protected:
  static std::shared_ptr<const DemSource> dem(float lift = 0) {
    static TempDir folder;
    const std::string path = folder.file("dem" + std::to_string(int(lift)) + ".asc");
    if (!fs::exists(path)) {
      const HeightGrid grid = test::rough_terrain(kCols, kRows, 5);
      std::ofstream out(path);
      out << "ncols " << kCols << "\nnrows " << kRows
          << "\nxllcenter -121.7\nyllcenter 46.8\ncellsize 0.000833333333\nNODATA_value -9999\n";
      for (int r = 0; r < kRows; ++r)
        for (int c = 0; c < kCols; ++c)
          out << grid.at(c, r) + (c < 20 && r < 20 ? lift : 0) << (c + 1 < kCols ? ' ' : '\n');
      out.close();
      std::ofstream(fs::path(path).replace_extension(".prj"))
          << R"(GEOGCS["GCS_WGS_1984",DATUM["D_WGS_1984",SPHEROID["WGS_1984",6378137.0,)"
          << R"(298.257223563]],PRIMEM["Greenwich",0.0],UNIT["Degree",0.0174532925199433]])";
    }
    auto source = DemSource::open(std::vector{path});
    if (!source) throw std::runtime_error(source.error().what);
    return *source;
  }
  BuildOptions options(const std::string& name = "tiles") const {
    BuildOptions o;
    o.output = folder_.file(name);
    o.tiles.max_error_m = 8;
    o.tiles.effort = Effort::fast;
    o.threads = 2;
    o.batch = 8;
    o.lock = by(std::make_shared<test::Unsynced>());
    return o;
  }
  BuildReport build(const std::string& name = "tiles", float lift = 0) const {
    const auto report = build_tiles(dem(lift), options(name));
    EXPECT_TRUE(report) << report.error().what;
    return report.value_or(BuildReport{});
  }
  /// Without touching anything.
  void expect_refused(const BuildOptions& o, const std::string& why, float lift = 0) const {
    const Files before = files_in(o.output);
    const auto report = build_tiles(dem(lift), o);
    ASSERT_FALSE(report) << why;
    EXPECT_EQ(report.error().code, Errc::invalid_argument) << report.error().what;
    EXPECT_THAT(report.error().what, HasSubstr(why));
    EXPECT_EQ(files_in(o.output), before) << why;
  }

  TempDir folder_;
};

// ---- power ----

/// What a cut left must not say more than is there: a tile that the ledger names, or layer.json
/// calls available, is whole.
void expect_nothing_claimed_in_vain(const std::string& folder) {
  if (const auto ledger = TileLedger::open(folder + "/tind-tiles.ledger")) {
    const auto ready = fs::exists(folder + "/tind-update-ready");
    for (std::size_t z = 0; z < ledger->levels().size(); ++z)
      for (const proto::TileRange& r : ledger->levels()[z])
        for (std::uint32_t x = r.start_x; x <= r.end_x; ++x)
          for (std::uint32_t y = r.start_y; y <= r.end_y; ++y) {
            const TileId id{int(z), x, y};
            const auto entry = ledger->find(id).value();
            EXPECT_TRUE(!entry || ready ||
                        entry->vouches_for(bytes_of(folder + "/" + id.text() + ".terrain")))
                << id.text();
          }
  }
  if (!fs::exists(folder + "/layer.json")) return;
  const auto tiles = open_stored_tiles(folder);
  ASSERT_TRUE(tiles) << tiles.error().what;
  const auto& available = (*tiles)->layer().available;
  for (std::size_t z = 0; z < available.size(); ++z)
    for (const proto::TileRange& r : available[z])
      for (std::uint32_t x = r.start_x; x <= r.end_x; ++x)
        for (std::uint32_t y = r.start_y; y <= r.end_y; ++y) {
          const auto tile = (*tiles)->tile({int(z), x, y}, {});
          EXPECT_TRUE(tile) << tile.error().what;
        }
}

TEST_F(BuildFolderTest, a_power_cut_at_any_step_costs_no_tile) {
  build("wanted");
  const Files wanted = files_in(folder_.path() / "wanted");
  ASSERT_GT(wanted.size(), 35u);
  fs::create_directories(folder_.path() / "disk");
  const auto watched = std::make_shared<test::WatchedFiles>(folder_.file("disk"));
  BuildOptions o = options("disk/tiles");
  o.lock = by(watched);
  ASSERT_TRUE(build_tiles(dem(), o));
  std::mt19937 random(1);
  std::uint64_t reused = 0, unsound = 0;
  for (int cut = 0; cut < 60; ++cut) {
    const std::string name = "cut" + std::to_string(cut);
    watched->leave(random() % (watched->steps() + 1), random, folder_.file(name));
    write(folder_.path() / name / "tiles/tind-lock", kLeftLock);
    expect_nothing_claimed_in_vain(folder_.file(name + "/tiles"));
    const BuildReport report = build(name + "/tiles");
    reused += report.reused, unsound += report.unsound;
    EXPECT_EQ(files_in(folder_.path() / name / "tiles"), wanted) << cut;
    fs::remove_all(folder_.path() / name);
  }
  EXPECT_GT(reused, 20u);  // or the cuts were none
  EXPECT_GT(unsound, 20u);
}

TEST_F(BuildFolderTest, a_power_cut_in_an_update_leaves_the_old_tiles_or_the_new_ones) {
  build("wanted", 40);
  const Files wanted = files_in(folder_.path() / "wanted");
  build("disk/tiles");
  const auto watched = std::make_shared<test::WatchedFiles>(folder_.file("disk"));
  BuildOptions o = options("disk/tiles");
  o.lock = by(watched);
  const auto update = build_tiles(dem(40), o);
  ASSERT_TRUE(update) << update.error().what;
  ASSERT_TRUE(update->update.updated);
  ASSERT_GT(update->reused, 5u);
  EXPECT_EQ(files_in(folder_.path() / "disk/tiles"), wanted);
  std::mt19937 random(2);
  for (int cut = 0; cut < 60; ++cut) {
    const std::string name = "cut" + std::to_string(cut);
    watched->leave(random() % (watched->steps() + 1), random, folder_.file(name));
    write(folder_.path() / name / "tiles/tind-lock", kLeftLock);
    expect_nothing_claimed_in_vain(folder_.file(name + "/tiles"));
    build(name + "/tiles", 40);
    EXPECT_EQ(files_in(folder_.path() / name / "tiles"), wanted) << cut;
    fs::remove_all(folder_.path() / name);
  }
}

// ---- faults ----

/// Some ways in which a file is not what it was.
const std::vector<std::pair<const char*, std::function<void(const fs::path&)>>>& faults() {
  static const std::vector<std::pair<const char*, std::function<void(const fs::path&)>>> all = {
      {"empty", [](const fs::path& p) { fs::resize_file(p, 0); }},
      {"half", [](const fs::path& p) { fs::resize_file(p, fs::file_size(p) / 2); }},
      {"zeros", [](const fs::path& p) { write(p, std::string(fs::file_size(p), '\0')); }},
      {"a bit",
       [](const fs::path& p) {
         std::string bytes = bytes_of(p);
         bytes[bytes.size() * 3 / 4] ^= 1;
         write(p, bytes);
       }},
      {"longer", [](const fs::path& p) { write(p, bytes_of(p) + '\0'); }},
      {"missing", [](const fs::path& p) { fs::remove(p); }},
  };
  return all;
}

TEST_F(BuildFolderTest, tiles_that_are_not_as_the_ledger_says_are_made_again_and_not_served) {
  const BuildReport first = build();
  const Files wanted = files_in(folder_.path() / "tiles");
  std::vector<std::string> tiles;
  for (const auto& [name, bytes] : wanted)
    if (is_tile(name)) tiles.push_back(name);
  const auto served = open_stored_tiles(folder_.file("tiles"));
  ASSERT_TRUE(served);
  for (std::size_t i = 0; i < faults().size(); ++i)
    faults()[i].second(folder_.path() / "tiles" / tiles[i * 3]);
  for (std::size_t i = 0; i < tiles.size(); ++i) {
    int z = 0, x = 0, y = 0;
    ASSERT_EQ(std::sscanf(tiles[i].c_str(), "%d/%d/%d.terrain", &z, &x, &y), 3);
    const auto tile = (*served)->tile(*tiling::tile(z, x, y), {});
    const bool good = i % 3 != 0 || i / 3 >= faults().size();
    EXPECT_EQ(tile.has_value(), good) << tiles[i];
    EXPECT_TRUE(tile || tile.error().code == Errc::io) << tiles[i];
  }
  const BuildReport again = build();
  EXPECT_EQ(again.unsound, faults().size());
  EXPECT_EQ(again.built, faults().size());
  EXPECT_EQ(files_in(folder_.path() / "tiles"), wanted);
  // What was kept counts with its errors.
  ASSERT_EQ(again.levels.size(), first.levels.size());
  for (std::size_t z = 0; z < first.levels.size(); ++z) {
    EXPECT_EQ(again.levels[z].worst_error_m, first.levels[z].worst_error_m);
    EXPECT_EQ(again.levels[z].worst_edge_error_m, first.levels[z].worst_edge_error_m);
    EXPECT_EQ(again.levels[z].bytes, first.levels[z].bytes);
  }
}

TEST_F(BuildFolderTest, a_damaged_ledger_says_less_and_nothing_wrong) {
  const BuildReport first = build();
  const Files wanted = files_in(folder_.path() / "tiles");
  const fs::path ledger = folder_.path() / "tiles/tind-tiles.ledger";
  const std::string whole = bytes_of(ledger);
  for (const auto& [what, spoil] : faults()) {
    if (std::string(what) == "longer") continue;  // harmless
    spoil(ledger);
    const BuildReport again = build();
    EXPECT_EQ(again.reused == 0, std::string(what) != "half" && std::string(what) != "a bit")
        << what;
    EXPECT_GT(again.built, 0u) << what;
    EXPECT_EQ(files_in(folder_.path() / "tiles"), wanted) << what;
  }
  // Each bit matters: of a place, its tile is lost; of the head, all are.
  for (std::size_t i = 0; i < whole.size(); i += 7) {
    std::string flipped = whole;
    flipped[i] ^= char(1 << i % 8);
    write(ledger, flipped);
    const auto read = TileLedger::open(ledger.string());
    std::uint64_t found = 0;
    for (const auto& [name, bytes] : wanted) {
      int z = 0, x = 0, y = 0;
      if (!read || std::sscanf(name.c_str(), "%d/%d/%d.terrain", &z, &x, &y) != 3) continue;
      const auto entry = read->find(*tiling::tile(z, x, y)).value();
      EXPECT_TRUE(!entry || entry->vouches_for(bytes));
      found += entry.has_value();
    }
    EXPECT_TRUE(found == 0 || found + 1 == first.tiles ||
                flipped.substr(0, 320) != whole.substr(0, 320))
        << i;
  }
  // An entry of another tile, or of a ledger of other tiles, in the right form.
  std::string moved = whole;
  const std::size_t size = whole.size();
  moved.replace(size - 128, 64, whole.substr(size - 64));
  write(ledger, moved);
  EXPECT_EQ(build().unsound, 1u);
  EXPECT_EQ(files_in(folder_.path() / "tiles"), wanted);
}

TEST_F(BuildFolderTest, check_says_which_tiles_are_not_as_the_ledger_says) {
  build();
  std::size_t r = 0;
  while (kCheckRules[r].id != "tile.ledger") ++r;
  const auto findings = [&] {
    const auto report = check_tiles(folder_.file("tiles"), {});
    EXPECT_TRUE(report);
    return report->findings[r];
  };
  EXPECT_EQ(findings().count, 0u);
  // Another whole tile in its place: nothing else would notice.
  const fs::path tile = folder_.path() / "tiles/0/0/0.terrain";
  write(tile, bytes_of(tile) + std::string(1, '\0'));
  EXPECT_EQ(findings().count, 1u);
  EXPECT_THAT(findings().examples, testing::ElementsAre("0/0/0: other bytes"));
}

// ---- what is not ours ----

TEST_F(BuildFolderTest, what_is_not_ours_is_never_touched) {
  const BuildOptions o = options();
  BuildOptions force = o;
  force.force = true;
  const fs::path tiles = o.output;
  const auto fresh = [&] { fs::remove_all(tiles); };
  // The reproduction of the report: names that pyramids have, too.
  write(tiles / "3/photos/p.jpg", "a photo");
  write(tiles / "7", "not a folder");
  write(tiles / "notes.txt", "mine");
  for (const BuildOptions& options : {o, force}) expect_refused(options, "7 is in the place");
  fs::remove(tiles / "7");
  ASSERT_TRUE(build_tiles(dem(), o));
  EXPECT_EQ(bytes_of(tiles / "3/photos/p.jpg"), "a photo");
  EXPECT_EQ(bytes_of(tiles / "notes.txt"), "mine");
  // Tiles of other options are replaced, on demand; nothing beside them is.
  BuildOptions other = force;
  other.tiles.max_error_m = 20;
  write(tiles / "5/5.txt", "mine, too");
  fs::create_directories(tiles / "20/1");
  ASSERT_TRUE(build_tiles(dem(), other));
  for (const char* name : {"3/photos/p.jpg", "notes.txt", "5/5.txt"})
    EXPECT_TRUE(fs::exists(tiles / name)) << name;
  EXPECT_TRUE(fs::exists(tiles / "20/1"));
  fresh();

  for (const BuildOptions& options : {o, force}) {
    write(tiles / "0/0/0.terrain", "a tile of somebody else's");
    expect_refused(options, "0/0/0.terrain is in the place of a tile");
    fresh();
    fs::create_directories(tiles / "0/0/0.terrain");
    expect_refused(options, "0/0/0.terrain is in the place of a tile");
    fresh();
    fs::create_directories(tiles / "elsewhere");
    fs::create_directory_symlink("elsewhere", tiles / "0");
    expect_refused(options, "0 is in the place of a folder");
    fresh();
    write(tiles / "layer.json", "{}");
    expect_refused(options, "that tind build did not make");
    fresh();
    for (const char* name : {"tind-tiles.ledger", "residuals.tind", "residuals.tind.part",
                             "tind-update", "tind-partial"}) {
      write(tiles / name, "mine");
      expect_refused(options, name);
      fresh();
    }
    write(tiles / "tind-lock", "mine");
    expect_refused(options, "tind-lock is in the way and not tind's");
    fresh();
    fs::create_directories(tiles / "tind-lock");
    expect_refused(options, "tind-lock is in the way and not tind's");
    fresh();
    fs::create_directories(tiles);
    fs::create_symlink("elsewhere", tiles / "tind-lock");
    expect_refused(options, "tind-lock is in the way and not tind's");
    fresh();
  }
  // In the way of a build that goes on, or of an update.
  for (const float lift : {0.f, 40.f}) {
    build();
    fs::remove(tiles / "0/0/0.terrain");
    write(tiles / "0/0/0.terrain/mine", "mine");
    expect_refused(o, "0/0/0.terrain is in the place of a tile", lift);
    fresh();
  }
}

TEST_F(BuildFolderTest, tiles_of_other_kinds_are_refused_and_replaced_only_if_tind_knows_them) {
  const BuildOptions o = options();
  BuildOptions force = o;
  force.force = true;
  const fs::path record = folder_.path() / "tiles/tind-build.json";
  build();
  const Files wanted = files_in(o.output);
  const auto edit = [&](const std::function<void(ordered_json&)>& change) {
    ordered_json json = ordered_json::parse(bytes_of(record));
    change(json);
    write(record, json.dump(1) + "\n");
  };
  edit([](ordered_json& j) { j["epoch"] = j["epoch"].get<int>() - 1; });
  expect_refused(o, "another version of tind");
  write(folder_.path() / "tiles/0/0/0.terrain", "old");
  ASSERT_TRUE(build_tiles(dem(), force));
  EXPECT_EQ(files_in(o.output), wanted);
  edit([](ordered_json& j) { j["gzip"] = true; });
  expect_refused(o, "other options");
  write(record, "{");
  expect_refused(o, "damaged record");
  ASSERT_TRUE(build_tiles(dem(), force));
  EXPECT_EQ(files_in(o.output), wanted);
  // As tind made them before there were ledgers.
  edit([](ordered_json& j) { j["format"] = 2; });
  fs::remove(folder_.path() / "tiles/tind-tiles.ledger");
  expect_refused(o, "kept no ledger");
  expect_refused(force, "cannot tell which of them are tind's");
}

// ---- what only looks like an update's ----

/// A folder of a build in its own, links and files of others beside it.
TEST_F(BuildFolderTest, an_update_moves_in_only_where_it_is_proven_ours) {
  const BuildOptions o = options();
  BuildOptions force = o;
  force.force = true;
  const fs::path root = folder_.path(), tiles = o.output, ready = tiles / "tind-update-ready";
  build("other");
  const auto refused = [&](const std::string& why) {
    for (const BuildOptions& options : {o, force})
      for (const float lift : {0.f, 40.f}) {
        const Files before = files_in(root);
        expect_refused(options, why, lift);
        EXPECT_EQ(files_in(root), before) << why;
      }
    fs::remove_all(tiles);
  };
  // No build's folder.
  write(tiles / "layer.json", "mine");
  write(tiles / "0/0/0.terrain", "mine");
  write(ready / "layer.json", "another");
  write(ready / "0/0/0.terrain", "another");
  refused("tind-update-ready/0/0/0.terrain is in the way");
  // A link on the way, out of the folder.
  write(root / "out/0/0.terrain", "mine");
  fs::create_directories(tiles);
  fs::create_directory_symlink(root / "out", tiles / "0");
  write(ready / "0/0/0.terrain", "another");
  refused("tind-update-ready/0/0/0.terrain is in the way");
  // The same where record and ledger are there.
  build();
  fs::remove_all(tiles / "0");
  fs::create_directory_symlink(root / "out", tiles / "0");
  fs::copy(root / "other", ready, fs::copy_options::recursive);
  refused("tiles/0 is in the place of a folder of tiles");
  EXPECT_EQ(bytes_of(root / "out/0/0.terrain"), "mine");
  // A link to a whole tile set.
  build();
  fs::create_directory_symlink(root / "other", ready);
  refused("tind-update-ready is in the way");
  // A tile set of other options.
  build();
  BuildOptions coarse = options("coarse");
  coarse.tiles.max_error_m = 20;
  ASSERT_TRUE(build_tiles(dem(), coarse));
  fs::copy(root / "coarse", ready, fs::copy_options::recursive);
  refused("is in the way");
  // In a finished folder: files without a record; a tile that the ledger does not name; others.
  for (const char* folder : {"tind-update", "tind-update-ready"}) {
    build();
    write(tiles / folder / "layer.json", "mine");
    write(tiles / folder / "5/3/2.terrain", "mine");
    refused("is in the way");
    for (const char* file : {"25/3/2.terrain", "notes.txt", "photos/0.jpg"}) {
      build();
      fs::copy(root / "other", tiles / folder, fs::copy_options::recursive);
      write(tiles / folder / file, "mine");
      refused("is in the way");
    }
  }
}

TEST_F(BuildFolderTest, files_of_others_under_the_names_of_blocks_and_half_written_ones_stay) {
  const BuildOptions o = options();
  BuildOptions force = o;
  force.force = true;
  const fs::path tiles = o.output;
  build();
  std::string blocks;
  for (const auto& [name, bytes] : files_in(tiles))
    if (name.starts_with("tind-blocks-")) blocks = name;
  const auto refused = [&](const std::string& why) {
    for (const BuildOptions& options : {o, force}) expect_refused(options, why);
    EXPECT_EQ(fs::exists(tiles / "tind-partial"), why.starts_with("tind-partial")) << why;
    fs::remove_all(tiles);
  };
  fs::remove_all(tiles);
  write(tiles / blocks, "mine");
  refused(blocks);
  fs::create_directories(tiles / blocks);
  refused(blocks);
  write(tiles / "mine", "mine");
  fs::create_symlink("mine", tiles / blocks);
  refused(blocks);
  const std::string partial = "tind-partial/0000000000000000";
  write(tiles / partial, "mine");
  refused(partial);
  fs::create_directories(tiles / partial);
  refused(partial);
  // Where a build was killed, a folder is still no file of its own.
  write(tiles / "tind-lock", kLeftLock);
  fs::create_directories(tiles / partial);
  const auto report = build_tiles(dem(), o);
  ASSERT_FALSE(report);
  EXPECT_EQ(report.error().code, Errc::invalid_argument);
  EXPECT_TRUE(fs::exists(tiles / partial));
}

TEST_F(BuildFolderTest, damaged_blocks_are_named_by_check_and_mended_by_a_resume) {
  build();
  const fs::path tiles = folder_.path() / "tiles";
  const Files wanted = files_in(tiles);
  std::string blocks;
  for (const auto& [name, bytes] : wanted)
    if (name.starts_with("tind-blocks-")) blocks = name;
  std::size_t r = 0;
  while (kCheckRules[r].id != "build.blocks") ++r;
  const auto found = [&] {
    const auto report = check_tiles(tiles.string(), {});
    EXPECT_TRUE(report);
    return report->findings[r].count;
  };
  EXPECT_EQ(found(), 0u);
  for (const auto& [what, spoil] : faults()) {
    spoil(tiles / blocks);
    EXPECT_EQ(found(), 1u) << what;
    const BuildReport again = build();
    EXPECT_EQ(again.built, 0u) << what;
    EXPECT_EQ(files_in(tiles), wanted) << what;
    EXPECT_EQ(found(), 0u) << what;
  }
  EXPECT_TRUE(build("tiles", 40).update.updated);
}

// ---- two builds ----

TEST_F(BuildFolderTest, one_build_at_a_time) {
  const BuildOptions o = options();
  fs::create_directories(o.output);
  {
    const auto held = FolderLock::take(o.output);
    ASSERT_TRUE(held) << held.error().what;
    const Files before = files_in(o.output);
    const auto second = build_tiles(dem(), o);
    ASSERT_FALSE(second);
    EXPECT_EQ(second.error().code, Errc::busy);
    EXPECT_THAT(second.error().what, HasSubstr("process " + std::to_string(::getpid()) + " on "));
    EXPECT_EQ(files_in(o.output), before);
  }
  EXPECT_FALSE(fs::exists(o.output + "/tind-lock"));
  // What builds that were killed left: a lock that nobody holds, and what they had begun to write.
  write(o.output + "/tind-lock", kLeftLock);
  write(o.output + "/tind-partial/0123456789abcdef", "half a tile");
  build();
  EXPECT_FALSE(fs::exists(o.output + "/tind-lock"));
  EXPECT_FALSE(fs::exists(o.output + "/tind-partial"));
}

/// What changes after the last tile was read is no reason to say that all went well.
TEST(BuildOfAFile, that_changes_before_the_end_ends_with_an_error) {
  const TempDir dir;
  const std::string file = dir.file("a.asc");
  test::write_flat_dem(file, 100);
  const std::string files[] = {file};
  auto source = DemSource::open(files, {});
  ASSERT_TRUE(source.has_value()) << source.error().what;
  BuildOptions o;
  o.output = dir.file("tiles");
  o.tiles.last_level = 2;
  const auto change_it = [&](double share) {
    if (share > 0.99) test::write_flat_dem(file, 200);
  };
  const std::shared_ptr<const DemSource> dem = std::move(*source);
  const auto built = build_tiles(dem, o, {.report = change_it, .stop = {}});
  ASSERT_FALSE(built.has_value());
  EXPECT_EQ(built.error().code, Errc::io);
  EXPECT_THAT(built.error().what, HasSubstr("a.asc: was replaced by another"));
  EXPECT_FALSE(fs::exists(o.output + "/layer.json"));
}

}  // namespace
}  // namespace tind
