// DEMs that processes of their own read: the same heights, and nothing worse than an error when a
// raster gets the better of its decoder.

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/resource.h>
#include <unistd.h>

#include <atomic>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <random>
#include <thread>

#include "terrain/raster/gdal/heights/apart_file.h"
#include "terrain/raster/gdal/heights/file_wire.h"
#include "terrain/raster/gdal/heights/gdal_file.h"
#include "terrain/raster/gdal/heights/source_pool.h"
#include "terrain/raster/sandboxed_pool.h"
#include "tests/support/program.h"
#include "tests/support/support.h"

namespace tind {
namespace {

namespace fs = std::filesystem;
using namespace std::chrono_literals;
using testing::HasSubstr;

sandbox::TeamOptions real(std::size_t most = 4) {
  return {.command = {test::tind_binary(), kDecoderArgument},
          .nursery = {test::tind_binary(), kNurseryArgument},
          .most = most};
}

/// One that does as sandbox/planted_decoder.cc has it.
sandbox::TeamOptions planted(const std::string& how) {
  auto options = real();
  options.command = {TIND_PLANTED_DECODER, how};
  options.nursery.clear();
  options.first_pause = options.last_pause = std::chrono::hours(1);
  return options;
}

std::shared_ptr<SourcePool> pool_of(sandbox::TeamOptions options,
                                    const SourcePool::Limits& limits = {}) {
  return sandboxed_pool(limits, std::move(options));
}

std::size_t running(const std::shared_ptr<SourcePool>& pool) {
  return std::static_pointer_cast<gdal::Pool>(pool)->team->running();
}

Result<std::shared_ptr<const DemSource>> open(const std::string& path, DemOptions options) {
  return DemSource::open(std::vector{path}, options);
}

bool same(const HeightGrid& a, const HeightGrid& b) {
  return a.size() == b.size() &&
         std::memcmp(a.values().data(), b.values().data(), a.size() * sizeof(float)) == 0;
}

/// Both refuse, for the same reason.
void expect_same_error(const std::string& path, DemOptions options = {}) {
  const auto here = open(path, options);
  options.pool = pool_of(real());
  const auto apart = open(path, options);
  ASSERT_FALSE(here) << path;
  ASSERT_FALSE(apart) << path;
  EXPECT_EQ(apart.error().what, here.error().what);
  EXPECT_EQ(int(apart.error().code), int(here.error().code)) << here.error().what;
}

/// Ours of that name that have not ended.
std::vector<pid_t> children(const std::string& name) {
  std::vector<pid_t> found;
  for (const auto& entry : fs::directory_iterator("/proc")) {
    const std::string number = entry.path().filename().string();
    if (number.find_first_not_of("0123456789") != number.npos) continue;
    std::ifstream in(entry.path() / "stat");
    std::string pid, called, state;
    pid_t parent = 0;
    in >> pid >> called >> state >> parent;
    if (parent == ::getpid() && called == "(" + name + ")" && state != "Z")
      found.push_back(std::stoi(number));
  }
  return found;
}

TEST(Nursery, IsReplacedWhereItWasKilledAndEndsWithThePool) {
  {
    const auto pool = pool_of(real());
    const auto first = open(test::testdata("rainier.tif"), {.pool = pool});
    ASSERT_TRUE(first) << first.error().what;
    const auto before = children("tind-nursery");
    ASSERT_EQ(before.size(), 1u);
    EXPECT_EQ(children("tind-decoder").size(), running(pool));
    ASSERT_EQ(::kill(before[0], SIGKILL), 0);
    const auto second = open(test::testdata("crater.tif"), {.pool = pool});
    ASSERT_TRUE(second) << second.error().what;
    const auto after = children("tind-nursery");
    ASSERT_EQ(after.size(), 1u);
    EXPECT_NE(after, before);
    EXPECT_TRUE((*first)->read(0, 0, 10, 10)) << "its decoders live on";
  }
  for (int look = 0; look < 500 && !children("tind-decoder").empty(); ++look)
    std::this_thread::sleep_for(10ms);
  EXPECT_TRUE(children("tind-nursery").empty());
  EXPECT_TRUE(children("tind-decoder").empty());
}

TEST(Sandbox, ItsProcessesHaveTheirLimits) {
  const auto dem = open(test::testdata("crater.tif"), {.pool = pool_of(real())});
  ASSERT_TRUE(dem) << dem.error().what;
  const auto processes = children("tind-decoder");
  ASSERT_FALSE(processes.empty());
  for (const pid_t process : processes) {
    const auto most = [&](auto what) {
      rlimit now{};
      EXPECT_EQ(::prlimit(process, what, nullptr, &now), 0);
      EXPECT_EQ(now.rlim_cur, now.rlim_max);
      return now.rlim_max;
    };
    EXPECT_EQ(most(RLIMIT_CORE), 0u);
    EXPECT_EQ(most(RLIMIT_FSIZE), 0u);
    EXPECT_EQ(most(RLIMIT_NPROC), 0u);
    EXPECT_LE(most(RLIMIT_NOFILE), 256u);
    EXPECT_LE(most(RLIMIT_CPU), 3600u);
    if (!test::kSanitized) {
      EXPECT_LE(most(RLIMIT_AS), 2ul << 30);
    }
  }
}

TEST(Sandbox, NothingIsOtherwiseThanWithout) {
  const auto pool = pool_of(real());
  for (const char* name : {"rainier.tif", "crater.tif", "bigtujunga_crop.tif", "desert.asc"}) {
    const auto here = open(test::testdata(name), {});
    const auto apart = open(test::testdata(name), {.pool = pool});
    ASSERT_TRUE(here) << here.error().what;
    ASSERT_TRUE(apart) << apart.error().what;
    const DemInfo &a = (*here)->info(), &b = (*apart)->info();
    // PROJ words a CRS by what it was asked before, so the fingerprint is that of a process which
    // opened nothing else.
    EXPECT_THAT(test::run_tind("info --json '" + test::testdata(name) + "'").answer,
                HasSubstr(b.fingerprint));
    EXPECT_EQ(a.crs_name, b.crs_name);
    EXPECT_EQ(a.bounds, b.bounds);
    EXPECT_EQ(a.warnings, b.warnings);
    EXPECT_EQ(a.rounding_m, b.rounding_m);
    EXPECT_EQ(a.driver, b.driver);
    const int cols = int(a.cols), rows = int(a.rows);
    EXPECT_TRUE(same(*(*here)->read(-1, -1, cols + 2, rows + 2),
                     *(*apart)->read(-1, -1, cols + 2, rows + 2)));
    EXPECT_TRUE(
        same(*(*here)->read_decimated(3, 5, 5, 6, 64), *(*apart)->read_decimated(3, 5, 5, 6, 64)));
    const auto undeclared = (*here)->undeclared_nodata();
    const auto found = (*apart)->undeclared_nodata();
    ASSERT_EQ(undeclared.size(), found.size());
    for (std::size_t i = 0; i < found.size(); ++i)
      EXPECT_EQ(undeclared[i].posts, found[i].posts) << name;
  }
}

TEST(Sandbox, OptionsReachTheProcess) {
  const auto pool = pool_of(real());
  DemOptions options{.nodata = {0, 1500}, .crs = "EPSG:32633", .scale = 2.5, .offset = -3};
  options.keep_source_units = true;
  const std::string path = test::testdata("bigtujunga_crop.tif");
  const auto here = open(path, options);
  options.pool = pool;
  const auto apart = open(path, options);
  ASSERT_TRUE(here) << here.error().what;
  ASSERT_TRUE(apart) << apart.error().what;
  EXPECT_EQ((*here)->info().crs_name, (*apart)->info().crs_name);
  EXPECT_EQ((*here)->info().warnings, (*apart)->info().warnings);
  EXPECT_EQ((*here)->info().nodata_said, (*apart)->info().nodata_said);
  EXPECT_TRUE(same(*(*here)->read(0, 0, 200, 200), *(*apart)->read(0, 0, 200, 200)));
}

void write(const std::string& path, const std::string& bytes) {
  std::ofstream(path, std::ios::binary) << bytes;
}

TEST(Sandbox, ErrorsAreTheSameErrors) {
  const test::TempDir folder;
  expect_same_error(folder.file("nothing.tif"));
  expect_same_error("/dev/null");
  write(folder.file("words.tif"), "no raster at all");
  expect_same_error(folder.file("words.tif"));
  expect_same_error(test::testdata("rainier.tif"), {.band = 7});
}

std::string raw_vrt(const std::string& of) {
  return "<VRTDataset rasterXSize=\"16\" rasterYSize=\"16\"><VRTRasterBand dataType=\"Byte\" "
         "band=\"1\" subClass=\"VRTRawRasterBand\"><SourceFilename relativeToVRT=\"0\">" +
         of +
         "</SourceFilename><ImageOffset>0</ImageOffset><PixelOffset>1</PixelOffset>"
         "<LineOffset>16</LineOffset></VRTRasterBand></VRTDataset>";
}

TEST(Sandbox, RastersThatAreOthersInDisguiseAreRefused) {
  const test::TempDir folder;
  write(folder.file("evil.tif"), raw_vrt("/etc/passwd"));
  expect_same_error(folder.file("evil.tif"));
  write(folder.file("mrf.tif"), "<MRF_META><Raster><Size x=\"512\" y=\"512\"/><DataFile>" +
                                    folder.file("made") + "</DataFile><IndexFile>" +
                                    folder.file("index") + "</IndexFile></Raster></MRF_META>");
  expect_same_error(folder.file("mrf.tif"));
  expect_same_error(folder.file("mrf.tif"), {.allow_vrt = true});
  EXPECT_FALSE(fs::exists(folder.file("made")));
  EXPECT_FALSE(fs::exists(folder.file("index")));
}

/// What became of one, and that only it did.
class Misbehaved : public testing::TestWithParam<const char*> {};

TEST_P(Misbehaved, CostsAnErrorThatNamesTheFile) {
  if (test::kSanitized && GetParam() == std::string("bloats"))
    GTEST_SKIP() << "sanitizers take terabytes of addresses";
  const test::TempDir folder;
  const std::string path = folder.file("crater.tif");
  fs::copy(test::testdata("bigtujunga_crop.tif"), path);
  auto options = planted(GetParam());
  if (GetParam() == std::string("spins")) options.read.cpu = 200ms;
  if (GetParam() == std::string("sleeps")) options.read.wall = 2000ms;
  const auto pool = pool_of(options);
  const std::uint64_t failed = sandbox::decoders_failed();
  const auto dem = open(path, {.pool = pool});
  const auto got = dem ? (*dem)->read(0, 0, 40, 40) : std::unexpected(dem.error());
  ASSERT_FALSE(got);
  EXPECT_EQ(got.error().code, Errc::io) << got.error().what;
  EXPECT_THAT(got.error().what, HasSubstr(path));
  EXPECT_THAT(got.error().what, HasSubstr("process"));
  EXPECT_EQ(running(pool), 0u);  // it is gone
  EXPECT_EQ(sandbox::decoders_failed(), failed + 1);
  if (GetParam() == std::string("bloats")) {
    EXPECT_TRUE(sandbox::says_crash(got.error())) << got.error().what;
  }
  if (!dem) return;
  const auto again = (*dem)->read(0, 0, 40, 40);  // not begun again for the same place so soon
  ASSERT_FALSE(again);
  EXPECT_THAT(again.error().what, HasSubstr("tried again"));
  EXPECT_EQ(running(pool), 0u);
}

INSTANTIATE_TEST_SUITE_P(Sandbox, Misbehaved,
                         testing::Values("never begins", "crashes at once", "says too little",
                                         "says too much", "names another driver",
                                         "names another file", "names a pipeline", "has no columns",
                                         "crashes", "ends", "spins", "sleeps", "bloats",
                                         "answers half", "answers twice as much",
                                         "answers another question", "has a status of its own",
                                         "has a lot to say", "complains at length",
                                         "counts too much", "has infinite heights"));

TEST(Sandbox, MemoryThatBothSeeCannotBeTakenAway) {
  const auto dem =
      open(test::testdata("crater.tif"), {.pool = pool_of(planted("shrinks the memory"))});
  ASSERT_TRUE(dem) << dem.error().what;
  const auto got = (*dem)->read(0, 0, 40, 40);
  ASSERT_TRUE(got) << got.error().what;  // the kernel refused it, and it went on
}

TEST(Sandbox, APlaceThatCrashesLeavesTheOthersAlone) {
  const auto pool = pool_of(planted("crashes in the east"));
  const auto dem = open(test::testdata("rainier.tif"), {.pool = pool});
  ASSERT_TRUE(dem) << dem.error().what;
  const auto whole = open(test::testdata("rainier.tif"), {});
  for (int round = 0; round < 2; ++round) {
    EXPECT_FALSE((*dem)->read(300, 0, 20, 20));
    const auto west = (*dem)->read(0, 256 * round, 20, 20);
    ASSERT_TRUE(west) << west.error().what;
    EXPECT_TRUE(same(*west, *(*whole)->read(0, 256 * round, 20, 20)));
  }
}

TEST(Sandbox, AProcessThatDiedWhileIdleIsReplaced) {
  auto team = std::make_shared<sandbox::Team>(real());
  const std::vector files{test::testdata("rainier.tif")};
  const auto crew = gdal::Crew::of(team, files, {});
  auto file = gdal::ApartFile::open(crew, 0);
  ASSERT_TRUE(file) << file.error().what;
  auto decoder = crew->take();
  ASSERT_TRUE(decoder);
  const sandbox::Decoder& first = **decoder;
  crew->give(std::move(*decoder));
  ::kill(first.process(), SIGKILL);
  while (first.alive()) std::this_thread::sleep_for(1ms);
  std::vector<double> heights(100);
  const auto read = (*file)->read(0, 0, 10, 10, heights);
  EXPECT_TRUE(read) << read.error().what;
  EXPECT_EQ(team->running(), 1u);
}

TEST(Sandbox, AChangedFileIsSeen) {
  const test::TempDir folder;
  fs::copy(test::testdata("crater.tif"), folder.file("a.tif"));
  const auto dem = open(folder.file("a.tif"), {.pool = pool_of(real())});
  ASSERT_TRUE(dem) << dem.error().what;
  ASSERT_TRUE((*dem)->unchanged());
  fs::remove(folder.file("a.tif"));
  fs::copy(test::testdata("desert.asc"), folder.file("a.tif"));
  const auto got = (*dem)->read(0, 0, 10, 10);
  ASSERT_FALSE(got);
  EXPECT_EQ(got.error().code, Errc::io);
  EXPECT_FALSE((*dem)->unchanged());
}

TEST(Sandbox, AMaskThatComesIsSeen) {
  const test::TempDir folder;
  const std::string path = folder.file("a.tif");
  fs::copy_file(test::testdata("crater.tif"), path);
  const auto dem = open(path, {.cache_bytes = 1, .pool = pool_of(real())});
  ASSERT_TRUE(dem) << dem.error().what;
  ASSERT_TRUE((*dem)->read(0, 0, 10, 10));
  fs::copy_file(path, path + ".msk");
  EXPECT_FALSE((*dem)->unchanged());
  const auto masked = (*dem)->read(0, 400, 10, 10);
  ASSERT_FALSE(masked);
  EXPECT_NE(masked.error().what.find("a.tif.msk: was put beside"), std::string::npos)
      << masked.error().what;
}

TEST(Sandbox, OneBoundOfProcessesForAllDems) {
  const test::TempDir folder;
  const auto pool = pool_of(real(2), {.heights_bytes = 1});
  std::vector<std::shared_ptr<const DemSource>> dems;
  for (int i = 0; i < 4; ++i) {
    const std::string path = folder.file(std::to_string(i) + ".asc");
    std::ofstream out(path);
    out << "ncols 20\nnrows 20\nxllcenter 10\nyllcenter 46\ncellsize 0.01\n";
    for (int k = 0; k < 400; ++k) out << i << ' ';
    out.close();
    auto dem = open(path, {.pool = pool});
    ASSERT_TRUE(dem) << dem.error().what;
    dems.push_back(std::move(*dem));
    EXPECT_LE(running(pool), 2u);
  }
  std::atomic<int> wrong = 0;
  {
    std::vector<std::jthread> readers;
    for (int t = 0; t < 3; ++t)
      readers.emplace_back([&, t] {
        for (int k = 0; k < 6; ++k) {
          const int i = (t + k) % 4;
          const auto got = dems[std::size_t(i)]->read(0, 0, 20, 20);
          if (!got || got->at(7, 7) != float(i) || running(pool) > 2) ++wrong;
        }
      });
  }
  EXPECT_EQ(wrong, 0);
  dems.clear();
  EXPECT_EQ(running(pool), 0u);
}

TEST(Sandbox, NoBytesAreTakenForAFileThatCannotBe) {
  const std::string path = test::testdata("bigtujunga_crop.tif");
  const auto file =
      gdal::RasterFile::open(path, {}, std::make_shared<gdal::IdleHandles>(std::size_t(0), 1));
  ASSERT_TRUE(file) << file.error().what;
  const std::string text = gdal::opened_text(**file);
  const auto whole = gdal::read_opened(text, path, {});
  ASSERT_TRUE(whole);
  ASSERT_FALSE(whole->facts.crs.wkt.empty());
  EXPECT_EQ(whole->facts.crs.wkt, (*file)->facts().crs.wkt);
  for (std::size_t size = 0; size < text.size(); ++size)
    EXPECT_FALSE(gdal::read_opened(text.substr(0, size), path, {}));
  std::mt19937 random(19);
  int taken = 0;
  for (int i = 0; i < 20000; ++i) {
    std::string other = text;
    for (unsigned k = 0; k <= random() % 3; ++k) other[random() % other.size()] = char(random());
    const auto got = gdal::read_opened(other, path, {});
    if (!got) continue;
    ++taken;
    const gdal::FileFacts& facts = got->facts;
    ASSERT_TRUE(facts.cols > 0 && facts.rows > 0 && facts.cols <= 1 << 30);
    ASSERT_TRUE(std::isfinite(facts.post_to_crs.x_col) && std::isfinite(facts.z_unit_m));
    for (const auto& entry : got->states) ASSERT_TRUE(gdal::belongs_to(path, entry.path));
  }
  EXPECT_GT(taken, 0);
}

TEST(Sandbox, WhatBelongsToARasterHasItsName) {
  EXPECT_TRUE(gdal::belongs_to("/a/b.tif", "/a/b.tif"));
  EXPECT_TRUE(gdal::belongs_to("/a/b.tif", "/a/b.tif.ovr"));
  EXPECT_TRUE(gdal::belongs_to("/a/B.TIF", "/a/b.tfw"));
  EXPECT_FALSE(gdal::belongs_to("/a/b.tif", "/a/bc.tif"));
  EXPECT_FALSE(gdal::belongs_to("/a/b.tif", "/etc/b.tif"));
  EXPECT_FALSE(gdal::belongs_to("/a/b.tif", "/a/../etc/b.tif"));
  EXPECT_FALSE(gdal::belongs_to("/a/b.tif", "/a/b/c.tif"));
  const test::TempDir folder;
  for (const char* name : {"b.tif", "b.tfw", "b.TIF.ovr", "c.tif", "bb.tif"})
    write(folder.file(name), "");
  const std::vector rasters{folder.file("b.tif"), folder.file("c.tif")};
  const auto found = gdal::files_of_rasters(rasters);
  ASSERT_TRUE(found);
  EXPECT_THAT(*found, testing::UnorderedElementsAre(folder.file("b.tif"), folder.file("b.tif"),
                                                    folder.file("b.tfw"), folder.file("b.TIF.ovr"),
                                                    folder.file("c.tif"), folder.file("c.tif")));
  EXPECT_TRUE(gdal::files_of_rasters(std::vector{folder.file("none/b.tif")}));
  EXPECT_TRUE(gdal::files_of_rasters(std::vector{folder.file("b.tif/b.tif")}));
  const std::string round = folder.file("round");  // a folder that nobody can look into
  std::filesystem::create_symlink(round, round);
  EXPECT_FALSE(gdal::files_of_rasters(std::vector{round + "/b.tif"}));
}

}  // namespace
}  // namespace tind
