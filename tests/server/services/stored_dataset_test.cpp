// A folder of tiles that gets others while it is served.

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <spdlog/spdlog.h>

#include <filesystem>
#include <fstream>
#include <thread>

#include "server/services/datasets/catalog_keeper.h"
#include "server/services/datasets/open_dataset.h"
#include "server/services/tiles/tile_service.h"
#include "terrain/pyramid/build/build.h"
#include "terrain/store/copy/copy_store.h"
#include "terrain/store/open/open_store.h"
#include "tests/support/support.h"

namespace tind::services {
namespace {

namespace fs = std::filesystem;

class StoredDatasetTest : public testing::Test {
 protected:
  void build(const std::string& name, float lift) {
    const std::string path = folder_.file("dem.asc");
    const HeightGrid grid = test::rough_terrain(150, 120, 5);
    std::ofstream out(path);
    out << "ncols 150\nnrows 120\nxllcenter -121.7\nyllcenter 46.8\ncellsize 0.000833333333\n"
           "NODATA_value -9999\n";
    for (int r = 0; r < 120; ++r)
      for (int c = 0; c < 150; ++c)
        out << grid.at(c, r) + (c < 20 && r < 20 ? lift : 0) << (c + 1 < 150 ? ' ' : '\n');
    out.close();
    std::ofstream(folder_.file("dem.prj"))
        << R"(GEOGCS["GCS_WGS_1984",DATUM["D_WGS_1984",SPHEROID["WGS_1984",6378137.0,)"
        << R"(298.257223563]],PRIMEM["Greenwich",0.0],UNIT["Degree",0.0174532925199433]])";
    auto source = DemSource::open(std::vector{path});
    ASSERT_TRUE(source) << source.error().what;
    BuildOptions o;
    o.output = folder_.file(name);
    o.tiles.max_error_m = 8;
    o.tiles.effort = Effort::fast;
    o.threads = 1;
    const auto report = build_tiles(*source, o);
    ASSERT_TRUE(report) << report.error().what;
  }
  std::string stored(const std::string& name, TileId id) {
    std::ifstream in(folder_.file(name + "/" + id.text() + ".terrain"), std::ios::binary);
    return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
  }

  test::TempDir folder_;
};

std::vector<TileId> tiles_of(const ServedDataset& dataset) {
  std::vector<TileId> ids;
  const auto& available = dataset.tiles->layer().available;
  for (std::size_t z = 0; z < available.size(); ++z)
    for (const proto::TileRange& r : available[z])
      for (std::uint32_t x = r.start_x; x <= r.end_x; ++x)
        for (std::uint32_t y = r.start_y; y <= r.end_y; ++y) ids.push_back({int(z), x, y});
  return ids;
}

TEST_F(StoredDatasetTest, an_update_is_served_whole_or_not_at_all) {
  build("d", 0);
  build("new", 40);
  Catalog catalog;
  ASSERT_TRUE(open_dataset(catalog, {"d", {folder_.file("d")}}, {}, {}));
  TileCache cache(64 << 20);
  CpuPool pool(1, 8);
  TileService service(cache, pool);
  const proto::Extensions all{true, true, true};
  const auto before = catalog.find("d");
  const std::vector<TileId> ids = tiles_of(*before);
  ASSERT_GT(ids.size(), 8u);
  std::vector<std::string> old;
  for (const TileId id : ids) old.push_back(stored("d", id));
  for (std::size_t i = 0; i < ids.size(); i += 2)  // half of them are in the cache
    ASSERT_TRUE(service.make_now(*before, ids[i], all, {}));
  EXPECT_TRUE(catalog.follow().empty());
  EXPECT_EQ(catalog.find("d"), before);

  build("d", 40);
  // The old dataset has its own tiles or none.
  std::size_t changed = 0, refused = 0;
  for (std::size_t i = 0; i < ids.size(); ++i) {
    changed += stored("d", ids[i]) != old[i];
    const auto tile = service.make_now(*before, ids[i], all, {});
    refused += !tile;
    if (tile)
      EXPECT_EQ(std::string((*tile)->bytes().begin(), (*tile)->bytes().end()), old[i]);
    else
      EXPECT_EQ(tile.error().code, Errc::busy) << tile.error().what;
  }
  EXPECT_GT(changed, 3u);
  EXPECT_GT(refused, 0u);
  EXPECT_LT(refused, ids.size());
  // The next look finds the new ones, and nothing of the old.
  EXPECT_THAT(catalog.follow(), testing::ElementsAre("d"));
  const auto after = catalog.find("d");
  ASSERT_NE(after, before);
  EXPECT_NE(after->index, before->index);
  EXPECT_NE(after->tiles->layer().version, before->tiles->layer().version);
  EXPECT_NE(after->layer_json->bytes().size(), 0u);
  for (const TileId id : ids) {
    const auto tile = service.make_now(*after, id, all, {});
    ASSERT_TRUE(tile) << tile.error().what;
    EXPECT_EQ(std::string((*tile)->bytes().begin(), (*tile)->bytes().end()), stored("new", id))
        << id.text();
  }
  EXPECT_TRUE(catalog.follow().empty());
  EXPECT_EQ(catalog.all().size(), 1u);
}

TEST_F(StoredDatasetTest, an_archive_gives_the_tiles_of_the_folder_and_those_that_take_its_place) {
  build("d", 0);
  build("new", 40);
  for (const std::string file : {"a.pmtiles", "a.mbtiles"}) {
    ASSERT_TRUE(copy_store(*open_store(folder_.file("d")), folder_.file(file), {}));
    Catalog catalog;
    ASSERT_TRUE(open_dataset(catalog, {"d", {folder_.file(file)}}, {}, {}));
    const auto serves = [&](const std::string& folder) {
      const auto dataset = catalog.find("d");
      std::size_t same = 0;
      for (const TileId id : tiles_of(*dataset)) {
        const auto tile = dataset->tiles->tile(id, {});
        same += tile && std::string(tile->bytes.begin(), tile->bytes.end()) == stored(folder, id);
      }
      return same == tiles_of(*dataset).size();
    };
    EXPECT_TRUE(serves("d"));
    EXPECT_TRUE(catalog.follow().empty());
    ASSERT_TRUE(copy_store(*open_store(folder_.file("new")), folder_.file(file), {}));
    EXPECT_TRUE(serves("d")) << "until somebody looks";
    EXPECT_EQ(catalog.follow().size(), 1u);
    EXPECT_TRUE(serves("new"));
  }
}

TEST_F(StoredDatasetTest, an_archive_that_was_followed_is_as_it_was_for_the_next_reload) {
  build("d", 0);
  build("new", 40);
  const std::string file = folder_.file("a.pmtiles"), toml = folder_.file("tind.toml");
  ASSERT_TRUE(copy_store(*open_store(folder_.file("d")), file, {}));
  std::ofstream(toml) << "[[dataset]]\nname = \"d\"\nfiles = [\"a.pmtiles\"]\n";
  Catalog catalog;
  CatalogKeeper keeper(
      catalog,
      {.read =
           [&] {
             return read_config({.file = toml, .environment = {}, .flags = {}, .datasets = {}});
           },
       .environment = test::environment(),
       .pool = nullptr});
  spdlog::set_level(spdlog::level::off);
  ASSERT_TRUE(keeper.load());
  const auto before = catalog.find("d");
  ASSERT_TRUE(before);
  ASSERT_TRUE(copy_store(*open_store(folder_.file("new")), file, {}));
  {
    std::jthread running([&](const std::stop_token& stop) { keeper.run(stop); });
    for (int i = 0; i < 600 && catalog.find("d") == before; ++i)
      std::this_thread::sleep_for(std::chrono::milliseconds(50));
  }
  const auto followed = catalog.find("d");
  ASSERT_NE(followed, before);
  const auto change = keeper.load();
  spdlog::set_level(spdlog::level::info);
  ASSERT_TRUE(change);
  EXPECT_EQ(change->kept, 1u);
  EXPECT_EQ(catalog.find("d"), followed);
}

}  // namespace
}  // namespace tind::services
