#pragma once
// A daemon over rainier.tif that runs jobs.

#include <chrono>
#include <memory>
#include <string>
#include <thread>

#include "server/services/jobs/jobs.h"
#include "tests/server/api/api_fixture.h"
#include "tests/support/program.h"

namespace tind::api {

class ProcessesApi : public Api {
 protected:
  ProcessesApi() {
    auto jobs =
        services::Jobs::open(dir_.file("jobs"), test::tind_binary(),
                             {.running = 2, .each = {.file_bytes = 64u << 20, .niceness = 0}});
    EXPECT_TRUE(jobs) << jobs.error().what;
    jobs_ = std::move(*jobs);
    app_.jobs = jobs_.get();
    add_dem();
  }
  ~ProcessesApi() override {
    if (running_) running_->stop();
    jobs_->stop();  // before what it answers through
  }

  static std::string inputs(const std::string& more) {
    return R"({"inputs": {"dataset": "rainier", )" + more + "}}";
  }
  HttpReply execute(const std::string& body, const std::string& prefer = "") {
    HttpClient client(port());
    client.send("POST /processes/simplify/execution HTTP/1.1\r\nHost: h\r\n" + prefer +
                "Content-Type: application/json\r\nContent-Length: " + std::to_string(body.size()) +
                "\r\n\r\n" + body);
    return client.receive();
  }
  Json get_json(const std::string& target) {
    const HttpReply reply = get(target);
    EXPECT_EQ(reply.status, 200) << target << reply.body;
    return Json::parse(reply.body, nullptr, false);
  }
  Json wait_for(const std::string& job) {
    for (int i = 0; i < 6000; ++i) {
      Json status = get_json(job);
      if (status["status"] != "accepted" && status["status"] != "running") return status;
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
    return {};
  }

  std::unique_ptr<services::Jobs> jobs_;
};

}  // namespace tind::api
