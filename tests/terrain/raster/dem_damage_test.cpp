// Damaged and hostile files: an error, or the very same heights; never silently other ones.

#include <gdal_priv.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <array>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <memory>
#include <random>
#include <vector>

#include "terrain/raster/dem_source.h"
#include "tests/support/listener.h"
#include "tests/support/support.h"

namespace tind {
namespace {

using testing::HasSubstr;

std::string bytes_of(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

void write(const std::string& path, const std::string& bytes) {
  std::ofstream(path, std::ios::binary) << bytes;
}

Result<HeightGrid> read_all(const std::string& path, const DemOptions& options = {}) {
  auto source = DemSource::open({&path, 1}, options);
  if (!source) return std::unexpected(source.error());
  return (*source)->read(0, 0, int((*source)->info().cols), int((*source)->info().rows));
}

bool same(const HeightGrid& a, const HeightGrid& b) {
  return a.cols() == b.cols() && a.rows() == b.rows() &&
         std::memcmp(a.values().data(), b.values().data(), a.size() * sizeof(float)) == 0;
}

/// Cuts the file at many places; returns how many of the cuts were noticed.
int notices_cuts(const std::string& path, const std::string& name, int step) {
  const test::TempDir folder;
  const auto truth = read_all(path);
  EXPECT_TRUE(truth.has_value()) << truth.error().what;
  const std::string bytes = bytes_of(path), cut = folder.file(name);
  int noticed = 0;
  for (std::size_t size = 0; size < bytes.size(); size += size + 12 < bytes.size() ? step : 1) {
    if (size + 12 < bytes.size() && size + step >= bytes.size()) size = bytes.size() - 12;
    write(cut, bytes.substr(0, size));
    const auto got = read_all(cut);
    if (!got) {
      ++noticed;
      EXPECT_THAT(got.error().what, HasSubstr(name));
    } else if (!std::isdigit(bytes[size - 1])) {  // text cut inside its last number is no less text
      EXPECT_TRUE(same(*got, *truth)) << name << " cut to " << size << " of " << bytes.size();
    }
  }
  return noticed;
}

TEST(DemDamage, TruncatedFilesAreErrors) {
  EXPECT_GE(notices_cuts(test::testdata("rainier.tif"), "rainier.tif", 9001), 25);
  EXPECT_GE(notices_cuts(test::testdata("bigtujunga_crop.tif"), "cut.tif", 907), 30);
  EXPECT_GE(notices_cuts(test::testdata("crater.tif"), "cut.tif", 2997), 25);
  EXPECT_GE(notices_cuts(test::testdata("desert.asc"), "desert.asc", 401), 30);
}

TEST(DemDamage, TruncatedSharedFilesAreErrors) {
  TIND_NEEDS_SHARED_DATA(hgt, "dem/N52E008.hgt.zip");
  EXPECT_GE(notices_cuts(hgt, "N52E008.hgt.zip", 60013), 14);
  EXPECT_GE(notices_cuts(test::shared_data("dem/n33_w116_3arc_v2.dt1"), "n.dt1", 300007), 9);
  EXPECT_GE(notices_cuts(test::shared_data("dem/SainteHelens.dem"), "s.dem", 60013), 16);
  EXPECT_GE(notices_cuts(test::shared_data("dem/ps_height_1k.png"), "p.png", 100003), 14);
  EXPECT_GE(notices_cuts(test::shared_data("dem/westUS.tif"), "w.tif", 50021), 17);
  EXPECT_GE(notices_cuts(test::shared_data("dem/N49W123.tif"), "n.tif", 200003), 14);
}

TEST(DemDamage, WordsInAnAsciiGridAreErrors) {
  const test::TempDir folder;
  std::string text = bytes_of(test::testdata("desert.asc"));
  text[text.size() / 2] = 'x';
  write(folder.file("d.asc"), text);
  const auto got = read_all(folder.file("d.asc"));
  ASSERT_FALSE(got);
  EXPECT_THAT(got.error().what, HasSubstr("no number"));
}

TEST(DemDamage, AnAsciiGridHasCellsOfASize) {
  const test::TempDir folder;
  for (const char* size : {"-0.01", "0", "nan"}) {
    write(folder.file("d.asc"), "ncols 2\nnrows 2\nxllcorner 8\nyllcorner 47\ncellsize " +
                                    std::string(size) + "\n1 2\n3 4\n");
    EXPECT_FALSE(read_all(folder.file("d.asc"))) << size;
  }
}

TEST(DemDamage, NumbersOfAnAsciiGridAreWhole) {
  const test::TempDir folder;
  const std::string head =
      "ncols 2\nnrows 2\nxllcorner 8\nyllcorner 47\ncellsize 0.01\nNODATA_value -9999\n";
  const auto reads = [&](const std::string& number) {
    write(folder.file("d.asc"), head + "1 2\n4 " + number + "\n");
    return read_all(folder.file("d.asc")).has_value();
  };
  for (const char* good :
       {"3", "-3", "+3", "3.5", "3.", ".5", "-.5", "3e2", "3.5E-2", "+3e+2", "-0000000042"})
    EXPECT_TRUE(reads(good)) << good;
  for (const char* bad :
       {"1.2.3", "--5", "+-1", "1e", "1e+", "5-", "1e5.2", ".", "-", "1.2e3e4", "e5"})
    EXPECT_FALSE(reads(bad)) << bad;
  // GDAL makes 0 of words among whole numbers, and others of those that are too long.
  for (const char* bad : {"nan", "-inf", "NaN", "2147483648", "-2147483649", "99999999999"})
    EXPECT_FALSE(reads(bad)) << bad;
  write(folder.file("d.asc"), head + "1.0 2\n3 nan\n");
  EXPECT_TRUE(read_all(folder.file("d.asc"))) << "a void";
  write(folder.file("d.asc"), head + "1 2\n3 nan");
  EXPECT_FALSE(read_all(folder.file("d.asc")));
  write(folder.file("d.asc"), head + "1 2\n3 4-");
  EXPECT_FALSE(read_all(folder.file("d.asc"))) << "at the end of the file";
}

/// Flips one bit at a time; every result must be an error or the truth. Returns the errors.
int notices_flips(const std::string& path, const std::string& name, int flips, double from = 0) {
  const test::TempDir folder;
  const auto truth = read_all(path);
  EXPECT_TRUE(truth.has_value());
  std::string bytes = bytes_of(path);
  std::mt19937 random(7);
  int noticed = 0;
  for (int k = 0; k < flips; ++k) {
    const auto first = std::size_t(from * double(bytes.size()));
    const std::size_t at = first + random() % (bytes.size() - first);
    const char mask = char(1 << random() % 8);
    bytes[at] ^= mask;
    const std::string flipped = folder.file(name);
    write(flipped, bytes);
    const auto got = read_all(flipped);
    if (!got)
      ++noticed;
    else
      EXPECT_TRUE(same(*got, *truth)) << name << " bit " << int(mask) << " of byte " << at;
    bytes[at] ^= mask;
  }
  return noticed;
}

TEST(DemDamage, FlippedBitsUnderAChecksumAreErrors) {
  EXPECT_GE(notices_flips(test::testdata("rainier.tif"), "r.tif", 400, 0.02), 390);
  TIND_NEEDS_SHARED_DATA(hgt, "dem/N52E008.hgt.zip");
  EXPECT_GE(notices_flips(hgt, "N52E008.hgt.zip", 60, 0.01), 55);
  EXPECT_GE(notices_flips(test::shared_data("dem/n33_w116_3arc_v2.dt1"), "n.dt1", 60, 0.01), 55);
  EXPECT_GE(notices_flips(test::shared_data("dem/ps_height_1k.png"), "p.png", 60, 0.001), 55);
}

/// 200 x 200 heights under a mask, in the file or beside it.
void write_masked(const std::string& path, bool inside) {
  (void)DemSource::open(std::array{test::testdata("rainier.tif")});  // registers the driver
  CPLSetThreadLocalConfigOption("GDAL_TIFF_INTERNAL_MASK", inside ? "YES" : "NO");
  constexpr int kSide = 200;
  const char* how[] = {"COMPRESS=DEFLATE", nullptr};
  const auto driver = static_cast<GDALDriver*>(GDALGetDriverByName("GTiff"));
  const std::unique_ptr<GDALDataset> set(
      driver->Create(path.c_str(), kSide, kSide, 1, GDT_Float32, const_cast<char**>(how)));
  ASSERT_TRUE(set);
  double place[] = {7, .001, 0, 46, 0, -.001};
  set->SetGeoTransform(place);
  std::vector<float> heights(kSide * kSide, 100);
  std::vector<GByte> mask(heights.size());
  std::mt19937 random(3);
  for (std::size_t i = 0; i < mask.size(); ++i) mask[i] = random() % 2 ? 255 : 0;
  GDALRasterBand& band = *set->GetRasterBand(1);
  ASSERT_EQ(
      band.RasterIO(GF_Write, 0, 0, kSide, kSide, heights.data(), kSide, kSide, GDT_Float32, 0, 0),
      CE_None);
  ASSERT_EQ(set->CreateMaskBand(GMF_PER_DATASET), CE_None);
  ASSERT_EQ(band.GetMaskBand()->RasterIO(GF_Write, 0, 0, kSide, kSide, mask.data(), kSide, kSide,
                                         GDT_Byte, 0, 0),
            CE_None);
  CPLSetThreadLocalConfigOption("GDAL_TIFF_INTERNAL_MASK", nullptr);
}

TEST(DemDamage, AMaskThatCannotBeReadIsNotPassedOver) {
  const test::TempDir folder;
  const std::string path = folder.file("out.tif"), mask = path + ".msk";
  write_masked(path, false);
  const std::string sound = bytes_of(mask);
  for (const std::string& text : {std::string("garbage"), std::string(), sound.substr(0, 100)}) {
    write(mask, text);
    const auto got = read_all(path);
    ASSERT_FALSE(got) << "its voids would be heights: " << text.size();
    EXPECT_THAT(got.error().what, HasSubstr(mask));
  }
  for (const char* const name : {"out.tif.msk", "out.prj", "out.tfw", "out.tifw", "out.WLD"}) {
    const std::string beside = folder.file(name);
    std::filesystem::remove(beside);
    std::filesystem::create_symlink(beside, beside);  // nobody can open it
    const auto got = read_all(path);
    ASSERT_FALSE(got);
    EXPECT_THAT(got.error().what, HasSubstr(std::string(name) + ": is read with the raster"));
    std::filesystem::remove(beside);
    write(mask, sound);
    EXPECT_TRUE(read_all(path));
  }
}

TEST(DemDamage, AWorldFileThatGivesNoPlaceIsNotPassedOver) {
  const test::TempDir folder;
  const std::string path = folder.file("out.tif"), world = folder.file("out.tfw");
  (void)DemSource::open(std::array{test::testdata("rainier.tif")});  // registers the driver
  GDALDriver* const driver = GetGDALDriverManager()->GetDriverByName("GTiff");
  const char* const how[] = {"PROFILE=BASELINE", nullptr};
  GDALClose(driver->Create(path.c_str(), 8, 8, 1, GDT_Float32, const_cast<char**>(how)));
  const auto place = [&] { return DemSource::open(std::vector<std::string>{path}, {}); };
  ASSERT_TRUE(place());
  EXPECT_FALSE((*place())->info().has_geotransform);
  write(world, "garbage");
  ASSERT_FALSE(place()) << "it would have its posts 1 m apart";
  EXPECT_THAT(place().error().what, HasSubstr("out.tfw"));
  write(world, "1\n0\n0\n1\n0.5\n0.5\n");  // as without one
  EXPECT_TRUE(place());
  write(world, "30\n0\n0\n-30\n400000\n5000000\n");
  ASSERT_TRUE(place());
  EXPECT_TRUE((*place())->info().has_geotransform);
}

TEST(DemDamage, FlippedBitsOfAMaskAreErrors) {
  const test::TempDir folder;
  for (const bool inside : {true, false}) {
    const std::string path = folder.file(inside ? "in.tif" : "out.tif");
    write_masked(path, inside);
    const std::string flipped = inside ? path : path + ".msk";
    const auto truth = read_all(path);
    ASSERT_TRUE(truth) << truth.error().what;
    const auto voids =
        std::ranges::count_if(truth->values(), [](float z) { return std::isnan(z); });
    ASSERT_NEAR(double(voids), 20000, 1000);
    std::string bytes = bytes_of(flipped);
    int noticed = 0;
    for (std::size_t k = 0; k < 60; ++k) {  // nearly all of both is the mask, which is noise
      const std::size_t at = bytes.size() / 4 + k * bytes.size() / 100;
      bytes[at] ^= 16;
      write(flipped, bytes);
      const auto got = read_all(path);
      if (!got)
        ++noticed;
      else
        EXPECT_TRUE(same(*got, *truth)) << flipped << " byte " << at;
      bytes[at] ^= 16;
    }
    EXPECT_GE(noticed, 55) << flipped;
  }
}

TEST(DemHostile, VrtIsRefusedUnlessTheOperatorSaysSo) {
  const test::TempDir folder;
  const std::string source = test::testdata("crater.tif");
  const auto vrt = [&](const std::string& inner, const std::string& extra = "") {
    return "<VRTDataset rasterXSize=\"336\" rasterYSize=\"459\">"
           "<VRTRasterBand dataType=\"Float64\" band=\"1\">" +
           extra + "<SimpleSource><SourceFilename relativeToVRT=\"0\">" + inner +
           "</SourceFilename><SourceBand>1</SourceBand></SimpleSource>"
           "</VRTRasterBand></VRTDataset>";
  };
  for (const char* name : {"a.vrt", "a.tif"}) {
    write(folder.file(name), vrt(source));
    EXPECT_FALSE(read_all(folder.file(name))) << name;
  }
  const auto allowed = read_all(folder.file("a.vrt"), {.allow_vrt = true});
  ASSERT_TRUE(allowed) << allowed.error().what;
  EXPECT_TRUE(same(*allowed, *read_all(source)));
  EXPECT_FALSE(read_all(folder.file("a.vrt")));  // permission is per source, not for ever

  write(folder.file("scaled.vrt"),
        vrt(source, "<Scale>0.5</Scale><Offset>-7</Offset><UnitType>us survey foot</UnitType>"));
  const auto scaled = read_all(folder.file("scaled.vrt"), {.allow_vrt = true});
  ASSERT_TRUE(scaled) << scaled.error().what;
  for (std::size_t i = 0; i < scaled->size(); i += 1009)
    EXPECT_NEAR(scaled->values()[i], (allowed->values()[i] * 0.5 - 7) * 1200 / 3937, 1e-4);

  // Sources a VRT names are held to the same short list, and never leave the machine.
  write(folder.file("missing.vrt"), vrt(folder.file("nothing.tif")));
  EXPECT_FALSE(read_all(folder.file("missing.vrt"), {.allow_vrt = true}));
  const test::Listener server;
  for (const char* system :
       {"/vsicurl/", "/vsicurl?url=", "/vsicurl_streaming/", "/vsizip//vsicurl_streaming/"}) {
    write(folder.file("remote.vrt"), vrt(system + server.url() + "/a.tif"));
    EXPECT_FALSE(read_all(folder.file("remote.vrt"), {.allow_vrt = true}));
    EXPECT_FALSE(server.was_asked()) << system;
  }
}

TEST(DemHostile, VrtsThatNameEachOtherAreReadInBoundedTime) {
  const test::TempDir folder;
  const auto vrt = [&](const std::string& name, const std::vector<std::string>& sources) {
    std::string bands;
    for (const std::string& source : sources)
      bands += "<SimpleSource><SourceFilename relativeToVRT=\"1\">" + source +
               "</SourceFilename><SourceBand>1</SourceBand></SimpleSource>";
    write(folder.file(name),
          "<VRTDataset rasterXSize=\"336\" rasterYSize=\"459\"><VRTRasterBand dataType=\"Float64\" "
          "band=\"1\">" +
              bands + "</VRTRasterBand></VRTDataset>");
  };
  const auto why = [&](const std::string& name) {
    const auto read = read_all(folder.file(name), {.allow_vrt = true});
    return read ? std::string("read") : read.error().what;
  };
  std::filesystem::copy_file(test::testdata("crater.tif"), folder.file("a.tif"));
  vrt("two.vrt", {"a.tif", "a.tif"});
  vrt("four.vrt", {"two.vrt", "./two.vrt"});
  EXPECT_EQ(why("four.vrt"), "read");
  vrt("mosaic.vrt", std::vector<std::string>(1640, "a.tif"));  // as many has make_large_dem's
  EXPECT_EQ(why("mosaic.vrt"), "read");

  for (int i = 0; i < 9; ++i)
    vrt("fan" + std::to_string(i) + ".vrt",
        std::vector<std::string>(10, i < 8 ? "fan" + std::to_string(i + 1) + ".vrt" : "a.tif"));
  EXPECT_NE(why("fan0.vrt").find("fan5.vrt: names rasters 10000 times, of which there are 1"),
            std::string::npos)
      << why("fan0.vrt");
  EXPECT_EQ(why("fan7.vrt"), "read");

  // GDAL takes these spellings for the same.
  const auto spelled = [&](const std::string& kind, auto source) {
    for (int i = 0; i < 9; ++i) {
      std::string bands;
      const std::string next = i < 8 ? kind + std::to_string(i + 1) + ".vrt" : "a.tif";
      for (int k = 0; k < 10; ++k) bands += source(next);
      write(folder.file(kind + std::to_string(i) + ".vrt"),
            "<VRTDataset rasterXSize=\"336\" rasterYSize=\"459\"><VRTRasterBand "
            "dataType=\"Float64\" band=\"1\">" +
                bands + "</VRTRasterBand></VRTDataset>");
    }
    EXPECT_NE(why(kind + "0.vrt").find("names rasters 10000 times"), std::string::npos)
        << why(kind + "0.vrt");
  };
  spelled("lower", [](const std::string& next) {
    return "<SimpleSource><sourcefilename relativetovrt=\"1\">" + next +
           "</sourcefilename><SourceBand>1</SourceBand></SimpleSource>";
  });
  spelled("number", [](const std::string& next) {
    return "<SimpleSource><SourceFilename relativeToVRT=\"01\">" + next +
           "</SourceFilename><SourceBand>1</SourceBand></SimpleSource>";
  });
  spelled("attribute", [&](const std::string& next) {
    return "<SimpleSource SourceFilename=\"" + folder.file(next) +
           "\"><SourceBand>1</SourceBand></SimpleSource>";
  });

  // It would be read where it lies, in this process.
  for (const char* name : {"MEM:::DATAPOINTER=4096,PIXELS=336,LINES=459,DATATYPE=Int16",
                           "&#77;em:::DATAPOINTER=4096,PIXELS=336,LINES=459,DATATYPE=Int16",
                           "vrt://MEM:::DATAPOINTER=4096,PIXELS=336,LINES=459,DATATYPE=Int16"}) {
    write(folder.file("memory.vrt"),
          "<VRTDataset rasterXSize=\"336\" rasterYSize=\"459\"><VRTRasterBand "
          "dataType=\"Int16\" band=\"1\"><SimpleSource><SourceFilename>" +
              std::string(name) +
              "</SourceFilename><SourceBand>1</SourceBand></SimpleSource></VRTRasterBand>"
              "</VRTDataset>");
    EXPECT_NE(why("memory.vrt").find("names memory"), std::string::npos) << why("memory.vrt");
  }

  vrt("self.vrt", {"./self.vrt", "././self.vrt", "./././self.vrt"});
  EXPECT_NE(why("self.vrt").find("made of itself"), std::string::npos) << why("self.vrt");
  for (int i = 0; i < 40; ++i)
    vrt("deep" + std::to_string(i) + ".vrt",
        {i < 39 ? "deep" + std::to_string(i + 1) + ".vrt" : "a.tif"});
  EXPECT_NE(why("deep0.vrt").find("more than 32 VRTs"), std::string::npos) << why("deep0.vrt");
}

TEST(DemHostile, NamesAreFilesAndNothingElse) {
  for (const char* name :
       {"", "/", "no such file", "/vsizip/a.zip/b.tif", "/vsicurl/http://a/b.tif",
        "GTIFF_DIR:1:a.tif", "/dev/null", "<VRTDataset></VRTDataset>"}) {
    const auto got = read_all(name);
    ASSERT_FALSE(got) << name;
    EXPECT_EQ(got.error().code, Errc::not_found) << name;
  }
}

/// A little-endian GeoTIFF header, by hand: `side` x `side` floats in strips of so many rows, of
/// which one has a place, and is not there.
std::string tiff_of_strips(std::uint32_t side, std::uint32_t rows) {
  std::string bytes("II*\0\10\0\0\0", 8);
  const auto put = [&](std::uint32_t value, int size) {
    for (int i = 0; i < size; ++i) bytes += char(value >> (8 * i));
  };
  const std::array<std::array<std::uint32_t, 2>, 10> tags = {{{256, side},
                                                              {257, side},
                                                              {258, 32},
                                                              {259, 8},
                                                              {262, 1},
                                                              {273, 200},
                                                              {277, 1},
                                                              {278, rows},
                                                              {279, 1000},
                                                              {339, 3}}};
  put(tags.size(), 2);
  for (const auto& [tag, value] : tags) {
    put(tag, 2);
    put(4, 2);
    put(1, 4);
    put(value, 4);
  }
  put(0, 4);
  return bytes + std::string(2000, '\0');
}

TEST(DemHostile, APipeBesideARasterIsNotWaitedFor) {
  const test::TempDir dir;
  for (const char* name : {"a.prj", "a.asc.aux.xml", "a.asc.ovr", "a.asc.msk"}) {
    std::ofstream(dir.file("a.asc")) << "ncols 2\nnrows 2\nxllcorner 7\nyllcorner 46\n"
                                        "cellsize 0.01\n1 2\n3 4\n";
    ASSERT_EQ(::mkfifo(dir.file(name).c_str(), 0600), 0);
    const auto refused = DemSource::open(std::vector{dir.file("a.asc")});
    ASSERT_FALSE(refused) << name;
    EXPECT_THAT(refused.error().what, HasSubstr(name));
    std::filesystem::remove(dir.file(name));
    EXPECT_TRUE(DemSource::open(std::vector{dir.file("a.asc")})) << name;
  }
}

TEST(DemHostile, OneEnormousBlockIsRefusedBeforeItIsDecoded) {
  const test::TempDir folder;
  write(folder.file("bomb.tif"), tiff_of_strips(20000, 20000));
  const auto got = read_all(folder.file("bomb.tif"));
  ASSERT_FALSE(got);
  EXPECT_EQ(got.error().code, Errc::out_of_range) << got.error().what;
  EXPECT_THAT(got.error().what, HasSubstr("TILED=YES"));
}

TEST(DemHostile, MoreBlocksThanTheFileCanListAreRefused) {
  const test::TempDir folder;
  write(folder.file("vast.tif"), tiff_of_strips(700'000, 1));
  const auto got = DemSource::open(std::vector{folder.file("vast.tif")}, {});
  ASSERT_FALSE(got);
  EXPECT_EQ(got.error().code, Errc::bad_data);
  EXPECT_THAT(got.error().what, HasSubstr("700000 blocks, more than a file of"));
}

/// What counts is the TIFF, not the archive that it is packed in.
TEST(DemDamage, ManyStripsMayBePackedIntoFewBytes) {
  const test::TempDir folder;
  const std::string zip = folder.file("flat.tif.zip"), tif = folder.file("flat.tif");
  const std::string script =
      "/usr/bin/python3 -c \"from osgeo import gdal; import zipfile as z; f = "
      "gdal.GetDriverByName('GTiff').Create('" +
      tif +
      "', 60, 20000, 1, gdal.GDT_Int16, ['COMPRESS=DEFLATE', 'BLOCKYSIZE=1']); "
      "f.GetRasterBand(1).Fill(100); del f; z.ZipFile('" +
      zip + "', 'w', z.ZIP_DEFLATED).write('" + tif + "', 'flat.tif')\"";
  ASSERT_EQ(std::system(script.c_str()), 0);
  ASSERT_LT(std::filesystem::file_size(zip), 2u * 20'000);
  for (const std::string& path : {tif, zip}) {
    const auto dem = DemSource::open(std::vector{path}, {});
    ASSERT_TRUE(dem) << dem.error().what;
    EXPECT_EQ((*dem)->info().rows, 20'000);
  }
}

TEST(DemHostile, PicturesAreNotDems) {
  TIND_NEEDS_SHARED_DATA(path, "dem/rainier_terrainrgb_512_z10-165-360.png");
  const auto got = read_all(path);
  ASSERT_FALSE(got);
  EXPECT_THAT(got.error().what, HasSubstr("4 bands"));
}

}  // namespace
}  // namespace tind
