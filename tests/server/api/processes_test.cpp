// Processes and jobs as such, and meshes of areas.

#include <gmock/gmock.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <map>

#include "proto/base64.h"
#include "proto/mesh/mesh_io.h"
#include "terrain/mesh/mesh_file.h"
#include "tests/server/api/processes_fixture.h"
#include "tests/support/as_somebody_else.h"
#include "tests/support/srtm.h"

namespace tind::api {
namespace {

TEST_F(ProcessesApi, SayWhatTheyTake) {
  const Json list = get_json("/processes");
  ASSERT_EQ(list["processes"].size(), 18u);
  EXPECT_EQ(list["processes"][0]["id"], "simplify");
  const Json simplify = get_json("/processes/simplify");
  for (const char* const input : {"dataset", "max_error", "triangles", "ratio", "method", "bbox",
                                  "polygon", "crs", "format", "alpha", "effort"})
    EXPECT_TRUE(simplify["inputs"].contains(input)) << input;
  EXPECT_FALSE(simplify["inputs"].contains("drape"));
  EXPECT_EQ(simplify["inputs"]["dataset"]["minOccurs"], 0) << "a mesh can be sent instead";
  EXPECT_EQ(get_json("/processes/slope")["inputs"]["dataset"]["minOccurs"], 1);
  EXPECT_EQ(get("/processes/nothing").status, 404);
}

TEST_F(ProcessesApi, ArePagesForPeople) {
  const auto page = [&](const std::string& target) {
    const HttpReply reply = get(target);
    EXPECT_EQ(reply.headers.at("content-type"), "text/html; charset=utf-8") << target;
    EXPECT_EQ(reply.body.find("<script"), std::string::npos);
    return reply;
  };
  EXPECT_NE(page("/processes?f=html").body.find("<a href=\"/processes/simplify\">"),
            std::string::npos);
  const std::string slope = page("/processes/slope?f=html").body;
  EXPECT_NE(slope.find("<td>unit</td><td></td><td>degree, percent"), std::string::npos) << slope;
  const std::size_t outputs = slope.find("<h2>outputs</h2>");
  ASSERT_NE(outputs, std::string::npos);
  EXPECT_EQ(slope.find(">takes<", outputs), std::string::npos) << "an output takes nothing";
  EXPECT_NE(page("/jobs?f=html").body.find("None of yours"), std::string::npos);
  EXPECT_NE(get("/jobs?limit=1&status=successful&f=json")
                .body.find("/jobs?limit=1&status=successful&f=html"),
            std::string::npos)
      << "the same list in another form";
  EXPECT_EQ(get("/jobs?datetime=2026-02-28/..").status, 200);
  EXPECT_EQ(get("/jobs?datetime=2026-02-31/..").status, 400) << "no such day";
  const std::string job =
      execute(inputs(R"("max_error": 30)"), "Prefer: respond-async\r\n").headers.at("location");
  EXPECT_NE(page("/jobs?f=html").body.find("<a href=\"" + job + "\">simplify"), std::string::npos);
  EXPECT_EQ(wait_for(job)["status"], "successful");
  const HttpReply ended = page(job + "?f=html");
  EXPECT_NE(ended.body.find("<a href=\"" + job + "/results/mesh\">"), std::string::npos);
  EXPECT_NE(ended.body.find("<td>100 %</td>"), std::string::npos);
  EXPECT_EQ(ended.body.find(">" + job), std::string::npos) << "each link says what it leads to";
  EXPECT_FALSE(ended.headers.contains("refresh")) << "it has ended";
  for (const std::string& target : {std::string("/processes"), std::string("/jobs"), job}) {
    EXPECT_EQ(get(target + "?f=json").headers.at("content-type"), "application/json");
    EXPECT_EQ(get(target + "?f=xml").status, 400);
    const Json links = get_json(target)["links"];
    EXPECT_TRUE(std::ranges::any_of(links, [&](const Json& l) {
      return l["href"] == "http://test" + target + "?f=html";
    })) << links;
  }
}

/// All of a document, wherever they are.
std::vector<std::string> hrefs(const Json& document) {
  std::vector<std::string> all;
  const Json flat = document.flatten();
  for (const auto& [path, value] : flat.items())
    if (path.ends_with("/href")) all.push_back(value);
  return all;
}

TEST_F(ProcessesApi, LinksLeadToWhereTheRequestWent) {
  using testing::AllOf, testing::Each, testing::IsEmpty, testing::Not, testing::StartsWith;
  const std::string secure = "X-Forwarded-Proto: https\r\n";
  const auto links = [](const HttpReply& reply) {
    return hrefs(Json::parse(reply.body, nullptr, false));
  };
  const std::string order =
      R"({"inputs": {"dataset": "rainier", "max_error": 30, "bbox": [-121.78, 46.84, -121.74, 46.87]},
          "outputs": {"mesh": {}, "report": {}}})";
  const HttpReply made = execute(order, secure + "Prefer: respond-async\r\n");
  ASSERT_EQ(made.status, 201) << made.body;
  EXPECT_THAT(links(made), AllOf(Not(IsEmpty()), Each(StartsWith("https://h/jobs/")))) << made.body;
  const HttpReply waited = execute(order, secure);
  EXPECT_THAT(links(waited), AllOf(Not(IsEmpty()), Each(StartsWith("https://h/jobs/"))))
      << waited.body;
  const std::string job = made.headers.at("location");
  ASSERT_EQ(wait_for(job)["status"], "successful");
  for (const std::string& target :
       {std::string("/processes"), std::string("/processes?limit=2&offset=2"),
        std::string("/processes/slope"), std::string("/jobs?limit=1"), job, job + "/results"}) {
    EXPECT_THAT(links(get(target)), AllOf(Not(IsEmpty()), Each(StartsWith("http://test/"))))
        << target;
    EXPECT_THAT(links(get(target, secure)), Each(StartsWith("https://test/"))) << target;
    const HttpReply whole = get("http://else:81" + target);
    EXPECT_THAT(links(whole), Each(StartsWith("http://else:81/"))) << target << whole.body;
    HttpClient old(port());
    old.send("GET " + target + " HTTP/1.0\r\n\r\n");
    EXPECT_THAT(links(old.receive()), AllOf(Not(IsEmpty()), Each(StartsWith("/"))))
        << target << ": who does not say where it asks gets paths";
  }
  HttpClient client(port());
  client.send("DELETE " + job + " HTTP/1.1\r\nHost: h\r\n\r\n");
  EXPECT_THAT(links(client.receive()), AllOf(Not(IsEmpty()), Each(StartsWith("http://h/jobs/"))));
}

TEST_F(ProcessesApi, AMeshOfAnAreaIsTheAnswerOfWhoeverWaits) {
  const HttpReply reply =
      execute(inputs(R"("bbox": [-121.8, 46.8, -121.7, 46.9], "max_error": 10, "format": "ply")"));
  ASSERT_EQ(reply.status, 200) << reply.body;
  const auto mesh = proto::decode_ply(reply.body);
  ASSERT_TRUE(mesh) << mesh.error().what;
  EXPECT_GT(mesh->triangles.size(), 100u);
  double west = 180, east = -180;
  for (const auto& p : mesh->positions) west = std::min(west, p[0]), east = std::max(east, p[0]);
  EXPECT_NEAR(west, -121.8, 0.00084);
  EXPECT_NEAR(east, -121.7, 0.00084);
  // As the command line makes it, to the byte.
  const test::TempDir dir;
  const auto ran =
      test::run_tind("simplify " + test::testdata("rainier.tif") +
                     " --bounds=-121.8,46.8,-121.7,46.9 --max-error 10 -o " + dir.file("a.ply"));
  ASSERT_EQ(ran.code, 0);
  std::ifstream file(dir.file("a.ply"), std::ios::binary);
  EXPECT_EQ(std::string(std::istreambuf_iterator<char>(file), {}), reply.body);
  EXPECT_EQ(get_json("/jobs")["jobs"].size(), 0u);  // who has its answer needs no job
}

TEST_F(ProcessesApi, AJobHasAStatusResultsAndAnEnd) {
  const HttpReply accepted =
      execute(R"({"inputs": {"dataset": "rainier", "ratio": 0.02, "method": "qem",
                   "bbox": [-121.8, 46.8, -121.7, 46.9]},
                  "outputs": {"mesh": {}, "report": {}}})",
              "Prefer: respond-async\r\n");
  ASSERT_EQ(accepted.status, 201) << accepted.body;
  const std::string job = accepted.headers.at("location");
  EXPECT_TRUE(job.starts_with("/jobs/"));
  const Json status = wait_for(job);
  ASSERT_EQ(status["status"], "successful") << status;
  EXPECT_EQ(status["progress"], 100);
  EXPECT_EQ(status["processID"], "simplify");
  EXPECT_EQ(get_json("/jobs")["jobs"].size(), 1u);

  const Json results = get_json(job + "/results");
  const Json report = results["report"]["value"];
  EXPECT_EQ(report["method"], "qem");
  EXPECT_EQ(report["flipped"], 0);
  EXPECT_GE(report["max_surface_error_m"], report["max_error_m"]);
  EXPECT_EQ(report["input"], Json::array({"rainier"}));
  EXPECT_EQ(report.dump().find(test::testdata("")), std::string::npos) << "no path of the server";
  const std::string mesh = results["mesh"]["href"];
  const HttpReply whole = get(mesh);
  ASSERT_EQ(whole.status, 200);
  EXPECT_EQ(whole.headers.at("content-disposition"), "attachment; filename=\"mesh.ply\"");
  const HttpReply part = get(mesh, "Range: bytes=10-19\r\n");
  EXPECT_EQ(part.status, 206);
  EXPECT_EQ(part.body, whole.body.substr(10, 10));
  EXPECT_EQ(get(mesh, "If-None-Match: " + whole.headers.at("etag") + "\r\n").status, 304);
  EXPECT_EQ(get(mesh, "Range: bytes=99999999-\r\n").status, 416);
  EXPECT_EQ(get(job + "/results/nothing").status, 404);

  HttpClient client(port());
  client.send("DELETE " + job + " HTTP/1.1\r\nHost: h\r\n\r\n");
  const HttpReply gone = client.receive();
  ASSERT_EQ(gone.status, 200) << gone.body;
  EXPECT_EQ(Json::parse(gone.body)["status"], "dismissed");
  EXPECT_EQ(get(mesh).status, 404);
  const HttpReply none = get("/jobs/ffffffffffffffffffffffffffffffff");
  EXPECT_EQ(none.status, 404);
  EXPECT_TRUE(Json::parse(none.body)["type"].get<std::string>().ends_with("no-such-job"));
}

TEST_F(ProcessesApi, AResultThatIsJsonIsAFileAsAnyOther) {
  const std::string order =
      R"({"inputs": {"dataset": "rainier", "format": "json", "samples": 50,
                     "line": [[-121.8, 46.8], [-121.7, 46.9]]}})";
  HttpClient client(port());
  client.send(
      "POST /processes/profile/execution HTTP/1.1\r\nHost: h\r\nPrefer: respond-async\r\n"
      "Content-Type: application/json\r\nContent-Length: " +
      std::to_string(order.size()) + "\r\n\r\n" + order);
  const std::string job = client.receive().headers.at("location");
  ASSERT_EQ(wait_for(job)["status"], "successful");
  const HttpReply whole = get(job + "/results");
  ASSERT_EQ(whole.status, 200);
  const test::TempDir dir;
  const auto ran =
      test::run_tind("profile " + test::testdata("rainier.tif") +
                     " --line '-121.8,46.8 -121.7,46.9' --samples 50 -o " + dir.file("p.json"));
  ASSERT_EQ(ran.code, 0) << ran.out;
  std::ifstream file(dir.file("p.json"), std::ios::binary);
  EXPECT_EQ(std::string(std::istreambuf_iterator<char>(file), {}), whole.body);
  const HttpReply part = get(job + "/results", "Range: bytes=5-9\r\n");
  EXPECT_EQ(part.status, 206);
  EXPECT_EQ(part.body, whole.body.substr(5, 5));
  EXPECT_EQ(get(job + "/results", "If-Match: \"another\"\r\n").status, 412);
  EXPECT_EQ(HttpClient(port()).head(job + "/results", "Range: bytes=5-9\r\n").status, 200)
      << "parts are of GET";

  const std::string folder = dir_.file(job.substr(1));
  std::filesystem::rename(folder, folder + ".away");
  std::filesystem::create_symlink(folder, folder);  // which nobody can look into
  EXPECT_EQ(get(job + "/results").status, 503) << "not seen is not damaged";
  std::filesystem::remove(folder);
  EXPECT_EQ(get(job + "/results").status, 500) << "nor is what is gone a result";
  std::filesystem::rename(folder + ".away", folder);
  EXPECT_EQ(get(job + "/results").status, 200);

  for (const auto& made : std::filesystem::directory_iterator(folder))
    std::filesystem::resize_file(made.path(), 20);
  EXPECT_EQ(get(job + "/results").status, 500) << "what was cut since is no result";
  EXPECT_EQ(get(job + "/results", "Range: bytes=5-9\r\n").status, 500);
}

TEST_F(ProcessesApi, APolygonIsTheRimOfTheMesh) {
  const HttpReply reply = execute(inputs(
      R"("polygon": {"type": "Polygon", "coordinates": [[[-121.8, 46.8], [-121.7, 46.8],
         [-121.75, 46.9], [-121.8, 46.8]]]}, "triangles": 800, "format": "2dm")"));
  ASSERT_EQ(reply.status, 200) << reply.body;
  const auto mesh = proto::decode_2dm(reply.body);
  ASSERT_TRUE(mesh);
  double area = 0;
  for (const auto& t : mesh->triangles) {
    const auto &a = mesh->positions[t[0]], &b = mesh->positions[t[1]], &c = mesh->positions[t[2]];
    area += ((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])) / 2;
  }
  EXPECT_NEAR(area, 0.005, 0.0002);
}

TEST_F(ProcessesApi, ARimOfPostsKeepsTheBoundToo) {
  // Its sides run along columns and rows, over a post that stands between voids.
  const HttpReply reply = post("/processes/simplify/execution", R"({"inputs": {
      "dataset": "rainier", "max_error": 10, "polygon": {"type": "Polygon", "coordinates": [[
        [-121.86166666666672, 46.96333333333335], [-121.84416666666672, 46.96333333333335],
        [-121.84416666666672, 46.980833333333344], [-121.86166666666672, 46.980833333333344],
        [-121.86166666666672, 46.96333333333335]]]}}, "outputs": {"report": {}}})");
  ASSERT_EQ(reply.status, 200) << reply.body;
  const Json report = Json::parse(reply.body);
  EXPECT_LE(report["max_error_m"], 10);
  EXPECT_GE(report["posts"], 400);
}

TEST_F(ProcessesApi, APolygonThatIsNoneIsNamed) {
  const auto polygon = [](const std::string& ring) {
    return inputs(R"("max_error": 10, "polygon": {"type": "Polygon", "coordinates": [)" + ring +
                  "]}");
  };
  expect_refused("/processes/simplify/execution",
                 {{polygon(""), "inputs.polygon"},
                  {polygon("[]"), "inputs.polygon"},
                  {polygon("[[-121.8, 46.8], [-121.8, 46.8], [-121.8, 46.8]]"), "inputs.polygon"},
                  {polygon("[[-121.8, 46.8], [1e308, 46.8], [-121.8, 46.9]]"), "inputs.polygon"},
                  {polygon("[[-121.8, 46.8], [-121.7, 91], [-121.8, 46.9]]"), "inputs.polygon"}});
}

TEST_F(ProcessesApi, ATinThatIsSentIsSimplifiedOverItsVertices) {
  const HttpReply made =
      execute(inputs(R"("bbox": [-121.8, 46.8, -121.76, 46.84], "max_error": 2, "format": "obj")"));
  ASSERT_EQ(made.status, 200) << made.body;
  const Json mesh = {{"value", made.body}, {"mediaType", "model/obj"}, {"encoding", "utf-8"}};
  const auto simplified = [&](Json inputs, bool report = true) {
    inputs["mesh"] = mesh;
    Json order = {{"inputs", std::move(inputs)}};
    if (report) order["outputs"] = {{"report", Json::object()}};
    return execute(order.dump());
  };
  for (const char* const method : {"bounded", "qem", "edge-cost"}) {
    const HttpReply reply = simplified({{"max_error", 15}, {"method", method}});
    ASSERT_EQ(reply.status, 200) << method << reply.body;
    const Json report = Json::parse(reply.body);
    EXPECT_LE(report["max_error_m"], 15) << method;
    EXPECT_LT(report["triangles"], std::ranges::count(made.body, 'f') / 2) << method;
  }
  const HttpReply ply = simplified({{"triangles", 200}, {"format", "ply"}}, false);
  ASSERT_EQ(ply.status, 200) << ply.body;
  const auto decoded = proto::decode_ply(ply.body);
  ASSERT_TRUE(decoded);
  EXPECT_LE(decoded->triangles.size(), 200u);
  EXPECT_NEAR(decoded->positions[0][0], -121.78, 0.03);

  const std::string order = Json{{"inputs", {{"mesh", mesh}, {"ratio", 0.5}}}}.dump();
  const auto with = [&](const std::string& more) {
    return order.substr(0, order.size() - 2) + ", " + more + "}}";
  };
  expect_refused("/processes/simplify/execution",
                 {{with(R"("dataset": "rainier")"), "inputs.dataset"},
                  {with(R"("bbox": [1, 2, 3, 4])"), "inputs.bbox"},
                  {R"({"inputs": {"mesh": "?", "ratio": 0.5}})", "inputs.mesh"},
                  {R"({"inputs": {"mesh": "bm9uZQ==", "ratio": 0.5}})", "inputs.mesh_format"}});
}

TEST_F(ProcessesApi, EveryOptionOfAMethodIsKnown) {
  for (const char* const more :
       {R"("method": "bounded", "effort": "best")", R"("method": "qem", "subset-placement": true)",
        R"("method": "edge-cost", "alpha": 0.5)"}) {
    const HttpReply reply = execute(inputs(
        R"("bbox": [-121.76, 46.84, -121.74, 46.86], "max_error": 30, )" + std::string(more)));
    EXPECT_EQ(reply.status, 200) << more << reply.body;
  }
}

TEST_F(ProcessesApi, AnAreaMayBeInAnyCrs) {
  // The summit in UTM zone 10 north.
  const HttpReply reply = execute(inputs(
      R"("bbox": {"bbox": [590000, 5187000, 598000, 5193000], "crs": "http://www.opengis.net/def/crs/EPSG/0/32610"},
         "max_error": 20, "format": "obj")"));
  ASSERT_EQ(reply.status, 200) << reply.body;
  const auto mesh = proto::decode_obj(reply.body);
  ASSERT_TRUE(mesh);
  double highest = 0;
  for (const auto& p : mesh->positions) highest = std::max(highest, p[2]);
  EXPECT_GT(highest, 4300);
}

std::string many_zeros(int count) {
  std::string text;
  for (int i = 0; i < count; ++i) text += ",0";
  return text;
}

TEST_F(ProcessesApi, WhatIsWrongHasANameAndNothingRuns) {
  expect_refused(
      "/processes/simplify/execution",
      {{"[]", "body"},
       {"{}", "inputs"},
       {R"({"inputs": 1})", "inputs"},
       {R"({"inputs": {"polygon": [0)" + many_zeros(800'000) + "]}}", "body"},
       {R"({"inputs": {"max_error": 1}})", "inputs.dataset"},
       {R"({"inputs": {"dataset": "nowhere", "max_error": 1}})", "inputs.dataset"},
       {R"({"inputs": {"dataset": "made-up", "max_error": 1}})", "inputs.dataset"},
       {inputs(R"("method": "qem")"), "inputs.max_error"},
       {inputs(R"("max_error": 1, "ratio": 0.5)"), "inputs.max_error"},
       {inputs(R"("max_error": -1)"), "inputs.max_error"},
       {inputs(R"("triangles": 0.5)"), "inputs.triangles"},
       {inputs(R"("max_error": 1, "method": "magic")"), "inputs.method"},
       {inputs(R"("max_error": 1, "method": "qem", "alpha": 1)"), "inputs.alpha"},
       {inputs(R"("max_error": 1, "method": "edge-cost", "alpha": "1 --output=/tmp/x")"),
        "inputs.alpha"},
       {inputs(R"("max_error": 1, "format": "/etc/passwd")"), "inputs.format"},
       {inputs(R"("max_error": 1, "datum": "/etc/geoid.pgm")"), "inputs.datum"},
       {inputs(R"("max_error": 1, "bbox": [1, 2, 3])"), "inputs.bbox"},
       {inputs(R"("max_error": 1, "bbox": [1, 2, 3, "4"])"), "inputs.bbox"},
       {inputs(R"("max_error": 1, "bbox": [1, 5, 3, 4])"), "inputs.bbox"},
       {inputs(R"("max_error": 1, "datum": "unknown")"), "inputs.datum"},
       {inputs(R"("max_error": 1, "crs": "/etc/passwd")"), "inputs.crs"},
       {inputs(R"("max_error": 1, "polygon": {"type": "Point", "coordinates": [1, 2]})"),
        "inputs.polygon"},
       {inputs(R"("max_error": 1, "output": "/tmp/x")"), "inputs.output"},
       {R"({"inputs": {"dataset": "rainier", "max_error": 1}, "outputs": {"x": {}}})", "outputs.x"},
       {R"({"inputs": {"dataset": "rainier", "max_error": 1}, "response": "loud"})", "response"}});
  EXPECT_EQ(get_json("/jobs")["jobs"].size(), 0u);
  EXPECT_EQ(jobs_->counts().failed, 0u);
}

TEST_F(ProcessesApi, AFailureSaysWhatToDoInTheWordsOfRequests) {
  // What only the program finds.
  const HttpReply none = post("/processes/simplify/execution", inputs(R"("max_error": 0)"));
  EXPECT_EQ(none.status, 400) << none.body;
  EXPECT_NE(none.body.find("(method) take 0"), std::string::npos) << none.body;
  const HttpReply area = post(
      "/processes/volume/execution",
      inputs(
          R"("height": 1, "polygon": {"type": "Polygon", "coordinates": [[[0, 0], [0, 0], [0, 0]]]})"));
  EXPECT_GE(area.status, 400) << area.body;
  for (const std::string& text : {none.body, area.body}) {
    EXPECT_EQ(text.find("--"), std::string::npos) << text;
    EXPECT_EQ(text.find("help"), std::string::npos) << text;
  }
  // A line that the command line's own parser refuses.
  services::JobOrder order;
  order.process = "contours";
  order.client = "127.0.0.1";
  order.arguments = {"contours", test::testdata("rainier.tif"), "--interval=-1", "-o", "x.gpkg"};
  const auto job = jobs_->submit(order);
  ASSERT_TRUE(job);
  const Json status = wait_for("/jobs/" + job->id);
  EXPECT_EQ(status["status"], "failed");
  const std::string message = status["message"];
  EXPECT_TRUE(message.starts_with("interval: ")) << message;
}

TEST_F(ProcessesApi, ADatumWithoutItsGridIsRefusedBeforeAnythingRuns) {
  const std::string where = R"("bbox": [-121.78, 46.84, -121.74, 46.87], )";
  for (const char* const datum : {"source", "egm96", "EPSG:5773", "ellipsoid"}) {
    const HttpReply reply = post("/processes/contours/execution",
                                 inputs(where + R"("interval": 500, "datum": ")" + datum + "\""));
    EXPECT_EQ(reply.status, 200) << datum << reply.body;
  }
  const auto before = jobs_->counts();
  // A geoid of Japan reaches nowhere near, whichever grids there are.
  expect_refused("/processes/contours/execution",
                 {{inputs(R"("interval": 500, "datum": "EPSG:6695")"), "inputs.datum"}});
  expect_refused("/processes/simplify/execution",
                 {{inputs(R"("max_error": 50, "datum": "EPSG:6695")"), "inputs.datum"}});
  EXPECT_EQ(jobs_->counts().failed, before.failed);
  EXPECT_EQ(jobs_->counts().successful, before.successful);
}

TEST_F(ProcessesApi, AnAreaBesideTheDemIsTheClientsMistake) {
  const HttpReply reply = execute(inputs(R"("max_error": 1, "bbox": [10, 45, 11, 46])"));
  EXPECT_GE(reply.status, 400) << reply.body;
  EXPECT_LT(reply.status, 500) << reply.body;
  EXPECT_NE(reply.body.find("outside of the DEM"), std::string::npos) << reply.body;
  EXPECT_EQ(reply.body.find(test::testdata("")), std::string::npos) << reply.body;
}

TEST_F(ProcessesApi, OfFilesThatChangedAreRefused) {
  const std::string path = dir_.file("N46E007.hgt");
  test::write_bytes(path, test::srtm(111));
  ASSERT_TRUE(services::open_dataset(catalog_, {"dem", {path}}, {}, {}));
  const std::string body = R"({"inputs": {"dataset": "dem", "height": 100,
                               "bbox": [7.1, 46.1, 7.2, 46.2]}})";
  EXPECT_EQ(post("/processes/volume/execution", body).status, 200);
  test::write_bytes(path + ".new", test::srtm(222));
  std::filesystem::rename(path + ".new", path);  // under the daemon, which has the old one open
  EXPECT_EQ(post("/processes/volume/execution", body).status, 503);
  std::filesystem::remove(path);
  const HttpReply reply = post("/processes/volume/execution", body);
  EXPECT_EQ(reply.status, 503);
  EXPECT_TRUE(reply.headers.contains("retry-after"));
  EXPECT_NE(reply.body.find("cannot be read at the moment"), std::string::npos) << reply.body;
}

TEST_F(ProcessesApi, OfFilesThatCannotBeReadAreRefusedForNow) {
  if (test::kSanitized)
    GTEST_SKIP()
        << "LeakSanitizer cannot look into a program that runs as somebody else, and "
           "ThreadSanitizer does not read there which reports of GDAL's own locks it leaves out";
  const std::string path = dir_.file("N46E007.hgt");
  test::write_bytes(path, test::srtm(111));
  ASSERT_TRUE(services::open_dataset(catalog_, {"dem", {path}}, {}, {}));
  const std::string body = R"({"inputs": {"dataset": "dem", "height": 100,
                               "bbox": [7.1, 46.1, 7.2, 46.2]}})";
  ASSERT_EQ(post("/processes/volume/execution", body).status, 200);
  test::give_to_somebody(dir_.file("jobs"));  // and the folder of all may be looked into
  const test::Closed closed(path);
  const test::AsSomebodyElse nobody;
  if (::eaccess(test::tind_binary().c_str(), X_OK) != 0) GTEST_SKIP() << "nobody may run tind";
  const HttpReply reply = post("/processes/volume/execution", body);
  EXPECT_EQ(reply.status, 503) << reply.body;
  EXPECT_TRUE(reply.headers.contains("retry-after"));
  EXPECT_EQ(reply.body.find(dir_.path().string()), std::string::npos) << reply.body;
}

TEST_F(ProcessesApi, AJobWhoseSourceHasGoneSaysSoInItsResults) {
  services::JobOrder order;
  order.process = "contours";
  order.client = "127.0.0.1";
  order.arguments = {"contours", dir_.file("none.tif"), "--interval=100", "-o", "x.gpkg"};
  order.names = {{dir_.file("none.tif"), "alps"}};
  order.outputs = {{"contours", "x.gpkg", "application/geopackage+sqlite3"}};
  const auto job = jobs_->submit(order);
  ASSERT_TRUE(job);
  EXPECT_EQ(wait_for("/jobs/" + job->id)["status"], "failed");
  const HttpReply reply = get("/jobs/" + job->id + "/results");
  EXPECT_EQ(reply.status, 503) << reply.body;
  EXPECT_NE(reply.body.find("alps"), std::string::npos) << reply.body;
}

TEST_F(ProcessesApi, WhereJobsCannotBeKeptNoneIsAccepted) {
  EXPECT_EQ(get("/readyz?verbose").body.find("[-]"), std::string::npos);
  std::filesystem::rename(dir_.file("jobs"), dir_.file("away"));
  std::filesystem::create_directory(dir_.file("jobs"));
  for (const char* const prefer : {"", "Prefer: respond-async\r\n"}) {
    const HttpReply reply = execute(inputs(R"("max_error": 50)"), prefer);
    EXPECT_EQ(reply.status, 503) << reply.body;
    EXPECT_TRUE(reply.headers.contains("retry-after"));
    EXPECT_EQ(reply.body.find(" room "), std::string::npos) << "there is: " << reply.body;
    EXPECT_EQ(reply.body.find(dir_.path().string()), std::string::npos) << reply.body;
  }
  const HttpReply ready = get("/readyz?verbose");
  EXPECT_EQ(ready.status, 200);
  EXPECT_NE(ready.body.find("[-] the list of jobs "), std::string::npos) << ready.body;
  std::filesystem::remove(dir_.file("jobs"));
  std::filesystem::rename(dir_.file("away"), dir_.file("jobs"));
  EXPECT_EQ(execute(inputs(R"("max_error": 50)")).status, 200);
  EXPECT_EQ(get("/readyz?verbose").body.find("[-]"), std::string::npos);
}

}  // namespace
}  // namespace tind::api
