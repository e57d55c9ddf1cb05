// What a raster's bands and numbers mean, where a person says it; formats of raw numbers; folders
// and lists of files.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>

#include "terrain/raster/dem_files.h"
#include "terrain/raster/dem_source.h"
#include "tests/support/support.h"

namespace tind {
namespace {

namespace fs = std::filesystem;
using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

constexpr char kWgs84[] =
    "GEOGCS[\"WGS 84\",DATUM[\"WGS_1984\",SPHEROID[\"WGS 84\",6378137,298.257223563]],"
    "PRIMEM[\"Greenwich\",0],UNIT[\"degree\",0.0174532925199433]]";

class DemReading : public testing::Test {
 protected:
  std::string write(const std::string& name, const std::string& bytes) {
    std::ofstream(folder_.file(name), std::ios::binary) << bytes;
    return folder_.file(name);
  }
  /// A raw raster of 3 columns and 2 rows, its header beside it. `header`: further lines.
  template <class T>
  std::string raw(const std::string& name, const std::vector<T>& numbers,
                  const std::string& header) {
    std::string bytes(numbers.size() * sizeof(T), '\0');
    std::memcpy(bytes.data(), numbers.data(), bytes.size());
    write(name.substr(0, name.rfind('.')) + ".hdr",
          "NROWS 2\nNCOLS 3\nULXMAP 10\nULYMAP 50\nXDIM 0.5\nYDIM 0.25\n" + header);
    return write(name, bytes);
  }
  test::TempDir folder_;
};

Result<std::shared_ptr<const DemSource>> open(const std::string& path,
                                              const DemOptions& options = {}) {
  return DemSource::open({&path, 1}, options);
}

/// All heights, row by row.
std::vector<float> heights(const std::string& path, const DemOptions& options = {}) {
  const auto source = open(path, options);
  EXPECT_TRUE(source) << (source ? "" : source.error().what);
  if (!source) return {};
  const auto grid = (*source)->read(0, 0, int((*source)->info().cols), int((*source)->info().rows));
  EXPECT_TRUE(grid) << (grid ? "" : grid.error().what);
  if (!grid) return {};
  return {grid->values().begin(), grid->values().end()};
}

const auto kVoid = testing::IsNan();
const std::string kInt16 = "NBITS 16\nPIXELTYPE SIGNEDINT\nBYTEORDER I\n";

// ---- raw numbers ----

TEST_F(DemReading, BilOfIntegers) {
  const std::string bil =
      raw<std::int16_t>("a.bil", {1, -2, 300, -9999, 5, 32000}, kInt16 + "NODATA -9999\n");
  write("a.prj", kWgs84);
  EXPECT_THAT(heights(bil), ElementsAre(1, -2, 300, kVoid, 5, 32000));
  const auto source = open(bil);
  const DemInfo& info = (*source)->info();
  EXPECT_EQ(info.driver, "EHdr");
  EXPECT_EQ(info.crs_kind, CrsKind::geographic);
  EXPECT_EQ(info.post_to_crs, (Affine{10, 0.5, 0, 50, 0, -0.25}));
  EXPECT_EQ(info.rounding_m, 0);
}

TEST_F(DemReading, FltOfFloats) {
  std::string bytes;
  for (const float z : {1.5f, -2.25f, 1e-3f, -9999.f, 4e3f, 5.f})
    bytes.append(reinterpret_cast<const char*>(&z), 4);
  write("f.hdr",
        "ncols 3\nnrows 2\nxllcorner 7\nyllcorner 46\ncellsize 0.1\nNODATA_value -9999\n"
        "byteorder LSBFIRST\n");
  EXPECT_THAT(heights(write("f.flt", bytes)), ElementsAre(1.5f, -2.25f, 1e-3f, kVoid, 4e3f, 5.f));
}

TEST_F(DemReading, RawNumbersThatEndTooSoonAreAnError) {
  const std::string bil = raw<std::int16_t>("a.bil", {1, 2, 3, 4, 5, 6}, kInt16);
  for (const unsigned size : {11u, 6u, 3u, 0u}) {
    fs::resize_file(bil, size);
    const auto source = open(bil);
    const auto grid = source ? (*source)->read(0, 0, 3, 2) : std::unexpected(source.error());
    ASSERT_FALSE(grid) << size;
    EXPECT_THAT(grid.error().what, HasSubstr("a.bil"));
  }
}

// ---- other formats ----

TEST_F(DemReading, ErdasImagine) {
  const std::string img = folder_.file("r.img"), tif = test::testdata("rainier.tif");
  const std::string script = "/usr/bin/python3 -c \"from osgeo import gdal; gdal.Translate('" +
                             img + "', '" + tif +
                             "', format='HFA', creationOptions=['COMPRESSED=YES'])\"";
  ASSERT_EQ(std::system(script.c_str()), 0);
  const std::vector<float> a = heights(img), b = heights(tif);
  ASSERT_EQ(a.size(), b.size());
  EXPECT_EQ(std::memcmp(a.data(), b.data(), a.size() * sizeof(float)), 0);
  EXPECT_EQ((*open(img))->info().driver, "HFA");
}

TEST_F(DemReading, ErdasImagineWithItsPostsInAnotherFile) {
  const std::string img = folder_.file("r.img"), tif = test::testdata("rainier.tif");
  const std::string script = "/usr/bin/python3 -c \"from osgeo import gdal; gdal.Translate('" +
                             img + "', '" + tif +
                             "', format='HFA', creationOptions=['USE_SPILL=YES'])\"";
  ASSERT_EQ(std::system(script.c_str()), 0);
  const std::vector<float> a = heights(img), b = heights(tif);
  ASSERT_EQ(a.size(), b.size());
  EXPECT_EQ(std::memcmp(a.data(), b.data(), a.size() * sizeof(float)), 0);
  const std::string spill = folder_.file("r.ige");
  for (const std::uintmax_t left :
       {fs::file_size(spill) - 1, fs::file_size(spill) / 2, 10ul, 0ul}) {
    fs::resize_file(spill, left);
    const auto cut = open(img);
    ASSERT_FALSE(cut) << "GDAL reads 0 behind the end: " << left;
    EXPECT_THAT(cut.error().what, HasSubstr("r.ige: is cut off"));
  }
}

TEST_F(DemReading, GeoTiffInAZip) {
  const std::string zip = folder_.file("r.tif.zip"), tif = test::testdata("rainier.tif");
  const std::string script = "/usr/bin/python3 -c \"import zipfile as z; f = z.ZipFile('" + zip +
                             "', 'w', z.ZIP_DEFLATED); f.write('" + tif +
                             "', 'd/r.tif'); f.writestr('readme', 'x')\"";
  ASSERT_EQ(std::system(script.c_str()), 0);
  const std::vector<float> a = heights(zip), b = heights(tif);
  ASSERT_EQ(a.size(), b.size());
  EXPECT_EQ(std::memcmp(a.data(), b.data(), a.size() * sizeof(float)), 0);
  std::fstream file(zip, std::ios::binary | std::ios::in | std::ios::out);
  file.seekp(5000);
  file.put('\0').put('\0').put('\0').put('\0');
  file.close();
  EXPECT_EQ(open(zip).error().code, Errc::bad_data);
}

// ---- bands ----

TEST_F(DemReading, TheBandThatWasNamed) {
  const std::string bsq = raw<std::int16_t>("b.bsq", {1, 2, 3, 4, 5, 6, 11, 12, 13, 14, 15, 16},
                                            kInt16 + "NBANDS 2\nLAYOUT BSQ\n");
  EXPECT_THAT(open(bsq).error().what, AllOf(HasSubstr("b.bsq"), HasSubstr("--band")));
  EXPECT_THAT(heights(bsq, {.band = 1}), ElementsAre(1, 2, 3, 4, 5, 6));
  EXPECT_THAT(heights(bsq, {.band = 2}), ElementsAre(11, 12, 13, 14, 15, 16));
  EXPECT_EQ(open(bsq, {.band = 3}).error().code, Errc::invalid_argument);
  EXPECT_NE((*open(bsq, {.band = 1}))->info().fingerprint,
            (*open(bsq, {.band = 2}))->info().fingerprint);
}

TEST_F(DemReading, ScaleAndOffsetInPlaceOfTheFiles) {
  const std::string bil = raw<std::int16_t>("a.bil", {0, 10, 20, -9999, 40, 50}, kInt16);
  const DemOptions told{.nodata = {-9999}, .scale = 0.1, .offset = 100.0};
  EXPECT_THAT(heights(bil, told), ElementsAre(100, 101, 102, kVoid, 104, 105));
  const auto source = open(bil, told);
  EXPECT_GT((*source)->info().rounding_m, 0);
  EXPECT_NE((*source)->info().fingerprint, (*open(bil, {.nodata = {-9999}}))->info().fingerprint);
  EXPECT_EQ((*source)->info().fingerprint, (*open(bil, told))->info().fingerprint);
}

TEST_F(DemReading, HeightsAsColours) {
  // By pixel: black, 0 m, 1234.5 m and so on; mapbox: (h + 10000) * 10.
  const std::vector<std::uint8_t> mapbox = {0, 0, 0, 1, 134, 160, 1, 182, 217,
                                            0, 0, 1, 3, 13,  64,  1, 134, 161};
  const std::string rgb = "NBITS 8\nNBANDS 3\nLAYOUT BIP\nBYTEORDER I\n";
  const std::string file = raw("m.bil", mapbox, rgb);
  EXPECT_THAT(open(file).error().what, HasSubstr("--encoding"));
  EXPECT_THAT(heights(file, {.encoding = HeightEncoding::mapbox}),
              ElementsAre(kVoid, 0, 1234.5f, float(-9999.9), 10000, float(0.1)));
  EXPECT_THAT(heights(file, {.nodata = {0}, .encoding = HeightEncoding::mapbox}),
              ElementsAre(kVoid, kVoid, 1234.5f, float(-9999.9), 10000, float(0.1)));
  // terrarium: (h + 32768) * 256.
  const std::vector<std::uint8_t> terrarium = {0,   0,   0,   128, 0, 0, 132, 210, 128,
                                               127, 255, 255, 128, 0, 1, 162, 137, 0};
  const std::string other = raw("t.bil", terrarium, rgb);
  EXPECT_THAT(heights(other, {.encoding = HeightEncoding::terrarium}),
              ElementsAre(kVoid, 0, 1234.5f, -1 / 256.f, 1 / 256.f, 8841));
  EXPECT_EQ((*open(other, {.encoding = HeightEncoding::terrarium}))->info().rounding_m, 0);
  // One band of bytes is not three.
  const std::string grey = raw<std::uint8_t>("g.bil", {1, 2, 3, 4, 5, 6}, "NBITS 8\nBYTEORDER I\n");
  EXPECT_EQ(open(grey, {.encoding = HeightEncoding::mapbox}).error().code, Errc::unsupported);
}

TEST_F(DemReading, TilesOfTerrainRgb) {
  TIND_NEEDS_SHARED_DATA(png, "dem/rainier_terrainrgb_512_z10-165-360.png");
  const std::vector<float> z = heights(png, {.encoding = HeightEncoding::mapbox});
  ASSERT_EQ(z.size(), 512u * 512);
  float low = 1e9, high = -1e9;
  for (const float h : z)
    if (!std::isnan(h)) low = std::min(low, h), high = std::max(high, h);
  EXPECT_GT(low, 300);
  EXPECT_LT(low, 700);
  EXPECT_GT(high, 4300);
  EXPECT_LT(high, 4400);
}

TEST_F(DemReading, AlphaOfZeroIsAVoid) {
  const std::vector<std::uint8_t> rgba = {1, 134, 160, 255, 1, 134, 160, 0, 1, 134, 170, 255,
                                          1, 134, 160, 255, 9, 9,   9,   0, 1, 134, 170, 1};
  const std::string bil = raw("rgba.bil", rgba, "NBITS 8\nNBANDS 4\nLAYOUT BIP\nBYTEORDER I\n");
  const std::string png = folder_.file("rgba.png");
  const std::string script = "/usr/bin/python3 -c \"from osgeo import gdal; gdal.Translate('" +
                             png + "', '" + bil + "', format='PNG')\"";
  ASSERT_EQ(std::system(script.c_str()), 0);
  EXPECT_THAT(heights(png, {.encoding = HeightEncoding::mapbox}),
              ElementsAre(0, kVoid, 1, 0, kVoid, 1));
}

TEST_F(DemReading, AlphaBesideFloatsIsAVoid) {
  const std::string tif = folder_.file("fa.tif");
  const std::string script =
      "/usr/bin/python3 -c \"from osgeo import gdal; import struct; "
      "d = gdal.GetDriverByName('GTiff').Create('" +
      tif +
      "', 3, 1, 2, gdal.GDT_Float32, ['ALPHA=YES']); "
      "d.GetRasterBand(1).WriteRaster(0, 0, 3, 1, struct.pack('3f', 5, 0, 6)); "
      "d.GetRasterBand(2).WriteRaster(0, 0, 3, 1, struct.pack('3f', 255, 0, 1))\"";
  ASSERT_EQ(std::system(script.c_str()), 0);
  EXPECT_THAT(heights(tif), ElementsAre(5, kVoid, 6));
}

TEST_F(DemReading, ColoursAmongMoreThanFourBandsAreNamed) {
  const std::string file = raw("m5.bil", std::vector<std::uint8_t>(30, 1),
                               "NBITS 8\nNBANDS 5\nLAYOUT BIP\nBYTEORDER I\n");
  const auto many = open(file, {.encoding = HeightEncoding::mapbox});
  ASSERT_FALSE(many);
  EXPECT_THAT(many.error().what, HasSubstr("--band"));
  EXPECT_TRUE(open(file, {.band = 2, .encoding = HeightEncoding::mapbox}));
}

// ---- where it is ----

TEST_F(DemReading, DepthsAreNotReadAsHeights) {
  const std::string bil = raw<std::int16_t>("a.bil", {1, 2, 3, 4, 5, 6}, kInt16);
  for (const char* crs : {"EPSG:4326+5715", "EPSG:4326+5861", "EPSG:4326+6358"}) {
    const auto depths = open(bil, {.crs = crs});
    ASSERT_FALSE(depths) << crs;
    EXPECT_EQ(depths.error().code, Errc::invalid_argument);
    EXPECT_THAT(depths.error().what, HasSubstr("counts downwards; say --scale -1")) << crs;
  }
  EXPECT_EQ(heights(bil, {.crs = "EPSG:4326+5715", .scale = -1.0})[1], -2);
}

TEST_F(DemReading, CoordinatesOutsideTheCrsAreAnError) {
  const std::string bil = raw<std::int16_t>("a.bil", {1, 2, 3, 4, 5, 6}, kInt16);
  for (const char* place : {"ULXMAP 500000\nULYMAP 5700000\n", "ULXMAP 10\nULYMAP 120\n",
                            "ULXMAP 500000\nULYMAP 50\n"}) {
    write("a.hdr", "NROWS 2\nNCOLS 3\nXDIM 0.5\nYDIM 0.25\n" + kInt16 + place);
    const auto nowhere = open(bil, {.crs = "EPSG:4326"});
    ASSERT_FALSE(nowhere) << place;
    EXPECT_EQ(nowhere.error().code, Errc::invalid_argument);
    EXPECT_THAT(nowhere.error().what, HasSubstr("outside of its CRS, WGS 84")) << place;
  }
  // The rim may be: rows that begin beyond the pole.
  write("a.hdr", "NROWS 2\nNCOLS 3\nXDIM 0.5\nYDIM 1\nULXMAP 10\nULYMAP 90.5\n" + kInt16);
  EXPECT_TRUE(open(bil, {.crs = "EPSG:4326"}));
}

TEST_F(DemReading, TheCrsThatWasNamed) {
  const std::string bil = raw<std::int16_t>("a.bil", {1, 2, 3, 4, 5, 6}, kInt16);
  EXPECT_EQ((*open(bil))->info().crs_kind, CrsKind::none);
  const auto told = open(bil, {.crs = "EPSG:4326"});
  ASSERT_TRUE(told) << told.error().what;
  EXPECT_EQ((*told)->info().crs_kind, CrsKind::geographic);
  EXPECT_NEAR((*told)->info().bounds.west, 10, 1e-12);
  EXPECT_NEAR((*told)->info().bounds.north, 50, 1e-12);
  EXPECT_THAT((*told)->info().warnings, IsEmpty());
  EXPECT_EQ((*open(bil, {.crs = "EPSG:4326+5773"}))->info().datum, VerticalDatum::egm96);
  for (const char* wrong :
       {"EPSG:999999", "nonsense", "EPSG:5773", "/etc/passwd", "https://example.org/a.prj"})
    EXPECT_EQ(open(bil, {.crs = wrong}).error().code, Errc::invalid_argument) << wrong;
}

TEST_F(DemReading, AnotherCrsThanTheFilesIsAWarning) {
  const std::string bil = raw<std::int16_t>("a.bil", {1, 2, 3, 4, 5, 6}, kInt16);
  write("a.prj", kWgs84);
  EXPECT_THAT((*open(bil, {.crs = "EPSG:4326"}))->info().warnings, IsEmpty());
  const auto source = open(bil, {.crs = "EPSG:4258"});
  ASSERT_TRUE(source) << source.error().what;
  EXPECT_THAT((*source)->info().warnings,
              ElementsAre(AllOf(HasSubstr("a.bil"), HasSubstr("WGS 84"), HasSubstr("ETRS89"),
                                HasSubstr("as --crs says"))));
  EXPECT_NE((*source)->info().fingerprint, (*open(bil))->info().fingerprint);
}

TEST_F(DemReading, TheFilesDatumStaysWhereTheNamedCrsHasNone) {
  const std::string rainier = test::testdata("rainier.tif");
  const auto source = open(rainier, {.crs = "EPSG:4269"});
  ASSERT_TRUE(source) << source.error().what;
  EXPECT_EQ((*source)->info().datum, (*open(rainier))->info().datum);
}

TEST_F(DemReading, ACrsGivesNoPlaceToARasterWithout) {
  TIND_NEEDS_SHARED_DATA(png, "dem/ps_height_1k.png");
  const auto nowhere = open(png, {.crs = "EPSG:4326"});
  ASSERT_FALSE(nowhere);
  EXPECT_EQ(nowhere.error().code, Errc::invalid_argument);
  EXPECT_THAT(nowhere.error().what,
              AllOf(HasSubstr("ps_height_1k.png"), HasSubstr("geotransform")));
}

TEST_F(DemReading, OneUnitAPixelFromZeroIsAPlaceWhereRowsGoDown) {
  const auto vrt = [&](const char* name, const char* step) {
    return write(name, std::string("<VRTDataset rasterXSize=\"3\" rasterYSize=\"2\"><SRS>") +
                           kWgs84 + "</SRS><GeoTransform>0, 1, 0, 0, 0, " + step +
                           "</GeoTransform><VRTRasterBand dataType=\"Int16\" "
                           "band=\"1\"/></VRTDataset>");
  };
  const auto place = open(vrt("a.vrt", "-1"), {.allow_vrt = true});
  ASSERT_TRUE(place) << place.error().what;
  EXPECT_TRUE((*place)->info().has_geotransform);
  EXPECT_EQ((*place)->info().crs_kind, CrsKind::geographic);
  EXPECT_EQ((*place)->info().post_to_crs, (Affine{.5, 1, 0, -.5, 0, -1}));
  const auto none = open(vrt("b.vrt", "1"), {.allow_vrt = true});
  ASSERT_TRUE(none) << none.error().what;
  EXPECT_FALSE((*none)->info().has_geotransform);
}

// ---- folders and lists ----

TEST_F(DemReading, AFolderStandsForItsRasters) {
  raw<std::int16_t>("b.bil", {1, 2, 3, 4, 5, 6}, kInt16);
  const std::string a = raw<std::int16_t>("A.BIL", {7, 8, 9, 10, 11, 12}, kInt16);
  write("A.hdr",
        "NROWS 2\nNCOLS 3\nULXMAP 11.5\nULYMAP 50\nXDIM 0.5\nYDIM 0.25\n" + kInt16);  // to the east
  write("README", "x"), write("preview.png", "no DEM"), write(".hidden.tif", "x");
  fs::create_directory(folder_.file("sub"));
  const std::string folder = folder_.path().string();
  const auto files = dem_files({&folder, 1}, {});
  ASSERT_TRUE(files) << files.error().what;
  EXPECT_THAT(files->files, ElementsAre(folder_.file("A.BIL"), folder_.file("b.bil")));
  EXPECT_THAT(files->warnings, ElementsAre(HasSubstr("3 of its 5")));
  EXPECT_TRUE(is_dem_folder(folder));
  EXPECT_THAT(heights(folder), ElementsAre(1, 2, 3, 7, 8, 9, 4, 5, 6, 10, 11, 12));
  EXPECT_EQ((*open(folder))->info().files.size(), 2u);
  EXPECT_THAT((*open(folder))->info().warnings, ElementsAre(HasSubstr("left out")));
}

TEST_F(DemReading, AFolderWithARasterThatCannotBeSeenIsNone) {
  raw<std::int16_t>("b.bil", {1, 2, 3, 4, 5, 6}, kInt16);
  const std::string folder = folder_.path().string(), link = folder_.file("a.tif");
  fs::create_symlink("nowhere", link);
  const auto nowhere = open(folder);
  ASSERT_FALSE(nowhere) << "half of the DEM would be gone";
  EXPECT_EQ(nowhere.error().code, Errc::not_found);
  EXPECT_THAT(nowhere.error().what, HasSubstr(link));
  EXPECT_TRUE(is_dem_folder(folder));
  fs::remove(link);
  fs::create_symlink("a.tif", link);  // round and round
  const auto round = open(folder);
  ASSERT_FALSE(round);
  EXPECT_EQ(round.error().code, Errc::io);
  fs::remove(link);
  EXPECT_TRUE(open(folder));
}

TEST_F(DemReading, FoldersThatAreNoDems) {
  const std::string folder = folder_.path().string();
  EXPECT_FALSE(is_dem_folder(folder));
  const auto empty = open(folder);
  EXPECT_EQ(empty.error().code, Errc::not_found);
  EXPECT_THAT(empty.error().what, AllOf(HasSubstr(folder), HasSubstr(".hgt")));
  raw<std::int16_t>("b.bil", {1, 2, 3, 4, 5, 6}, kInt16);
  EXPECT_TRUE(is_dem_folder(folder));
  write("layer.json", "{}");
  EXPECT_FALSE(is_dem_folder(folder));
  EXPECT_THAT(open(folder).error().what, HasSubstr("tiles"));
}

TEST_F(DemReading, AListOfFiles) {
  const std::string b = raw<std::int16_t>("b.bil", {1, 2, 3, 4, 5, 6}, kInt16),
                    c = raw<std::int16_t>("c.bil", {7, 8, 9, 10, 11, 12}, kInt16);
  const std::string list =
      "@" + write("list.txt", "\xef\xbb\xbf# two lines\r\n\r\n  c.bil \n" + b + "\n");
  const auto files = dem_files({&list, 1}, {});
  ASSERT_TRUE(files) << files.error().what;
  EXPECT_THAT(files->files, ElementsAre(c, b));
  EXPECT_TRUE(files->warnings.empty());
  EXPECT_THAT(heights(list), ElementsAre(7, 8, 9, 10, 11, 12));
  const std::string again = "@" + write("again.txt", "b.bil\nc.bil\n" + b + "\nb.bil\n");
  const auto once = dem_files({&again, 1}, {});
  ASSERT_TRUE(once) << once.error().what;
  EXPECT_THAT(once->files, ElementsAre(b, c));  // where they overlap, the first one counts
  EXPECT_EQ(once->warnings.size(), 1u);
  EXPECT_THAT(heights(again), ElementsAre(1, 2, 3, 4, 5, 6));
  const auto code = [&](const std::string& text) {
    const std::string name = "@" + write("other.txt", text);
    const auto got = dem_files({&name, 1}, {});
    return got ? Errc::internal : got.error().code;
  };
  EXPECT_EQ(code("# nothing\n\n"), Errc::not_found);
  EXPECT_EQ(code("b.bil\nmissing.tif\n"), Errc::not_found);
  EXPECT_EQ(code("@list.txt\n"), Errc::bad_data);
  EXPECT_EQ(code(std::string("b.bil\0\n", 7)), Errc::bad_data);
  EXPECT_EQ(open("@" + folder_.file("none.txt")).error().code, Errc::not_found);
}

}  // namespace
}  // namespace tind
