#pragma once
// A server of a few routes over real sockets, for the tests of this folder.

#include <gtest/gtest.h>

#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "server/http/message/problem.h"
#include "server/http/server.h"
#include "tests/support/http_client.h"

namespace tind::http {

using std::chrono::milliseconds;
using test::HttpClient;
using test::HttpReply;
using test::RunningServer;

/// Holds the responders of requests to /later until the test lets them go.
struct Parked {
  std::mutex mutex;
  std::vector<Responder> waiting;

  std::size_t count() {
    const std::lock_guard lock(mutex);
    return waiting.size();
  }
  void wait_for(std::size_t n) {
    while (count() < n) std::this_thread::sleep_for(milliseconds(1));
  }
  void answer(const std::string& body) {
    const std::lock_guard lock(mutex);
    for (Responder& responder : waiting) responder(make_reply(200, "text/plain", body));
    waiting.clear();
  }
};

inline Router example(Parked& parked) {
  Router router;
  router.get("/",
             [](const Request&, DeferredReply&) { return make_reply(200, "text/plain", "hello"); });
  router.get("/echo/{what}", [](const Request& request, DeferredReply&) {
    return make_reply(200, "text/plain", request.matched[0]);
  });
  router.get("/large", [](const Request&, DeferredReply&) {
    return make_reply(200, "text/plain", std::string(5'000'000, 'x'));
  });
  router.get("/medium", [](const Request&, DeferredReply&) {
    return make_reply(200, "text/plain", std::string(200'000, 'y'));
  });
  router.get_always("/health", {}, [](const Request&, DeferredReply&) {
    return make_reply(200, "text/plain", "well");
  });
  router.get("/throws", [](const Request&, DeferredReply&) -> std::optional<Reply> {
    throw std::runtime_error("on purpose");
  });
  router.get("/drops", [](const Request&, DeferredReply& deferred) {
    deferred.responder();
    return std::optional<Reply>();
  });
  router.get("/later", [&parked](const Request&, DeferredReply& deferred) {
    const std::lock_guard lock(parked.mutex);
    parked.waiting.push_back(deferred.responder());
    return std::optional<Reply>();
  });
  router.get("/pieces", [](const Request&, DeferredReply&) {
    auto owner = std::make_shared<Payload>();
    owner->bytes = "[," + std::string(6 * 700, 'p');
    const std::string_view bytes = owner->bytes;
    std::vector<Piece> pieces = {{owner, bytes.substr(0, 1)}};
    for (int i = 0; i < 3000; ++i) {
      pieces.push_back({owner, bytes.substr(1, 1)});
      pieces.push_back({owner, bytes.substr(2, std::size_t(i % 7) * 700)});
    }
    return make_reply("text/plain", std::move(pieces));
  });
  BodyRules json{.max_bytes = 1'000'000};
  json.refuse = [](const Request& request) -> std::optional<Reply> {
    if (request.matched[0] == "here") return std::nullopt;
    return problem_reply({.status = 404, .detail = "not here"});
  };
  router.post("/json/{where}", json, [](const Request& request, DeferredReply&) {
    return make_reply(200, "text/plain", std::to_string(request.body.size()));
  });
  router.post("/count", {.max_bytes = 100'000, .type = ""},
              [](const Request& request, DeferredReply&) {
                return make_reply(200, "text/plain", std::to_string(request.body.size()));
              });
  return router;
}

class HttpServer : public ::testing::Test {
 protected:
  void start(ServerOptions options = {}) { running_.emplace(router_, options); }
  std::uint16_t port() {
    if (!running_) start();
    return running_->port();
  }
  HttpClient client() { return HttpClient(port()); }
  std::size_t held() { return running_->server().stats().held_bytes; }
  bool alive() { return HttpClient(port()).get("/").body == "hello"; }

  Parked parked_;
  Router router_ = example(parked_);
  std::optional<RunningServer> running_;
};

}  // namespace tind::http
