// [[dataset]] tables: what they say, what is refused, and that they are printed as they are read.

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "server/services/datasets/config.h"
#include "server/services/datasets/open_dataset.h"
#include "tests/support/support.h"

namespace tind::services {
namespace {

namespace fs = std::filesystem;

class DatasetTable : public ::testing::Test {
 protected:
  Result<Config> read(const std::string& toml) {
    input_.file = folder_.file("tind.toml");
    std::ofstream(input_.file) << toml;
    return read_config(input_);
  }
  std::string error(const std::string& toml) {
    const auto config = read(toml);
    return config ? "no error" : config.error().what;
  }
  std::string in_folder(const std::string& name) { return folder_.file(name); }

  test::TempDir folder_;
  ConfigInput input_;
};

TEST_F(DatasetTable, SaysMoreThanTheDaemonDoesForAll) {
  const auto config = read(
      "max_error = 4\nside = \"above\"\n"
      "[[dataset]]\nname = \"alps\"\nfiles = [\"a,b=c.tif\", \"/data/d.tif\"]\nmax_error = 0.5\n"
      "nodata = [-1, -2]\nlevels = \"2-9\"\nattribution = \"ours\"\n"
      "[[dataset]]\nfiles = \"e.tif\"\n");
  ASSERT_TRUE(config) << config.error().what;
  ASSERT_EQ(config->tables.size(), 2u);
  const DatasetSpec& alps = config->tables[0];
  EXPECT_EQ(alps.name, "alps");
  EXPECT_EQ(alps.files, (std::vector{in_folder("a,b=c.tif"), std::string("/data/d.tif")}));
  const auto of_alps = dataset_options(config->every, alps.own);
  ASSERT_TRUE(of_alps);
  EXPECT_EQ(of_alps->tiles.max_error_m, 0.5);
  EXPECT_EQ(of_alps->tiles.side, Side::above);
  EXPECT_EQ(of_alps->tiles.first_level, 2);
  EXPECT_EQ(of_alps->tiles.last_level, 9);
  EXPECT_EQ(of_alps->dem.nodata, (std::vector<double>{-1, -2}));
  EXPECT_EQ(of_alps->attribution, "ours");
  const auto of_other = dataset_options(config->every, config->tables[1].own);
  ASSERT_TRUE(of_other);
  EXPECT_EQ(of_other->tiles.max_error_m, 4);
  EXPECT_EQ(of_other->tiles.last_level, -1);
  EXPECT_EQ(name_of(config->tables[1]), "e");
}

TEST_F(DatasetTable, MistakesNameTheirLineAndWhatWasMeant) {
  const std::string begin = "[[dataset]]\nfiles = [\"a.tif\"]\n";
  const auto expect = [&](const std::string& toml, const std::string& words) {
    const std::string what = error(toml);
    EXPECT_NE(what.find(words), std::string::npos) << toml << "\n" << what;
  };
  expect(begin + "max_eror = 1\n",
         "tind.toml:3: unknown key max_eror of a dataset; did you mean max_error?");
  expect(begin + "max_error = \"much\"\n", "tind.toml:3: max_error must be a number");
  expect(begin + "max_error = [1, 2]\n", "tind.toml:3: max_error takes one value");
  expect(begin + "levels = \"9-3\"\n", "tind.toml:3: levels must be A-B");
  expect(begin + "name = \"../x\"\n", "tind.toml:3: name must be");
  expect(begin + "name = 5\n", "tind.toml:3: name must be a text in quotes");
  expect("[[dataset]]\nfiles = [\"a.tif\", 5]\n", "tind.toml:2: files must be a list of texts");
  expect("# " + std::string(2 << 20, 'x') + "\n", "longer than 1 MiB");
  expect("[[dataset]]\nname = \"x\"\n", "tind.toml:1: a dataset without files");
  expect("[[dataset]]\nfiles = []\n", "tind.toml:2: files must name a file");
  expect("[[dataset]]\nfiles = [3, [4]]\n", "tind.toml:2: files must be");
  expect("[dataset]\nfiles = [\"a.tif\"]\n", "tind.toml:1: write [[dataset]], with two brackets");
  expect(
      "[[dataset]]\nname = \"x\"\nfiles = [\"a.tif\"]\n[[dataset]]\nfiles = [\"b.tif\"]\nname = "
      "\"x\"\n",
      "tind.toml:4: a second dataset x");
  expect("[[dataset]]\nfiles = [\"a.tif\"\n", "tind.toml:");
  expect(begin + "max_error = 1979-05-27\n", "tind.toml:3");
}

TEST_F(DatasetTable, NamesAGeoidFileBesideItAndNoOtherDatum) {
  std::ofstream(in_folder("ours.gtx")) << "only its name counts";
  const auto config =
      read("[[dataset]]\nfiles = [\"a.tif\"]\nfrom_datum = \"ours.gtx\"\nto_datum = \"egm96\"\n");
  ASSERT_TRUE(config) << config.error().what;
  const auto options = dataset_options(config->every, config->tables[0].own);
  ASSERT_TRUE(options) << options.error().what;
  EXPECT_EQ(options->dem.from_datum, VerticalDatum(VerticalDatum::file, in_folder("ours.gtx")));
  EXPECT_EQ(options->dem.to_datum, TargetDatum(VerticalDatum::egm96));
  EXPECT_NE(error("[[dataset]]\nfiles = [\"a.tif\"]\nfrom_datum = \"other.gtx\"\n")
                .find("there is no geoid file " + in_folder("other.gtx")),
            std::string::npos);
}

TEST_F(DatasetTable, IsPrintedAsItIsRead) {
  const auto config = read(
      "nodata = -9999\n[[dataset]]\nname = \"a\"\nfiles = [\"a \\\"b\\\".tif\", \"c/*.tif\"]\n"
      "max_error = 2.5\nallow_vrt = true\nside = \"below\"\nnodata = [-1, -2]\n");
  ASSERT_TRUE(config) << config.error().what;
  const std::string printed = print_config(*config);
  const auto again = read(printed);
  ASSERT_TRUE(again) << again.error().what << "\n" << printed;
  EXPECT_EQ(print_config(*again), printed);
  EXPECT_EQ(again->tables[0].own, config->tables[0].own);
  EXPECT_EQ(again->tables[0].files, config->tables[0].files);
  EXPECT_EQ(again->every, config->every);  // what is printed as the default is not said
}

constexpr const char* kLayers =
    "[[dataset]]\nname = \"land\"\nmax_error = 2\nto_datum = \"ellipsoid\"\n"
    "[[dataset.layer]]\nname = \"base\"\nfiles = [\"base.asc\"]\nerror = 40\n"
    "[[dataset.layer]]\nname = \"town\"\nfiles = \"town*.asc\"\ncrs = \"EPSG:32632\"\n"
    "scale = 0.1\nblend = 300\nnodata = [-1, -2]\n";

TEST_F(DatasetTable, SaysItsLayersTheLowestFirst) {
  const auto config = read(kLayers);
  ASSERT_TRUE(config) << config.error().what;
  const DatasetSpec& land = config->tables.at(0);
  ASSERT_EQ(land.layers.size(), 2u);
  EXPECT_EQ(land.files, (std::vector{in_folder("base.asc"), in_folder("town*.asc")}));
  EXPECT_FALSE(is_stored(land));
  for (const char* name : {"town2.asc", "town1.asc"}) std::ofstream(in_folder(name)) << "x";
  DemOptions every;
  every.scale = 3;
  const auto specs = layers_of(land, every);
  ASSERT_TRUE(specs) << specs.error().what;
  ASSERT_EQ(specs->layers.size(), 2u);
  EXPECT_EQ(specs->layers[0].name, "base");
  EXPECT_EQ(specs->layers[0].dem->scale, 3);
  EXPECT_EQ(specs->layers[1].files, (std::vector{in_folder("town1.asc"), in_folder("town2.asc")}));
  EXPECT_EQ(specs->layers[1].dem->crs, "EPSG:32632");
  EXPECT_EQ(specs->layers[1].dem->scale, 0.1);
  EXPECT_EQ(specs->layers[1].dem->nodata, (std::vector<double>{-1, -2}));
  ASSERT_EQ(specs->options.blends_m.size(), 1u);
  EXPECT_EQ(specs->options.blends_m[0].metres, 300);
  ASSERT_EQ(specs->options.max_errors_m.size(), 1u);
  EXPECT_EQ(specs->options.max_errors_m[0].name, "base");
  const std::string printed = print_config(*config);
  const auto again = read(printed);
  ASSERT_TRUE(again) << again.error().what << "\n" << printed;
  EXPECT_EQ(print_config(*again), printed);
}

TEST_F(DatasetTable, LayersThatContradictEachOtherAreRefusedByLine) {
  const auto expect = [&](const std::string& toml, const std::string& words) {
    const std::string what = error(toml);
    EXPECT_NE(what.find(words), std::string::npos) << toml << "\n" << what;
  };
  const std::string layer = "[[dataset.layer]]\nname = \"a\"\nfiles = [\"a.tif\"]\n";
  expect("[[dataset]]\nfiles = [\"b.tif\"]\n" + layer, "tind.toml:2: a dataset has either files");
  expect("[[dataset]]\n" + layer + layer, "tind.toml:5: a second layer a");
  expect("[[dataset]]\n" + layer + "to_datum = \"egm96\"\n",
         "tind.toml:5: to_datum is said of the whole dataset");
  expect("[[dataset]]\n" + layer + "max_error = 3\n",
         "tind.toml:5: max_error is said of the whole dataset");
  expect("[[dataset]]\n" + layer + "blendd = 3\n",
         "tind.toml:5: unknown key blendd of a layer; did you mean blend?");
  expect("[[dataset]]\n" + layer + "blend = -3\n", "tind.toml:5: blend must be metres");
  expect("[[dataset]]\n" + layer + "band = \"red\"\n", "tind.toml:5: band");
  expect("[[dataset]]\n[[dataset.layer]]\nname = \"a\"\n", "tind.toml:2: a layer needs");
  expect("[[dataset]]\n[dataset.layer]\nname = \"a\"\n", "with two brackets");
}

TEST_F(DatasetTable, LayersAreServedAsTheyAreNamed) {
  const auto write = [&](const char* name, double x, double y, double step, int height) {
    std::ofstream out(in_folder(name));
    out << "ncols 12\nnrows 12\nxllcenter " << x << "\nyllcenter " << y << "\ncellsize " << step
        << "\n";
    for (int i = 0; i < 144; ++i) out << height + i % 5 << ' ';
  };
  write("base.asc", 8, 46, 0.125, 100);
  write("town1.asc", 480000, 5150000, 500, 4000);
  const std::string datum = "from_datum = \"ellipsoid\"\n";
  const auto config = read(
      "[[dataset]]\nname = \"land\"\n"
      "[[dataset.layer]]\nname = \"base\"\nfiles = [\"base.asc\"]\ncrs = \"EPSG:4326\"\n" +
      datum +
      "[[dataset.layer]]\nname = \"town\"\nfiles = [\"town*.asc\"]\ncrs = \"EPSG:32632\"\n"
      "scale = 0.1\n" +
      datum);
  ASSERT_TRUE(config) << config.error().what;
  auto options = dataset_options(config->every, config->tables[0].own);
  ASSERT_TRUE(options) << options.error().what;
  options->dem.environment = test::environment();
  const auto dataset = open_dataset(config->tables[0], *options);
  ASSERT_TRUE(dataset) << dataset.error().what;
  const auto layers = dataset->source->layers();
  ASSERT_EQ(layers.size(), 2u);
  EXPECT_EQ(layers[1].name, "town");
  const auto in_town = height_at(*dataset->source, {8.77, 46.52});
  ASSERT_TRUE(in_town) << in_town.error().what;
  EXPECT_EQ(in_town->layer, 1u);
  EXPECT_NEAR(in_town->height.height_m, 400.2, 0.3);
}

TEST_F(DatasetTable, PatternsAreTheFilesThatFitThem) {
  fs::create_directories(in_folder("[x] c"));
  for (const char* name : {"[x] c/b,2.tif", "[x] c/a.tif", "[x] c/c.txt", "odd*.tif"})
    std::ofstream(in_folder(name)) << "x";
  const auto files = [](const Result<Config>& config) {
    return config ? files_of(config->tables.at(0)) : std::unexpected(config.error());
  };
  const auto found =
      files(read("[[dataset]]\nfiles = [\"[[]x] c/*.tif\", \"[x] c/a.tif\", \"odd*.tif\"]\n"));
  ASSERT_TRUE(found) << found.error().what;
  EXPECT_EQ(*found, (std::vector{in_folder("[x] c/a.tif"), in_folder("[x] c/b,2.tif"),
                                 in_folder("odd*.tif")}));
  const auto none = files(read("[[dataset]]\nfiles = [\"no/*.tif\"]\n"));
  ASSERT_FALSE(none);
  EXPECT_EQ(none.error().code, Errc::not_found);
  EXPECT_NE(none.error().what.find("no/*.tif"), std::string::npos) << none.error().what;
}

TEST_F(DatasetTable, ServesItsFilesUnderItsNameAndAttribution) {
  fs::copy_file(test::testdata("rainier.tif"), in_folder("r,1.tif"));
  const auto config = read(
      "[[dataset]]\nname = \"mountain\"\nfiles = [\"r,*.tif\"]\nmax_error = 20\nlevels = \"0-3\"\n"
      "attribution = \"USGS\"\n");
  ASSERT_TRUE(config) << config.error().what;
  auto options = dataset_options(config->every, config->tables[0].own);
  ASSERT_TRUE(options) << options.error().what;
  options->dem.environment = test::environment();
  const auto dataset = open_dataset(config->tables[0], *options);
  ASSERT_TRUE(dataset) << dataset.error().what;
  EXPECT_EQ(dataset->facts().attribution, "USGS");
  EXPECT_EQ(dataset->tiles->layer().maxzoom, 3);
  Catalog catalog;
  const ServedDataset& served = catalog.add("mountain", *dataset);
  EXPECT_NE(served.layer_json->body().find("\"attribution\":\"USGS\""), std::string::npos)
      << served.layer_json->body();
}

}  // namespace
}  // namespace tind::services
