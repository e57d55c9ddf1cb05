// tind elevation as its users run it: places of the line and of tables, what is refused, and that
// no half table stays.

#include <gtest/gtest.h>
#include <sys/stat.h>

#include <filesystem>
#include <fstream>
#include <string>

#include "terrain/base/file_io.h"
#include "tests/support/program_json.h"

namespace tind {
namespace {

using test::run_tind;

class Elevation : public ::testing::Test {
 protected:
  const test::TempDir folder_;
  const std::string dem_ = test::testdata("rainier.tif");

  std::string table(const std::string& content) {
    std::ofstream(folder_.file("in.csv")) << content;
    return folder_.file("in.csv");
  }
};

TEST_F(Elevation, OfPlacesOnTheLine) {
  const auto json = test::tind_json("elevation " + dem_ + " --at=-121.76,46.85 --at 0,0 --json");
  EXPECT_EQ(json["datum"], "egm96");
  ASSERT_EQ(json["places"].size(), 2u);
  EXPECT_NEAR(double(json["places"][0]["height_m"]), 4317, 1);
  EXPECT_EQ(json["places"][1]["coverage"], "outside");
  EXPECT_TRUE(json["places"][1]["height_m"].is_null());
  const auto east =
      test::tind_json("elevation " + dem_ + " --at 594538,5189400 --places-crs EPSG:32610 --json");
  EXPECT_NEAR(double(east["places"][0]["lon"]), -121.76, 0.01);
  EXPECT_NE(run_tind("elevation " + dem_ + " --at=-121.76,46.85").answer.find("m above egm96"),
            std::string::npos);
}

TEST_F(Elevation, OfATableItIsTheTableWithHeights) {
  const std::string in =
      table("\xef\xbb\xbfname,lat,lon\r\n\"a, b\",46.85,-121.76\r\n\r\nsea,0,0\r\n");
  const std::string right =
      "name,lat,lon,height_m,coverage\n\"a, b\",46.85,-121.76,4317.0,value\nsea,0,0,,outside\n";
  EXPECT_EQ(run_tind("elevation " + dem_ + " --places " + in).answer, right);
  EXPECT_EQ(run_tind("elevation " + dem_ + " --places - < " + in).answer, right);
  const std::string out = folder_.file("out.csv");
  const auto ran = run_tind("elevation " + dem_ + " --places " + in + " -o " + out);
  EXPECT_EQ(ran.answer, out + ": 2 places, 1 without height; above egm96\n");
  EXPECT_EQ(*read_whole_file(out), right);
}

TEST_F(Elevation, WhatIsAddedStandsInItsOwnColumns) {
  const std::string in = table("lon,lat,note\n-121.76,46.85\n-121.76,46.85,a\n");
  EXPECT_EQ(run_tind("elevation " + dem_ + " --places " + in).answer,
            "lon,lat,note,height_m,coverage\n-121.76,46.85,,4317.0,value\n"
            "-121.76,46.85,a,4317.0,value\n");
  for (const auto& [wrong, why] :
       {std::pair{"lon,lat\n-121.76,46.85,a\n", "line 2 has more fields than the first line"},
        std::pair{"lon,lat,height_m\n-121.76,46.85,4\n", "line 1 has a column height_m already"},
        std::pair{"lon,lat,longitude\n-121.76,46.85,-121.7\n",
                  "line 1 names one coordinate twice, as lon and as longitude"},
        std::pair{"x,y,lon\n-121.76,46.85,-121.7\n",
                  "line 1 names one coordinate twice, as x and as lon"}}) {
    const auto ran = run_tind("elevation " + dem_ + " --places " + table(wrong));
    EXPECT_EQ(ran.code, 65);
    EXPECT_NE(ran.out.find(why), std::string::npos) << ran.out;
  }
}

TEST_F(Elevation, OfTwoPairsOfColumnsTheOneInTheSystemCounts) {
  const std::string in = table("x,y,lon,lat\n594538,5189400,-121.76,46.85\n");
  const std::string line = "594538,5189400,-121.76,46.85,";
  const auto degrees = run_tind("elevation " + dem_ + " --places " + in);
  EXPECT_NE(degrees.answer.find(line + "4317.0,value"), std::string::npos) << degrees.out;
  const auto metres =
      run_tind("elevation " + dem_ + " --places " + in + " --places-crs EPSG:32610");
  EXPECT_NE(metres.answer.find(",value\n"), std::string::npos) << metres.out;
}

TEST_F(Elevation, ALongTableIsReadInPartsAndStaysInOrder) {
  std::string content = "x,y\n";
  for (int i = 0; i < 150'000; ++i)
    content += std::to_string(-121.9 + 0.3 * i / 150'000) + ",46.85\n";
  const std::string out = folder_.file("out.csv");
  ASSERT_EQ(run_tind("elevation " + dem_ + " --places " + table(content) + " -o " + out).code, 0);
  std::ifstream in(out);
  std::string line;
  std::getline(in, line);
  for (int i = 0; i < 150'000; ++i) {
    std::getline(in, line);
    const std::string x = std::to_string(-121.9 + 0.3 * i / 150'000);
    ASSERT_TRUE(line.starts_with(x + ",46.85,")) << line;
  }
}

TEST_F(Elevation, ShortLinesBelowALongHeadTakeNoMemory) {
  const auto short_lines = [&](int count) {
    std::string content = "x,y" + std::string(100'000, ',') + '\n';
    for (int i = 0; i < count; ++i) content += "-121.76,46.85," + std::to_string(i) + '\n';
    return table(content);
  };
  std::string right = "x,y" + std::string(100'000, ',') + ",height_m,coverage\n";
  for (int i = 0; i < 400; ++i)  // 40 MB: several parts
    right += "-121.76,46.85," + std::to_string(i) + std::string(100'000, ',') + "4317.0,value\n";
  EXPECT_TRUE(run_tind("elevation " + dem_ + " --places " + short_lines(400)).answer == right);
  if (test::kSanitized) GTEST_SKIP() << "memory is the sanitizer's";
  const auto ran = run_tind("elevation " + dem_ + " --places " + short_lines(2500) + " >/dev/null",
                            "ulimit -v 600000;");  // of 250 MB, twice
  EXPECT_EQ(ran.code, 0) << ran.out;
}

TEST_F(Elevation, WhatIsWrongNamesItsLineAndLeavesNoTable) {
  const std::string out = folder_.file("out.csv");
  const auto code = [&](const std::string& content) {
    return run_tind("elevation " + dem_ + " --places " + table(content) + " -o " + out);
  };
  EXPECT_EQ(code("a,b\n1,2\n").code, 65);
  EXPECT_EQ(code("").code, 65);
  const auto bad = code("x,y\n-121.76,46.85\n-121.76,high\n");
  EXPECT_EQ(bad.code, 65);
  EXPECT_NE(bad.out.find("line 3 has no two coordinates"), std::string::npos) << bad.out;
  const auto broken = code("x,y,name\n-121.76,46.85,\"of two\n-121.7,46.8,lines\"\n");
  EXPECT_EQ(broken.code, 65);
  EXPECT_NE(broken.out.find("line 2 has a quote that does not end"), std::string::npos);
  EXPECT_NE(code("x,y,\"name\n-121.76,46.85,a\n").out.find("line 1 has a quote"),
            std::string::npos);
  const auto far = code("x,y\n-121.76,46.85\n-121.76,95\n");
  EXPECT_EQ(far.code, 2);
  EXPECT_NE(far.out.find("line 3"), std::string::npos) << far.out;
  EXPECT_FALSE(std::filesystem::exists(out));
  EXPECT_EQ(run_tind("elevation " + dem_ + " --places /nowhere.csv").code, 69);
  for (const char* line : {" --at 1,2 -o x.csv", " --places a.csv --json"})  // of no effect
    EXPECT_EQ(run_tind("elevation " + dem_ + line).code, 2) << line;
  for (const char* line : {"", " --at 1", " --at 1,2 --places a.csv", " --at 1,95"})
    EXPECT_EQ(run_tind("elevation " + dem_ + line).code, 2) << line;
  EXPECT_EQ(run_tind("elevation --at 1,2").code, 2);
}

TEST_F(Elevation, AnOutputIsReplacedWhenTheNewOneIsWhole) {
  const std::string good = table("x,y\n-121.76,46.85\n"), out = folder_.file("out.csv");
  const std::string bad = folder_.file("bad.csv"), link = folder_.file("link.csv");
  std::ofstream(bad) << "x,y\n-121.76,46.85\n-121.76,high\n";
  ASSERT_EQ(run_tind("elevation " + dem_ + " --places " + good + " -o " + out).code, 0);
  const std::string before = read_whole_file(out).value();
  std::filesystem::create_symlink(out, link);
  for (const std::string& to : {out, link}) {
    EXPECT_EQ(run_tind("elevation " + dem_ + " --places " + bad + " -o " + to).code, 65);
    EXPECT_EQ(read_whole_file(to).value_or(""), before) << to;
  }
  EXPECT_TRUE(std::filesystem::is_symlink(link));

  const std::string pipe = folder_.file("pipe"), log = folder_.file("log");
  ASSERT_EQ(::mkfifo(pipe.c_str(), 0600), 0);
  EXPECT_EQ(run_tind("elevation " + dem_ + " --places " + bad + " -o " + pipe + " & cat " + pipe +
                         " >/dev/null; wait $!; }",
                     "{")
                .code,
            65);
  EXPECT_TRUE(std::filesystem::is_fifo(pipe)) << "what is not ours is not removed";
  std::ofstream(log) << "begins\n";
  EXPECT_EQ(run_tind("elevation " + dem_ + " --places " + good + " -o - >> " + log).code, 0);
  EXPECT_EQ(read_whole_file(log).value_or(""), "begins\n" + before);
}

}  // namespace
}  // namespace tind
