// Answers to EDR queries are what /elevation says of each place, and lie where the query says.

#include <algorithm>
#include <array>
#include <random>

#include "server/api/ogc/edr_places.h"
#include "terrain/dataset/dem_dataset.h"
#include "terrain/geo/geodesic_path.h"
#include "tests/server/api/ogc/ogc_fixture.h"
#include "tests/support/made_up_source.h"

namespace tind::api {
namespace {

const std::string kBase = "/collections/rainier/";

class Edr : public Ogc {
 protected:
  static const Json& values(const Json& coverage) {
    return coverage.at("ranges").at("height").at("values");
  }
  static const Json& axes(const Json& coverage) { return coverage.at("domain").at("axes"); }
  static double at(const Json& axis, std::size_t i) {
    const double first = axis["start"], last = axis["stop"];
    return first + (last - first) * double(i) / (axis["num"].get<double>() - 1);
  }
};

TEST_F(Edr, APositionHasItsHeight) {
  const Json one = json(kBase + "position?coords=POINT(-121.76%2046.85)");
  EXPECT_EQ(one["domain"]["domainType"], "Point");
  EXPECT_EQ(one["domain"]["axes"]["x"]["values"], Json::parse("[-121.76]"));
  EXPECT_EQ(values(one), Json::array({height(-121.76, 46.85)}));
  const Json many =
      json(kBase + "position?coords=MULTIPOINT((-121.76+46.85),(0+0))&parameter-name=height");
  EXPECT_EQ(many["domain"]["domainType"], "MultiPoint");
  EXPECT_EQ(values(many)[0], height(-121.76, 46.85));
  EXPECT_TRUE(values(many)[1].is_null()) << "outside";
  const Json turned = json(kBase + "position?coords=POINT(46.85%20-121.76)&crs=EPSG:4326");
  EXPECT_NEAR(values(turned)[0].get<double>(), values(one)[0].get<double>(), 1e-6);
  EXPECT_EQ(turned["domain"]["axes"]["x"]["values"][0], -121.76) << "x is east";
  EXPECT_EQ(turned["domain"]["referencing"][0]["coordinates"], Json::parse(R"(["y", "x"])"));
  const Json features = json(kBase + "position?coords=POINT(-121.76%2046.85)&f=GeoJSON");
  EXPECT_EQ(features["features"][0]["properties"]["height"], height(-121.76, 46.85));
  const HttpReply accepted =
      get(kBase + "position?coords=POINT(-121.76%2046.85)", "Accept: application/geo+json\r\n");
  EXPECT_EQ(accepted.headers.at("content-type"), "application/geo+json");
}

TEST_F(Edr, AnAreaHasItsRim) {
  catalog_.add("flat", *dem_dataset(std::make_shared<test::MadeUpSource>(HeightGrid(200, 200, 100),
                                                                         Geographic{-1, 1}, 0.01),
                                    {}));
  for (const auto& [west, south, east, north] :
       {std::array{"-0.48", "-0.45", "0.59", "0.36"}, std::array{"-0.59", "-0.29", "0.42", "0.13"},
        std::array{"0.1", "0.1", "0.3", "0.7"}}) {
    const auto corner = [](const char* x, const char* y) { return std::string(x) + "+" + y; };
    const Json area =
        json("/collections/flat/area?resolution-x=13&resolution-y=11&coords=POLYGON((" +
             corner(west, south) + "," + corner(east, south) + "," + corner(east, north) + "," +
             corner(west, north) + "," + corner(west, south) + "))");
    EXPECT_GT(values(area).size(), 50u);
    EXPECT_EQ(std::ranges::count(values(area), Json(nullptr)), 0) << west;
  }
}

TEST_F(Edr, OfTilesAloneTheMeshesAnswer) {
  const Json one = json("/collections/made-up/position?coords=POINT(7%2046)");
  EXPECT_TRUE(values(one)[0].is_number());
  const Json level = json(kBase + "position?coords=POINT(-121.76%2046.85)&surface=level=9");
  const Json said = json("/elevation/rainier?lon=-121.76&lat=46.85&surface=level=9");
  EXPECT_EQ(values(level)[0], said["height_m"]);
  EXPECT_EQ(level["tind:max_error_m"], said["max_error_m"]);
  EXPECT_FALSE(one.contains("tind:max_off_m")) << "there is no DEM to say it of";
  const Json line = json(kBase + "trajectory?coords=LINESTRING(-121.7+46.8,-121.69+46.81)");
  const Json mesh =
      json(kBase + "trajectory?coords=LINESTRING(-121.7+46.8,-121.69+46.81)&surface=level=9");
  const double off_m = mesh.at("tind:max_off_m");
  double seen = 0;
  for (std::size_t i = 0; i < values(line).size(); ++i)
    seen = std::max(seen, std::abs(values(mesh)[i].get<double>() - values(line)[i].get<double>()));
  EXPECT_GT(seen, 0);
  EXPECT_LE(seen, off_m);
}

TEST_F(Edr, ATrajectoryKeepsItsPlacesAndIsAsDenseAsThePosts) {
  const std::string line = "LINESTRING Z(-121.8 46.8 5,-121.75 46.85 6,-121.7 46.86 7)";
  std::string sent = line;
  for (char& c : sent)
    if (c == ' ') c = '+';
  const Json got = json(kBase + "trajectory?coords=" + sent);
  const Json& places = axes(got)["composite"]["values"];
  ASSERT_EQ(places.size(), values(got).size());
  bool middle = false;
  for (std::size_t i = 0; i < places.size(); ++i) {
    const double lon = places[i][0], lat = places[i][1];
    middle = middle || (std::abs(lon + 121.75) < 1e-9 && std::abs(lat - 46.85) < 1e-9);
    if (i % 20 == 0) {
      EXPECT_EQ(values(got)[i], height(lon, lat));
    }
    if (i == 0) continue;
    const std::array<Geographic, 2> step = {{{places[i - 1][0], places[i - 1][1]}, {lon, lat}}};
    EXPECT_LT(GeodesicPath(step).length_m(), 95) << "posts are 3 arc seconds apart";
  }
  EXPECT_TRUE(middle);
  const Json few = json(kBase + "trajectory?coords=" + sent + "&resolution-x=7&f=GeoJSON");
  EXPECT_EQ(few["features"][0]["geometry"]["coordinates"].size(), 7u);
  EXPECT_EQ(few["features"][0]["geometry"]["coordinates"][0].size(), 3u);
}

TEST_F(Edr, ATrajectoryOverAVoidHasItsHeightsBesideIt) {
  // From inside the DEM to the west of it.
  const Json got = json(kBase +
                        "trajectory?coords=LINESTRING(-121.95+46.85,-122.2+46.85)&resolution-x=9"
                        "&f=GeoJSON");
  const Json& line = got["features"][0];
  const Json &places = line["geometry"]["coordinates"], &heights = line["properties"]["height"];
  ASSERT_EQ(places.size(), 9u);
  ASSERT_EQ(heights.size(), 9u);
  for (std::size_t i = 0; i < 9; ++i) {
    EXPECT_EQ(places[i].size(), 2u) << "among others of three numbers it would be of height 0";
    EXPECT_EQ(heights[i].is_null(), height(places[i][0], places[i][1]).is_null()) << i;
  }
  EXPECT_TRUE(heights[0].is_number());
  EXPECT_TRUE(heights[8].is_null());
}

TEST_F(Edr, ACorridorIsAsWideAsItSays) {
  const Json got =
      json(kBase +
           "corridor?coords=LINESTRING(-121.8+46.8,-121.7+46.8)&corridor-width=2&width-units=km"
           "&corridor-height=1&height-units=m&resolution-x=5&resolution-y=3");
  const Json& places = axes(got)["composite"]["values"];
  ASSERT_EQ(places.size(), 15u);
  for (std::size_t i = 0; i < 5; ++i) {
    const auto place = [&](std::size_t j) {
      return Geographic{places[3 * i + j][0], places[3 * i + j][1]};
    };
    const std::array<Geographic, 2> across = {{place(0), place(2)}};
    EXPECT_NEAR(GeodesicPath(across).length_m(), 2000, 1e-3);
    EXPECT_GT(place(0).lat, place(2).lat) << "from the left to the right, looking east";
    EXPECT_EQ(values(got)[3 * i + 1], height(place(1).lon, place(1).lat));
  }
}

TEST_F(Edr, AnAreaHasHeightsInsideAlone) {
  const Json got = json(kBase +
                        "area?coords=POLYGON((-121.8+46.8,-121.7+46.8,-121.7+46.9,-121.8+46.8),"
                        "(-121.74+46.81,-121.73+46.81,-121.73+46.82,-121.74+46.81))");
  const Json &x = axes(got)["x"], &y = axes(got)["y"];
  EXPECT_EQ(x["start"], -121.8);
  EXPECT_EQ(y["start"], 46.9) << "from the north";
  const std::size_t cols = x["num"], rows = y["num"];
  ASSERT_EQ(values(got).size(), cols * rows);
  EXPECT_LE(cols * rows, 100'000u);
  const Json all =
      json(kBase + "cube?bbox=-121.8,46.8,-121.7,46.9&resolution-x=" + std::to_string(cols) +
           "&resolution-y=" + std::to_string(rows));
  ASSERT_EQ(values(all).size(), values(got).size());
  std::size_t inside = 0;
  for (std::size_t i = 0; i < cols * rows; ++i) {
    const double lon = at(x, i % cols), lat = at(y, i / cols), east = lon + 121.8;
    const bool in = lat - 46.8 <= east &&
                    !(lon > -121.74 && lon < -121.73 && lat > 46.81 && lat - 46.81 < lon + 121.74);
    const bool on_rim = std::abs(lat - 46.8 - east) < 1e-9;
    inside += in;
    EXPECT_TRUE(on_rim || values(got)[i] == (in ? values(all)[i] : Json())) << lon << " " << lat;
    if (i % 997 == 0) {
      EXPECT_EQ(values(all)[i], height(lon, lat));
    }
  }
  EXPECT_GT(inside, cols * rows / 3);
}

TEST_F(Edr, ACubeIsAGridInWhicheverSystem) {
  const Json got =
      json(kBase +
           "cube?bbox=590000,5185000,600000,5195000&crs=EPSG:32610&resolution-x=11&resolution-y=6");
  EXPECT_EQ(got["domain"]["referencing"][0]["system"]["type"], "ProjectedCRS");
  EXPECT_EQ(got["ranges"]["height"]["shape"], Json::parse("[6, 11]"));
  const Json one = json("/elevation/rainier?crs=EPSG:32610&coords=592000,5195000");
  EXPECT_NEAR(values(got)[2].get<double>(), one["height_m"].get<double>(), 1e-6);
  const Json native = json(kBase + "cube?bbox=-121.8,46.8,100,-121.7,46.9,9000&z=500");
  EXPECT_GT(values(native).size(), 10'000u);
  EXPECT_LE(values(native).size(), 100'000u);
}

TEST_F(Edr, WhatIsWrongNamesItsParameter) {
  const std::string corridor =
      "corridor?coords=LINESTRING(1+2,3+4)&corridor-width=1&width-units=m&corridor-height=1";
  struct Case {
    std::string query, parameter;
  };
  for (const Case& c :
       {Case{"position", "coords"},
        Case{"position?coords=1,2", "coords"},
        Case{"position?coords=LINESTRING(1+2,3+4)", "coords"},
        Case{"position?coords=POINT(1+2)&crs=EPSG:99999", "crs"},
        Case{"position?coords=POINT(1+2)&crs=file", "crs"},
        Case{"position?coords=POINT(1+95)", "coords"},
        Case{"position?coords=POINT(1+2)&parameter-name=wind", "parameter-name"},
        Case{"position?coords=POINT(1+2)&f=csv", "f"},
        Case{"position?coords=POINT(1+2)&datum=egm", "datum"},
        Case{"position?coords=POINT(1+2)&unknown=1", "unknown"},
        Case{"trajectory", "coords"},
        Case{"trajectory?coords=POINT(1+2)", "coords"},
        Case{"trajectory?coords=LINESTRING(1+2,1+2)", "coords"},
        Case{"trajectory?coords=LINESTRINGZ(1+2+3,3+4+5)&z=3", "z"},
        Case{"trajectory?coords=LINESTRING(1+2,3+4)&resolution-x=1", "resolution-x"},
        Case{"trajectory?coords=LINESTRING(1+2,3+4)&resolution-x=100001", "resolution-x"},
        Case{corridor, "height-units"},
        Case{corridor + "&height-units=parsec", "height-units"},
        Case{"corridor?coords=LINESTRING(1+2,3+4)", "corridor-width"},
        Case{corridor + "&height-units=m&resolution-x=1000&resolution-y=1000", "resolution-x"},
        Case{"area", "coords"},
        Case{"area?coords=POLYGON((1+2,3+4,5+6,1+2.5))", "coords"},
        Case{"area?coords=POLYGON((1+2,3+2,5+2,1+2))", "coords"},
        Case{"cube", "bbox"},
        Case{"cube?bbox=1,2,3", "bbox"},
        Case{"cube?bbox=1,4,3,2", "bbox"},
        Case{"cube?bbox=1,2,3,nan", "bbox"},
        Case{"cube?bbox=1,2,3,4&resolution-x=1000&resolution-y=1000", "resolution-x"}})
    expect_wrong(kBase + c.query, c.parameter);
  EXPECT_EQ(get("/collections/none/position?coords=POINT(1+2)").status, 404);
}

TEST_F(Edr, TheAntimeridianIsAPlaceLikeAnyOther) {
  const std::string path = dir_.file("fiji.asc");
  std::ofstream asc(path);
  asc << "ncols 31\nnrows 21\nxllcenter 179.9\nyllcenter -18\ncellsize 0.01\nNODATA_value -9999\n";
  for (int row = 0; row < 21; ++row)
    for (int col = 0; col < 31; ++col) asc << 100 * row + col << (col < 30 ? " " : "\n");
  asc.close();
  std::ofstream(dir_.file("fiji.prj"))
      << R"(GEOGCS["WGS 84",DATUM["WGS_1984",SPHEROID["WGS 84",6378137,298.257223563]],)"
      << R"(PRIMEM["Greenwich",0],UNIT["degree",0.0174532925199433]])";
  ASSERT_TRUE(services::open_dataset(catalog_, {"fiji", {path}}, {}, {}));
  const std::string fiji = "/collections/fiji";
  const Json box = json(fiji)["extent"]["spatial"]["bbox"][0];
  EXPECT_NEAR(box[0].get<double>(), 179.9, 1e-9);
  EXPECT_NEAR(box[2].get<double>(), -179.8, 1e-9) << "west is greater than east";
  for (const char* lon : {"-179.9", "180.1", "-539.9"})  // column 20 of row 0
    EXPECT_NEAR(values(json(fiji + "/position?coords=POINT(" + lon + "+-17.8)"))[0].get<double>(),
                20, 1e-3);
  const Json cube =
      json(fiji + "/cube?bbox=179.95,-18,-179.85,-17.8&resolution-x=21&resolution-y=21");
  EXPECT_NEAR(axes(cube)["x"]["stop"].get<double>(), 180.15, 1e-9);
  const Json raster = json(fiji + "/coverage?f=covjson")["ranges"]["height"];
  ASSERT_EQ(raster["shape"], Json::parse("[21, 31]")) << "its own posts";
  for (std::size_t row = 0; row < 21; ++row)
    for (std::size_t col = 0; col < 21; ++col) {
      EXPECT_NEAR(values(cube)[row * 21 + col].get<double>(), double(100 * row + col + 5), 1e-2);
      EXPECT_NEAR(raster["values"][row * 31 + col].get<double>(), double(100 * row + col), 1e-2);
    }
  // A line goes on in CoverageJSON, and is cut in GeoJSON (RFC 7946, section 3.1.9).
  const std::string line =
      fiji + "/trajectory?coords=LINESTRING(179.95+-17.9,-179.85+-17.9)&resolution-x=9";
  const Json goes_on = json(line);
  const Json& at = goes_on["domain"]["axes"]["composite"]["values"];
  ASSERT_EQ(at.size(), 9u);
  for (std::size_t i = 0; i < 9; ++i)
    EXPECT_NEAR(at[i][0].get<double>(), 179.95 + .2 * double(i) / 8, 1e-4) << i;
  const Json cut = json(line + "&f=GeoJSON")["features"][0]["geometry"];
  EXPECT_EQ(cut["type"], "MultiLineString");
  ASSERT_EQ(cut["coordinates"].size(), 2u);
  const Json &before = cut["coordinates"][0], &behind = cut["coordinates"][1];
  EXPECT_EQ(before.size() + behind.size(), 11u);
  EXPECT_EQ(before.back()[0], 180);
  EXPECT_EQ(behind[0][0], -180);
  EXPECT_EQ(before.back()[1], behind[0][1]);
  EXPECT_EQ(before.back()[2], behind[0][2]);
  EXPECT_NEAR(before.back()[2].get<double>(), 1010, 1);
  for (const Json& p : behind) EXPECT_LT(p[0].get<double>(), -179.8);
  // Its coverage in Web Mercator is as wide as in degrees.
  const Json mercator = json(fiji + "/coverage?f=covjson&crs=EPSG:3857&width=31&height=21");
  const Json& x = axes(mercator)["x"];
  EXPECT_LT(x["stop"].get<double>() - x["start"].get<double>(), 36000) << x;
  for (const Json& value : values(mercator)) EXPECT_TRUE(value.is_number());
}

TEST(EdrArea, SpansAreWhatTheEvenOddRuleSays) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> anywhere(0, 10);
  for (int round = 0; round < 300; ++round) {
    std::vector<std::vector<Vec2>> rings(1 + random() % 2);
    for (auto& ring : rings) {
      for (unsigned i = 0; i < 3 + random() % 9; ++i)
        ring.push_back({std::floor(anywhere(random)), std::floor(anywhere(random))});
      ring.push_back(ring.front());
    }
    for (int n = 0; n < 30; ++n) {
      const Vec2 p{anywhere(random), anywhere(random)};
      bool inside = false;  // by a ray to the east
      for (const auto& ring : rings)
        for (std::size_t i = 1; i < ring.size(); ++i) {
          const Vec2 &a = ring[i - 1], &b = ring[i];
          if ((a.y > p.y) != (b.y > p.y) && p.x < a.x + (p.y - a.y) / (b.y - a.y) * (b.x - a.x))
            inside = !inside;
        }
      bool in_span = false;
      for (const auto& [first, last] : ogc::spans_inside(rings, p.y))
        in_span = in_span || (p.x >= first && p.x <= last);
      EXPECT_EQ(in_span, inside);
    }
  }
}

}  // namespace
}  // namespace tind::api
