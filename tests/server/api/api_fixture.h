#pragma once
// The whole daemon but its main: datasets, services and routes behind a real server.

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <optional>
#include <vector>

#include "server/api/app.h"
#include "server/services/datasets/open_dataset.h"
#include "tests/support/http_client.h"
#include "tests/support/made_up_tiles.h"
#include "tests/support/support.h"

namespace tind::api {

using test::HttpClient;
using test::HttpReply;
using Json = nlohmann::json;

class Api : public ::testing::Test {
 protected:
  Api() {
    catalog_.add("made-up", dataset_of(made_up_));
    const std::string page = dir_.file("index.html");
    std::ofstream(page) << "<html>" << std::string(1000, ' ') << "</html>";
    std::filesystem::create_directories(dir_.path() / "a");
    std::ofstream(dir_.file("a/b.js")) << "1";
    std::ofstream(dir_.file(".secret")) << "2";
    std::filesystem::create_symlink("/etc/passwd", dir_.path() / "link.txt");
    viewer_ = *http::StaticFiles::load(dir_.path().string());
  }
  ~Api() override {
    if (running_) running_->stop();
    pool_.stop();
  }

  void add_dem() {
    ASSERT_TRUE(
        services::open_dataset(catalog_, {"rainier", {test::testdata("rainier.tif")}}, {}, {}));
  }
  std::uint16_t port() {
    if (!running_) {
      router_ = make_router(app_);
      running_.emplace(router_);
      app_.server = &running_->server();
    }
    return running_->port();
  }
  HttpReply get(const std::string& target, const std::string& fields = "") {
    return HttpClient(port()).get(target, fields);
  }

  HttpReply post(const std::string& target, const std::string& body) {
    HttpClient client(port());
    client.send("POST " + target +
                " HTTP/1.1\r\nHost: h\r\nContent-Type: application/json\r\nContent-Length: " +
                std::to_string(body.size()) + "\r\n\r\n" + body);
    return client.receive();
  }

  /// A bad request, because of this parameter.
  struct Refused {
    std::string body, parameter;
  };
  void expect_refused(const std::string& target, const std::vector<Refused>& cases) {
    for (const auto& [body, parameter] : cases) {
      const HttpReply reply = post(target, body);
      EXPECT_EQ(reply.status, 400) << body;
      EXPECT_EQ(reply.headers.at("content-type"), "application/problem+json");
      const Json problem = Json::parse(reply.body, nullptr, false);
      ASSERT_TRUE(problem.contains("errors")) << body << reply.body;
      EXPECT_EQ(problem["errors"][0]["parameter"], parameter) << body;
      EXPECT_FALSE(problem["errors"][0]["detail"].get<std::string>().empty()) << body;
    }
  }

  test::TempDir dir_;
  std::shared_ptr<test::MadeUpTiles> made_up_ = std::make_shared<test::MadeUpTiles>();
  services::Catalog catalog_;
  services::TileCache cache_{8 << 20};
  services::CpuPool pool_{2, 4};
  services::TileService tiles_{cache_, pool_, std::chrono::milliseconds(0)};
  http::StaticFiles viewer_;
  services::RefineService refine_;
  services::TileStreams streams_{tiles_, cache_, pool_};
  services::TileTransitions transitions_{tiles_, cache_, pool_};
  services::TileEncodings encodings_{tiles_, cache_, pool_};
  services::Tiles3d tiles3d_{tiles_, cache_, pool_};
  services::Scenery scenery_{cache_, pool_, *test::environment()};
  services::HeightImages images_{tiles_, cache_, pool_};
  const std::shared_ptr<const Environment> environment_ = test::environment();
  App app_{catalog_,      tiles_,   cache_,   pool_,     viewer_,
           *environment_, nullptr,  &refine_, &streams_, &transitions_,
           &encodings_,   &images_, nullptr,  &tiles3d_, &scenery_};
  http::Router router_;
  std::optional<test::RunningServer> running_;
};

}  // namespace tind::api
