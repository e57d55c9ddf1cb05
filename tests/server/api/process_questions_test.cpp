// What else processes make and answer: rasters, lines, volumes, comparisons, meshes that are sent.

#include <algorithm>
#include <filesystem>
#include <iterator>
#include <map>
#include <set>

#include "proto/base64.h"
#include "proto/mesh/mesh_io.h"
#include "server/api/processes/dem_inputs.h"
#include "server/api/processes/process.h"
#include "terrain/mesh/mesh_file.h"
#include "tests/server/api/processes_fixture.h"

namespace tind::api {
namespace {

TEST_F(ProcessesApi, RastersAndLinesOfAnArea) {
  const auto run = [&](const std::string& id, const std::string& more) {
    const HttpReply reply =
        post("/processes/" + id + "/execution",
             inputs(R"("bbox": [-121.8, 46.8, -121.7, 46.9])" + (more.empty() ? "" : ", " + more)));
    EXPECT_EQ(reply.status, 200) << id << reply.body;
    return reply;
  };
  for (const char* const id : {"slope", "aspect", "hillshade", "roughness", "tri", "tpi"})
    EXPECT_TRUE(run(id, "").body.starts_with("II*")) << id;
  EXPECT_TRUE(run("slope", R"("format": "asc", "unit": "percent")").body.starts_with("ncols"));
  EXPECT_TRUE(run("relief", R"("low": 1000)").body.starts_with("II*"));
  EXPECT_TRUE(run("relief", R"("format": "png")").body.starts_with("\x89PNG"));
  const HttpReply lines = run("contours", R"("interval": 200, "format": "geojson")");
  EXPECT_EQ(lines.headers.at("content-type"), "application/geo+json");
  const Json json = Json::parse(lines.body);
  ASSERT_GT(json["features"].size(), 5u);
  for (const Json& feature : json["features"]) {
    const double height = feature["properties"]["height_m"];
    EXPECT_EQ(std::fmod(height, 200), 0);
    EXPECT_EQ(feature["geometry"]["coordinates"][0][2], height);
  }
  const HttpReply band =
      run("contours", R"("interval": 200, "as_band": true, "max_error": 10, "format": "geojson")");
  const Json areas = Json::parse(band.body);
  ASSERT_GT(areas["features"].size(), 5u);
  for (const Json& feature : areas["features"]) {
    EXPECT_EQ(std::fmod(feature["properties"]["height_m"].get<double>(), 200), 0);
    EXPECT_GE(feature["properties"]["error_m"], 5);
    EXPECT_LE(feature["properties"]["error_m"], 10.001);
    EXPECT_EQ(feature["geometry"]["type"], "Polygon");
  }
  expect_refused("/processes/contours/execution",
                 {{inputs(R"("interval": 10, "as_band": true)"), "inputs.max_error"},
                  {inputs(R"("interval": 10, "max_error": 2)"), "inputs.max_error"},
                  {inputs(R"("interval": 10, "as_band": 1)"), "inputs.as_band"},
                  {inputs(R"("base": 1)"), "inputs.interval"},
                  {inputs(R"("interval": 10, "levels": [1])"), "inputs.interval"},
                  {inputs(R"("levels": ["1 --output=x"])"), "inputs.levels"}});
  expect_refused("/processes/hillshade/execution",
                 {{inputs(R"("azimuth": 400)"), "inputs.azimuth"}});
}

TEST_F(ProcessesApi, HeightsAlongALineAndWhatIsSeen) {
  const auto run = [&](const std::string& id, const std::string& more) {
    const HttpReply reply = post("/processes/" + id + "/execution", inputs(more));
    EXPECT_EQ(reply.status, 200) << id << reply.body;
    return reply;
  };
  const std::string line = R"("line": [[-121.9, 46.75], [-121.7, 46.8]])";
  EXPECT_TRUE(
      run("profile", line).body.starts_with("distance_m,lon,lat,height_m,coverage\n0.0000"));
  const Json sampled = Json::parse(
      run("profile", line + R"(, "samples": 7, "format": "json", "datum": "egm96")").body);
  ASSERT_EQ(sampled["points"].size(), 7u);
  EXPECT_EQ(sampled["datum"], "egm96");
  const Json sight = Json::parse(
      run("line-of-sight",
          R"("from": [594000, 5185000], "to": [596000, 5187000], "crs": "EPSG:32610", "uncertainty": 2)")
          .body);
  EXPECT_NEAR(sight["length_m"], 2828, 400);
  EXPECT_EQ(sight["uncertainty_m"], 2);
  EXPECT_TRUE(sight["nearest"]["clearance_m"].is_number());
  EXPECT_TRUE(run("viewshed", R"("from": [-121.7, 46.8], "radius": 2000)").body.starts_with("II*"));
  expect_refused("/processes/profile/execution",
                 {{inputs(R"("samples": 3)"), "inputs.line"},
                  {inputs(R"("line": [[1, 2]])"), "inputs.line"},
                  {inputs(R"("line": [[1, 2], [1, "2 --output=x"]])"), "inputs.line"},
                  {inputs(line + R"(, "samples": 3, "step": 4)"), "inputs.step"},
                  {inputs(line + R"(, "samples": 2.5)"), "inputs.samples"}});
  expect_refused(
      "/processes/line-of-sight/execution",
      {{inputs(R"("from": [1, 2])"), "inputs.to"},
       {inputs(R"("from": [1, 2], "to": [1, 2], "refraction": 3)"), "inputs.refraction"}});
}

TEST_F(ProcessesApi, ALevelIsAskedAsItsTilesAre) {
  const test::TempDir dir;
  const std::string dem = test::testdata("rainier.tif"), built = dir.file("tiles");
  ASSERT_EQ(test::run_tind("build " + dem + " --levels 0-9 --progress none -o " + built).code, 0);
  const auto run = [&](const std::string& id, const std::string& more) {
    const HttpReply reply = post("/processes/" + id + "/execution", inputs(more));
    EXPECT_EQ(reply.status, 200) << id << reply.body;
    return Json::parse(reply.body, nullptr, false);
  };
  const auto same = [&](Json served, const std::string& command) {
    const auto ran = test::run_tind(command + " --tiles " + built + " --level 9");
    EXPECT_EQ(ran.code, 0) << ran.out;
    Json local = Json::parse(ran.answer, nullptr, false);
    for (Json* one : {&served, &local}) one->erase("input");
    EXPECT_EQ(served, local);
  };
  // The tiles that a batch makes, and the DEM between what their error allows.
  const Json band =
      run("profile", R"("line": [[-121.9, 46.75], [-121.7, 46.8]], "level": 9, "format": "json")");
  same(band, "profile " + dem + R"( --line "-121.9,46.75 -121.7,46.8" --format json)");
  const Json exact =
      run("profile", R"("line": [[-121.9, 46.75], [-121.7, 46.8]], "samples": 50, "format": "json",
                    "datum": "ellipsoid")");
  const Json seen = run("profile", R"("line": [[-121.9, 46.75], [-121.7, 46.8]], "samples": 50,
                                      "format": "json", "level": 9)");
  EXPECT_EQ(seen["datum"], "ellipsoid");
  double farthest = 0;
  for (std::size_t i = 0; i < 50; ++i) {
    if (exact["points"][i]["height_m"].is_null()) continue;
    const double height = exact["points"][i]["height_m"];
    EXPECT_LE(seen["points"][i]["low_m"], height);
    EXPECT_GE(seen["points"][i]["high_m"], height);
    farthest = std::max(farthest, std::abs(seen["points"][i]["height_m"].get<double>() - height));
  }
  EXPECT_GT(farthest, 1);  // it is not the DEM that was asked

  const std::string ends = R"("from": [-121.8, 46.8], "to": [-121.7, 46.9], "from_height": 40)";
  const Json sight = run("line-of-sight", ends + R"(, "level": 9, "uncertainty": 1)");
  EXPECT_GT(sight["uncertainty_m"], 2);
  same(sight, "line-of-sight " + dem +
                  " --from=-121.8,46.8 --to=-121.7,46.9 --from-height 40 --uncertainty 1 --json");
  const Json volume = run("volume", R"("height": 1500, "level": 9,
                                       "bbox": [-121.8, 46.75, -121.78, 46.76])");
  EXPECT_LT(volume["cut"]["low_m3"], volume["cut"]["high_m3"]);
  EXPECT_EQ(volume["datum"], "ellipsoid");
  const Json areas = run("contours", R"("interval": 500, "as_band": true, "level": 9,
                                        "bbox": [-121.8, 46.75, -121.78, 46.76],
                                        "format": "geojson")");
  EXPECT_GT(areas["features"].size(), 0u);
  EXPECT_TRUE(post("/processes/viewshed/execution",
                   inputs(R"("from": [-121.7, 46.8], "radius": 1000, "level": 9)"))
                  .body.starts_with("II*"));

  expect_refused("/processes/line-of-sight/execution",
                 {{inputs(ends + R"(, "level": 25)"), "inputs.level"},
                  {inputs(ends + R"(, "level": 2.5)"), "inputs.level"},
                  {inputs(ends + R"(, "level": "9 --json")"), "inputs.level"}});
  expect_refused("/processes/volume/execution",
                 {{inputs(R"("height": 1, "level": 9, "datum": "egm96")"), "inputs.datum"}});
  expect_refused("/processes/contours/execution",
                 {{inputs(R"("interval": 9, "level": 9)"), "inputs.level"},
                  {inputs(R"("interval": 9, "as_band": true, "level": 9, "max_error": 2)"),
                   "inputs.max_error"}});
  // What a level says of one DEM it says of no other.
  ASSERT_TRUE(services::open_dataset(
      catalog_, {"two", {test::testdata("rainier.tif"), test::testdata("bigtujunga_crop.tif")}}, {},
      {}));
  const std::string of_two = R"({"inputs": {"dataset": "two", "layer": "rainier", )" + ends;
  expect_refused("/processes/line-of-sight/execution",
                 {{of_two + R"(, "level": 9}})", "inputs.level"}});
}

/// Else a key of other datasets could ask by it.
TEST(Processes, EveryInputThatIsADatasetIsHeldAgainstTheKey) {
  std::set<std::string> named;
  for (const Process& process : processes()) {
    const auto inputs = process.inputs();
    for (const auto& [name, input] : inputs.items())
      if (input.at("title").get<std::string>().starts_with("Dataset")) named.insert(name);
  }
  EXPECT_EQ(named, std::set<std::string>(std::begin(kDatasetInputs), std::end(kDatasetInputs)));
}

TEST_F(ProcessesApi, VolumesStatisticsAndDifferences) {
  const auto run = [&](const std::string& id, const std::string& more) {
    const HttpReply reply = post("/processes/" + id + "/execution", inputs(more));
    EXPECT_EQ(reply.status, 200) << id << reply.body;
    return reply.body;
  };
  const std::string ring = "[[[-121.8, 46.75], [-121.7, 46.75], [-121.75, 46.8], [-121.8, 46.75]]]";
  const std::string polygon = R"({"type": "Polygon", "coordinates": )" + ring + "}";
  const Json volume =
      Json::parse(run("volume", R"("height": 1500, "uncertainty": 1, "polygon": )" + polygon));
  EXPECT_GT(volume["cut"]["m3"], volume["cut"]["low_m3"]);
  EXPECT_LT(volume["cut"]["m3"], volume["cut"]["high_m3"]);
  EXPECT_NEAR(volume["area_m2"].get<double>() + volume["void_area_m2"].get<double>(),
              0.5 * 7636 * 5558, 1e5);
  const Json plane = Json::parse(
      run("volume", R"("plane": [[-121.8, 46.7, 0], [-121.7, 46.7, 0], [-121.7, 46.8, 0]],
                       "bbox": [-121.8, 46.75, -121.7, 46.8])"));
  EXPECT_EQ(plane["fill"]["m3"], 0);
  const std::string rows = run("statistics", R"("polygons": )" + polygon);
  EXPECT_TRUE(rows.starts_with("feature,posts,voids,min_m")) << rows;
  EXPECT_EQ(std::ranges::count(rows, '\n'), 2);
  const std::string named = R"({"type": "FeatureCollection", "features": [
      {"type": "Feature", "properties": {"name": "upper, \"lower\"", "area_m2": 7, "of": [1]},
       "geometry": )" + polygon +
                            "}]}";
  const std::string said = run("statistics", R"("polygons": )" + named);
  const auto head = said.substr(0, said.find('\n'));
  EXPECT_TRUE(head.ends_with(",beyond_dem,properties.area_m2,name")) << head;
  EXPECT_TRUE(said.ends_with(",7,\"upper, \"\"lower\"\"\"\n")) << said;
  const Json listed = Json::parse(run("statistics", R"("format": "json", "polygons": )" + named));
  EXPECT_EQ(listed["polygons"][0]["properties"],
            Json::parse(R"({"name": "upper, \"lower\"", "area_m2": 7})"));
  const Json same =
      Json::parse(run("volume", R"("against": "rainier", "bbox": [-121.8, 46.75, -121.7, 46.8])"));
  EXPECT_EQ(same["cut"]["m3"], 0);
  EXPECT_EQ(same["input"], Json::array({"rainier"}));
  EXPECT_EQ(same["against"], Json::array({"rainier"}));
  EXPECT_TRUE(run("difference", R"("less": "rainier", "bbox": [-121.8, 46.75, -121.7, 46.8])")
                  .starts_with("II*"));
  expect_refused("/processes/volume/execution",
                 {{inputs(R"("uncertainty": 1)"), "inputs.height"},
                  {inputs(R"("height": 1, "against": "rainier")"), "inputs.height"},
                  {inputs(R"("against": "/etc/passwd")"), "inputs.against"},
                  {inputs(R"("plane": [[1, 2, 3], [1, 2, 3], [1, 2]])"), "inputs.plane"}});
  std::string many;
  for (int i = 0; i <= 100; ++i) many += (i ? ", \"n" : "\"n") + std::to_string(i) + "\": 1";
  const std::string too_many = R"("polygons": {"type": "Feature", "properties": {)" + many +
                               R"(}, "geometry": )" + polygon + "}";
  expect_refused("/processes/statistics/execution", {{inputs(R"("base": 1)"), "inputs.polygons"},
                                                     {inputs(too_many), "inputs.polygons"}});
  expect_refused("/processes/difference/execution",
                 {{inputs(R"("format": "tif")"), "inputs.less"},
                  {inputs(R"("less": "rainier", "less_layer": "none")"), "inputs.less_layer"},
                  {inputs(R"("less_layer": "rainier")"), "inputs.less"}});
}

TEST_F(ProcessesApi, SeveralMethodsInOneTable) {
  const std::string where = R"("bbox": [-121.78, 46.84, -121.74, 46.87], )";
  const auto run = [&](const std::string& format) {
    const HttpReply reply =
        post("/processes/compare/execution",
             R"({"inputs": {"dataset": "rainier", )" + where + R"("format": ")" + format +
                 R"(", "methods": ["bounded", "vertex-removal:degree"], "ratio": [0.1, 0.07]},
                   "outputs": {"report": {}, "table": {}}})");
    EXPECT_EQ(reply.status, 200) << reply.body;
    EXPECT_EQ(reply.body.find("rainier.tif"), std::string::npos) << "no file of the server";
    return Json::parse(reply.body);
  };
  const Json results = run("csv");
  const Json table = results["report"]["value"]["table"];
  ASSERT_EQ(table.size(), 4u);
  EXPECT_EQ(table[1]["method"], "vertex-removal:degree");
  EXPECT_EQ(table[2]["stop"], "7%");
  EXPECT_GT(table[0]["triangles"], table[2]["triangles"]);
  EXPECT_EQ(results["report"]["value"]["input"], Json::array({"rainier"}));
  const HttpReply csv = get(results["table"]["href"]);
  EXPECT_TRUE(csv.body.starts_with("method,stop,triangles")) << csv.body;
  EXPECT_EQ(std::ranges::count(csv.body, '\n'), 5);
  const HttpReply page = get(run("html")["table"]["href"]);
  EXPECT_TRUE(page.headers.at("content-type").starts_with("text/html"));
  EXPECT_TRUE(page.headers.at("content-disposition").starts_with("attachment"));
  EXPECT_NE(page.body.find("<h1>Simplifying rainier</h1>"), std::string::npos);
  EXPECT_EQ(page.body.find("rainier.tif"), std::string::npos) << "no file of the server";
  expect_refused("/processes/compare/execution",
                 {{inputs(R"("methods": ["qem"])"), "inputs.max_error"},
                  {inputs(R"("max_error": 5)"), "inputs.max_error"},
                  {inputs(R"("max_error": [5], "ratio": [0.1])"), "inputs.max_error"},
                  {inputs(R"("ratio": [2])"), "inputs.ratio"},
                  {inputs(R"("triangles": [10.5])"), "inputs.triangles"},
                  {inputs(R"("max_error": [1,2,3,4,5,6,7,8,9])"), "inputs.max_error"},
                  {inputs(R"("max_error": [5], "methods": ["magic"])"), "inputs.methods"},
                  {inputs(R"("max_error": [5], "methods": ["qem,bounded"])"), "inputs.methods"},
                  {inputs(R"("max_error": [5], "methods": "qem")"), "inputs.methods"},
                  {inputs(R"("max_error": [5], "title": "x")"), "inputs.title"}});
}

/// 400 m a side, 10 m high in its middle.
constexpr const char* kPyramid =
    "v 0 0 0\nv 400 0 0\nv 400 400 0\nv 0 400 0\nv 200 200 10\n"
    "f 1 2 5\nf 2 3 5\nf 3 4 5\nf 4 1 5\n";

Json sent_obj(const std::string& text) {
  return {{"value", text}, {"mediaType", "model/obj"}, {"encoding", "utf-8"}};
}

TEST_F(ProcessesApi, MethodsAreComparedOnATinThatIsSent) {
  const Json given = {
      {"mesh", sent_obj(kPyramid)}, {"methods", {"greedy", "cluster"}}, {"max_error", {20, 5}}};
  const HttpReply reply = post("/processes/compare/execution", Json{{"inputs", given}}.dump());
  ASSERT_EQ(reply.status, 200) << reply.body;
  const Json report = Json::parse(reply.body);
  EXPECT_EQ(report["input_triangles"], 4);
  const Json& rows = report["table"];
  ASSERT_EQ(rows.size(), 4u);
  // Without the top the square is flat, and 10 m too low there.
  EXPECT_EQ(rows[0]["triangles"], 2);
  EXPECT_EQ(rows[0]["max_error_m"], 10);
  EXPECT_EQ(rows[2]["triangles"], 4);
  EXPECT_EQ(rows[2]["max_error_m"], 0);
  EXPECT_NE(rows[1]["failure"].get<std::string>().find("is for rasters"), std::string::npos);
  // Those that it can be compared by, where none is named.
  Json by_all = {{"inputs", {{"mesh", sent_obj(kPyramid)}, {"ratio", {0.5}}}}};
  const HttpReply all = post("/processes/compare/execution", by_all.dump());
  ASSERT_EQ(all.status, 200) << all.body;
  const Json by_all_made = Json::parse(all.body);
  for (const Json& row : by_all_made.at("table")) EXPECT_FALSE(row.contains("failure")) << row;
  const auto with = [&](const char* name, const Json& value) {
    Json inputs = given;
    inputs[name] = value;
    return Json{{"inputs", inputs}}.dump();
  };
  expect_refused("/processes/compare/execution", {{with("dataset", "rainier"), "inputs.dataset"},
                                                  {with("bbox", {1, 2, 3, 4}), "inputs.bbox"},
                                                  {with("datum", "ellipsoid"), "inputs.datum"},
                                                  {with("format", "html"), "inputs.format"},
                                                  {with("mesh", "/etc/passwd"), "inputs.mesh"},
                                                  {with("methods", {"magic"}), "inputs.methods"}});
  // What is no terrain is said to be none, by the name that the client knows.
  const HttpReply wall = post("/processes/compare/execution",
                              with("mesh", sent_obj("v 0 0 0\nv 1 0 0\nv 1 0 5\nf 1 2 3\n")));
  EXPECT_EQ(wall.status, 422) << wall.body;
  EXPECT_NE(wall.body.find("vertical face"), std::string::npos) << wall.body;
}

TEST_F(ProcessesApi, AMeshIsMeasuredOverATinThatIsSent) {
  const std::string flat = "v 0 0 0\nv 400 0 0\nv 400 400 0\nv 0 400 0\nf 1 2 3\nf 1 3 4\n";
  const Json given = {{"mesh", sent_obj(flat)}, {"terrain", sent_obj(kPyramid)}};
  const HttpReply reply = post("/processes/measure/execution", Json{{"inputs", given}}.dump());
  ASSERT_EQ(reply.status, 200) << reply.body;
  const Json report = Json::parse(reply.body);
  EXPECT_EQ(report["max_error_m"], 10);
  EXPECT_EQ(report["vertices_measured"], 5);
  EXPECT_NEAR(report["rms_error_m"].get<double>(), std::sqrt(100.0 / 5), 1e-9);
  const auto with = [&](const char* name, const Json& value) {
    Json inputs = given;
    inputs[name] = value;
    return Json{{"inputs", inputs}}.dump();
  };
  expect_refused("/processes/measure/execution",
                 {{with("dataset", "rainier"), "inputs.dataset"},
                  {with("frame", "metric"), "inputs.frame"},
                  {with("terrain", "/etc/passwd"), "inputs.terrain"},
                  {with("terrain", "bm9uZQ=="), "inputs.terrain_format"}});
}

/// As a string of JSON.
std::string json_text(const std::string& text) { return Json(text).dump(); }

TEST_F(ProcessesApi, AMeshThatIsSentIsMeasured) {
  const std::string box = R"("bbox": [-121.78, 46.84, -121.74, 46.87])";
  const auto measure = [&](const std::string& mesh) {
    return post("/processes/measure/execution", inputs(R"("mesh": )" + mesh + ", " + box));
  };
  std::map<std::string, std::string> files;
  for (const std::string format : {"ply", "obj", "stl", "2dm", "landxml"}) {
    // Of these, readers take x, y and z for one unit.
    const bool metric = format == "landxml" || format == "stl";
    const std::string frame =
        std::string(R"("frame": ")") + (metric ? "metric" : "source") + "\", ";
    const HttpReply made =
        execute(inputs(frame + box + R"(, "max_error": 10, "format": ")" + format + "\""));
    ASSERT_EQ(made.status, 200) << made.body;
    std::string encoded;
    proto::put_base64(encoded, made.body);
    files[format] = made.body;
    const HttpReply reply = post("/processes/measure/execution",
                                 inputs(R"("mesh": ")" + encoded + R"(", "mesh_format": ")" +
                                        format + "\", " + frame + box));
    ASSERT_EQ(reply.status, 200) << format << reply.body;
    const Json report = Json::parse(reply.body);
    EXPECT_LE(report["max_error_m"], format == "stl" ? 10.5 : 10.001) << format;
    EXPECT_GT(report["max_error_m"], 5) << format;
    EXPECT_EQ(report["dem"], Json::array({"rainier"}));
    EXPECT_EQ(report["input"], Json::array({"rainier"}));
  }
  const HttpReply text = measure(R"({"value": )" + json_text(files["obj"]) +
                                 R"(, "encoding": "utf-8", "mediaType": "model/obj"})");
  ASSERT_EQ(text.status, 200) << text.body;
  EXPECT_LE(Json::parse(text.body)["max_error_m"], 10.001);

  // What of the job's order is large, is gone when it has ended.
  const HttpReply accepted = [&] {
    HttpClient client(port());
    const std::string body = inputs(R"("mesh": {"value": )" + json_text(files["obj"]) +
                                    R"(, "encoding": "utf-8"}, "mesh_format": "obj", )" + box);
    client.send(
        "POST /processes/measure/execution HTTP/1.1\r\nHost: h\r\nPrefer: respond-async\r\n"
        "Content-Type: application/json\r\nContent-Length: " +
        std::to_string(body.size()) + "\r\n\r\n" + body);
    return client.receive();
  }();
  ASSERT_EQ(accepted.status, 201) << accepted.body;
  const std::string job = accepted.headers.at("location");
  ASSERT_EQ(wait_for(job)["status"], "successful");
  const auto kept = jobs_->find(job.substr(6));
  ASSERT_TRUE(kept && *kept);
  EXPECT_LT((*kept)->order->size(), 2000u);
  EXPECT_EQ(get_json(job + "/results")["dem"], Json::array({"rainier"}));

  // A file that names others reads none of them.
  const HttpReply names = measure(
      R"({"value": "mtllib ../../../../etc/passwd\nv -121.78 46.84 3000\nv -121.74 46.84 3000\nv -121.74 46.87 3000\nf 1 2 3\n",
          "encoding": "utf-8", "mediaType": "model/obj"})");
  EXPECT_EQ(names.status, 200) << names.body;
  const HttpReply broken = measure(R"({"value": "bm8gbWVzaA==", "mediaType": "model/obj"})");
  EXPECT_EQ(broken.status, 422) << broken.body;
  const HttpReply elsewhere = measure(
      R"({"value": "v 1 1 1\nv 2 1 1\nv 2 2 1\nf 1 2 3\n", "encoding": "utf-8", "mediaType": "model/obj"})");
  EXPECT_EQ(elsewhere.status, 422) << elsewhere.body;
  EXPECT_EQ(elsewhere.body.find("--"), std::string::npos) << elsewhere.body;
  expect_refused(
      "/processes/measure/execution",
      {{inputs(box), "inputs.mesh"},
       {inputs(R"("mesh": 1)"), "inputs.mesh"},
       {inputs(R"("mesh": "####", "mesh_format": "obj")"), "inputs.mesh"},
       {inputs(R"("mesh": "", "mesh_format": "obj")"), "inputs.mesh"},
       {inputs(R"("mesh": "AAAA")"), "inputs.mesh_format"},
       {inputs(R"("mesh": "AAAA", "mesh_format": "glb")"), "inputs.mesh_format"},
       {inputs(R"("mesh": {"value": "AAAA", "mediaType": "image/png"})"), "inputs.mesh.mediaType"},
       {inputs(R"("mesh": {"value": "AAAA", "encoding": "hex"})"), "inputs.mesh.encoding"},
       {inputs(R"("mesh": {"href": "http://x"})"), "inputs.mesh.value"},
       {inputs(R"("mesh": "AAAA", "mesh_format": "obj", "frame": "x")"), "inputs.frame"}});
}

TEST_F(ProcessesApi, AMeshIsFineInARegion) {
  const std::string window = R"("window": [-121.8, 46.82, -121.72, 46.89], )";
  const auto run = [&](const std::string& more) {
    return post("/processes/refine/execution",
                R"({"inputs": {"dataset": "rainier", "inside": 2, "outside": 60, )" + window +
                    more + R"(}, "outputs": {"mesh": {}, "report": {}}})");
  };
  for (const std::string region :
       {R"("bbox": [-121.77, 46.84, -121.75, 46.86])",
        R"("polygon": {"type": "Polygon", "coordinates": [[[-121.77, 46.84], [-121.75, 46.84],
            [-121.75, 46.86], [-121.77, 46.84]]]})",
        R"("route": [[-121.79, 46.84], [-121.73, 46.86]], "width": 300)"}) {
    const HttpReply reply = run(region);
    ASSERT_EQ(reply.status, 200) << region << reply.body;
    const Json report = Json::parse(reply.body)["report"]["value"];
    EXPECT_GT(report["inside"]["posts"], 50) << region;
    EXPECT_LE(report["inside"]["max_error_m"], 2) << region;
    EXPECT_LE(report["outside"]["max_error_m"], 60) << region;
    EXPECT_GT(report["outside"]["max_error_m"], 2) << region;
  }
  expect_refused(
      "/processes/refine/execution",
      {{inputs(R"("inside": 1)"), "inputs.bbox"},
       {inputs(R"("bbox": [1, 2, 3])"), "inputs.bbox"},
       {inputs(R"("bbox": [1, 2, 3, 4], "width": 4)"), "inputs.width"},
       {inputs(R"("route": [[1, 2], [3, 4]])"), "inputs.width"},
       {inputs(R"("bbox": [1, 2, 3, 4], "inside": 60)"), "inputs.inside"},
       {inputs(R"("bbox": [1, 2, 3, 4], "window": "all")"), "inputs.window"},
       {inputs(R"("polygon": {"type": "Polygon", "coordinates": []})"), "inputs.polygon"}});
}

}  // namespace
}  // namespace tind::api
