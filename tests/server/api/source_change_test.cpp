// A DEM that changes while it is served: every answer is of the content that was opened, or 503.

#include <spdlog/spdlog.h>

#include <atomic>
#include <random>
#include <thread>

#include "proto/tile/quantized_mesh.h"
#include "tests/server/api/api_fixture.h"
#include "tests/support/srtm.h"

namespace tind::api {
namespace {

namespace fs = std::filesystem;

void move_another_over(const std::string& path) {
  test::write_bytes(path + ".new", test::srtm(222));
  fs::rename(path + ".new", path);
}

bool all_at(const HttpReply& tile, double height) {
  const auto mesh =
      proto::decode({reinterpret_cast<const std::uint8_t*>(tile.body.data()), tile.body.size()});
  if (!mesh) return false;
  const double step = (double(mesh->max_height) - mesh->min_height) / 32767;
  return std::ranges::all_of(mesh->h, [&](std::uint16_t h) {
    return std::abs(mesh->min_height + h * step - height) < 1e-3;
  });
}

struct Answers {
  std::atomic<int> right = 0, refused = 0, wrong = 0;
  void count(int status, bool is_right) {
    ++(status == 503 ? refused : status == 200 && is_right ? right : wrong);
  }
};

class ApiChange : public Api, public ::testing::WithParamInterface<int> {};

TEST_P(ApiChange, IsRefusedAndNeverMixed) {
  spdlog::set_level(spdlog::level::off);
  const test::TempDir folder;
  const std::string path = folder.file("N46E007.hgt");
  test::write_bytes(path, test::srtm(111));
  // Of the heights one block is kept: what is asked for is read.
  ASSERT_TRUE(services::open_dataset(catalog_, {"dem", {path}}, {.cache_bytes = 1}, {}));
  Answers elevations, tiles;
  std::atomic<bool> changed = false;
  const std::uint16_t at = port();
  const auto ask = [&](unsigned seed) {
    std::mt19937 random(seed);
    const auto share = [&] { return double(random() % 1000) / 1001; };
    for (int after = 0; after < 60; after += changed) {
      const std::string place =
          fmt::format("lon={}&lat={}", 7.0005 + 0.999 * share(), 46.0005 + 0.999 * share());
      const auto elevation = HttpClient(at).get("/elevation/dem?" + place);
      elevations.count(
          elevation.status,
          elevation.status == 200 &&
              std::abs(Json::parse(elevation.body)["height_m"].get<double>() - 111) < 1e-6);
      // Of level 11: half of those that are asked for after the change nobody has asked for before.
      const int x = 2128 + int(random() % 5) + after % 2 * 5, y = 1548 + int(random() % 10);
      const auto tile = HttpClient(at).get(fmt::format("/terrain/dem/11/{}/{}.terrain", x, y));
      tiles.count(tile.status, tile.status == 200 && all_at(tile, 111));
    }
  };
  {
    std::vector<std::jthread> clients;
    for (unsigned i = 0; i < 3; ++i) clients.emplace_back(ask, i);
    while (elevations.right < 20) std::this_thread::yield();
    switch (GetParam()) {
      case 0:
        ASSERT_TRUE(test::overwrite_bytes(path, test::srtm(222)));
        break;
      case 1:
        move_another_over(path);
        break;
      case 2:
        fs::resize_file(path, 1'000'000);
        break;
      default:
        fs::remove(path);
    }
    changed = true;
  }
  EXPECT_EQ(elevations.wrong, 0);
  EXPECT_EQ(tiles.wrong, 0);
  EXPECT_GE(elevations.refused, 100);
  EXPECT_GE(tiles.right + tiles.refused, 180);
  EXPECT_GE(tiles.refused, 20);  // those that had been made are sent still
  EXPECT_EQ(get("/livez").status, 200);
  // The block that is kept answers still; at most one of the corners lies in it.
  int refused = 0;
  for (const char* const corner :
       {"lon=7.01&lat=46.01", "lon=7.99&lat=46.01", "lon=7.01&lat=46.99", "lon=7.99&lat=46.99"}) {
    const HttpReply after = get(std::string("/elevation/dem?") + corner);
    refused += after.status == 503;
    if (after.status == 503)
      EXPECT_EQ(after.headers.at("retry-after"), "1");
    else
      EXPECT_EQ(Json::parse(after.body)["height_m"], 111);
  }
  EXPECT_GE(refused, 3);
  spdlog::set_level(spdlog::level::info);
}

INSTANTIATE_TEST_SUITE_P(OverwrittenReplacedCutRemoved, ApiChange, ::testing::Range(0, 4));

}  // namespace
}  // namespace tind::api
