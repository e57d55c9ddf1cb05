// The whole HTTP side over real sockets.

#include "server/http/server.h"

#include <gtest/gtest.h>
#include <sys/resource.h>

#include <atomic>
#include <mutex>

#include "server/http/problem.h"
#include "tests/support/http_client.h"
#include "tests/support/http_probes.h"

namespace tind::http {
namespace {

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

Router example(Parked& parked) {
  Router router;
  router.get("/", [](const Request&, Later&) { return make_reply(200, "text/plain", "hello"); });
  router.get("/echo/{what}", [](const Request& request, Later&) {
    return make_reply(200, "text/plain", request.matched[0]);
  });
  router.get("/large", [](const Request&, Later&) {
    return make_reply(200, "text/plain", std::string(5'000'000, 'x'));
  });
  router.get("/throws", [](const Request&, Later&) -> std::optional<Reply> {
    throw std::runtime_error("on purpose");
  });
  router.get("/drops", [](const Request&, Later& later) {
    later.responder();
    return std::optional<Reply>();
  });
  router.get("/later", [&parked](const Request&, Later& later) {
    const std::lock_guard lock(parked.mutex);
    parked.waiting.push_back(later.responder());
    return std::optional<Reply>();
  });
  router.post("/count", 100'000, [](const Request& request, Later&) {
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
  bool alive() { return HttpClient(port()).get("/").body == "hello"; }

  Parked parked_;
  Router router_ = example(parked_);
  std::optional<RunningServer> running_;
};

TEST_F(HttpServer, AnswersAndKeepsTheConnection) {
  HttpClient client(port());
  for (int i = 0; i < 3; ++i) {
    const HttpReply reply = client.get("/echo/a" + std::to_string(i));
    EXPECT_EQ(reply.status, 200);
    EXPECT_EQ(reply.body, "a" + std::to_string(i));
    EXPECT_EQ(reply.headers.at("access-control-allow-origin"), "*");
    EXPECT_EQ(reply.headers.at("date").size(), 29u);
    EXPECT_FALSE(reply.headers.contains("connection"));
  }
}

TEST_F(HttpServer, HeadHasTheHeadersOfGetAndNoBody) {
  HttpClient client(port());
  const HttpReply head = client.head("/"), get = client.get("/");
  EXPECT_EQ(head.status, 200);
  EXPECT_EQ(head.headers.at("content-length"), "5");
  EXPECT_EQ(get.body, "hello");
  HttpReply same = get;
  same.headers["date"] = head.headers.at("date");
  EXPECT_EQ(same.headers, head.headers);
}

TEST_F(HttpServer, ProblemsAreDocuments) {
  HttpClient client(port());
  const HttpReply reply = client.get("/none?x=1");
  EXPECT_EQ(reply.status, 404);
  EXPECT_EQ(reply.headers.at("content-type"), "application/problem+json");
  EXPECT_NE(reply.body.find("\"title\":\"Not Found\",\"status\":404"), std::string::npos);
  EXPECT_NE(reply.body.find("\"instance\":\"/none?x=1\""), std::string::npos);
  EXPECT_NE(reply.body.find("\"requestId\":\""), std::string::npos);
  EXPECT_EQ(client.get("/").body, "hello") << "a 404 keeps the connection";
}

TEST_F(HttpServer, OptionsAndUnknownMethods) {
  HttpClient client(port());
  client.send("OPTIONS /count HTTP/1.1\r\nHost: a\r\n\r\n");
  const HttpReply options = client.receive();
  EXPECT_EQ(options.status, 204);
  EXPECT_EQ(options.headers.at("access-control-allow-methods"), "OPTIONS, POST");
  client.send("PUT /count HTTP/1.1\r\nHost: a\r\nContent-Length: 3\r\n\r\nabc");
  const HttpReply put = client.receive();
  EXPECT_EQ(put.status, 405);
  EXPECT_EQ(put.headers.at("allow"), "OPTIONS, POST");
  EXPECT_TRUE(client.closed()) << "its body was not read";
}

TEST_F(HttpServer, PipelinedRequestsAreAnsweredInOrder) {
  HttpClient client(port());
  std::string bytes;
  for (int i = 0; i < 1000; ++i) {
    bytes += i % 7 == 3 ? "GET /later HTTP/1.1\r\nHost: a\r\n\r\n"
                        : "GET /echo/" + std::to_string(i) + " HTTP/1.1\r\nHost: a\r\n\r\n";
  }
  std::atomic<bool> stop{false};
  std::thread answering([&] {
    while (!stop) {
      parked_.answer("later");
      std::this_thread::sleep_for(milliseconds(1));
    }
  });
  std::thread sending([&] { client.send(bytes); });
  for (int i = 0; i < 1000; ++i) {
    const HttpReply reply = client.receive();
    EXPECT_EQ(reply.body, i % 7 == 3 ? "later" : std::to_string(i));
    if (reply.status != 200) break;
  }
  stop = true;
  sending.join();
  answering.join();
}

TEST_F(HttpServer, NothingIsProcessedAfterARefusal) {
  HttpClient client(port());
  client.send(
      "GET /echo/1 HTTP/1.1\r\nHost: a\r\n\r\n"
      "GET /echo/2 HTTP/1.1\r\nHost: a\r\nTransfer-Encoding: chunked\r\n\r\n"
      "GET /echo/3 HTTP/1.1\r\nHost: a\r\n\r\n");
  EXPECT_EQ(client.receive().body, "1");
  const HttpReply refused = client.receive();
  EXPECT_EQ(refused.status, 501);
  EXPECT_EQ(refused.headers.at("connection"), "close");
  EXPECT_TRUE(client.closed());
}

TEST_F(HttpServer, EveryProbeIsAnsweredAndTheServerLives) {
  for (const test::Probe& probe : test::probes()) {
    for (const bool slowly : {false, true}) {
      if (slowly && probe.bytes.size() > 1000) continue;
      HttpClient client(port());
      slowly ? client.send_slowly(probe.bytes) : client.send(probe.bytes);
      // Some answers (a TLS hello's) must not wait for more; for the rest it changes nothing.
      const HttpReply reply = client.receive();
      const std::string what = probe.name + (slowly ? ", byte by byte" : "");
      if (probe.status < 400) {
        EXPECT_EQ(reply.status, 200) << what;
        continue;
      }
      EXPECT_EQ(reply.status, probe.status) << what;
      EXPECT_EQ(reply.headers.contains("connection") ? reply.headers.at("connection") : "", "close")
          << what;
      EXPECT_TRUE(client.closed()) << what;
    }
  }
  EXPECT_TRUE(alive());
  EXPECT_GT(test::probes().size(), 150u);
}

TEST_F(HttpServer, BodiesNeedALengthWithinTheLimit) {
  HttpClient client(port());
  const auto post = [](const std::string& fields, const std::string& body) {
    return "POST /count HTTP/1.1\r\nHost: a\r\n" + fields + "\r\n" + body;
  };
  client.send(post("Content-Length: 5\r\n", "hello") + post("Content-Length: 0\r\n", ""));
  EXPECT_EQ(client.receive().body, "5");
  EXPECT_EQ(client.receive().body, "0");
  client.send_slowly(post("Content-Length: 300\r\n", std::string(300, 'x')));
  EXPECT_EQ(client.receive().body, "300");
  client.send(post("Content-Length: 100000\r\n", std::string(100'000, 'x')) +
              "GET / HTTP/1.1\r\nHost: a\r\n\r\n");
  EXPECT_EQ(client.receive().body, "100000");
  EXPECT_EQ(client.receive().body, "hello");
  client.send(post("Content-Length: 100001\r\n", std::string(100'001, 'x')));
  EXPECT_EQ(client.receive().status, 413);
  EXPECT_TRUE(client.closed());
  HttpClient other(port());
  other.send(post("", ""));
  EXPECT_EQ(other.receive().status, 411);
}

TEST_F(HttpServer, SaysContinueWhenAsked) {
  HttpClient client(port());
  client.send(
      "POST /count HTTP/1.1\r\nHost: a\r\nContent-Length: 3\r\nExpect: 100-continue\r\n\r\n");
  EXPECT_EQ(client.receive().status, 100);
  client.send("abc");
  EXPECT_EQ(client.receive().body, "3");
}

TEST_F(HttpServer, HandlersThatFailAnswer500) {
  HttpClient client(port());
  EXPECT_EQ(client.get("/throws").status, 500);
  EXPECT_EQ(client.get("/drops").status, 500);
  EXPECT_EQ(client.get("/").body, "hello");
  EXPECT_EQ(client.get("/throws").body.find("on purpose"), std::string::npos);
}

TEST_F(HttpServer, Http10ClosesUnlessAskedNotTo) {
  HttpClient client(port());
  client.send("GET / HTTP/1.0\r\nConnection: keep-alive\r\n\r\n");
  EXPECT_EQ(client.receive().headers.at("connection"), "keep-alive");
  client.send("GET / HTTP/1.0\r\n\r\n");
  EXPECT_EQ(client.receive().headers.at("connection"), "close");
  EXPECT_TRUE(client.closed());
}

TEST_F(HttpServer, ASlowReaderGetsAllOfALargeReply) {
  HttpClient client(port());
  for (int i = 0; i < 4; ++i) client.send("GET /large HTTP/1.1\r\nHost: a\r\n\r\n");
  for (int i = 0; i < 4; ++i) {
    std::this_thread::sleep_for(milliseconds(20));
    EXPECT_EQ(client.receive().body.size(), 5'000'000u);
  }
}

TEST_F(HttpServer, SlowHeadsAreCut) {
  ServerOptions options;
  options.limits.head_timeout = milliseconds(300);
  options.limits.idle_timeout = milliseconds(60'000);
  options.limits.linger_timeout = milliseconds(100);
  start(options);
  HttpClient drip(port()), silent(port()), second(port());
  second.get("/");
  second.send("GET / HT");
  // A byte now and then does not extend the time that the whole head has.
  bool open = true;
  for (int i = 0; i < 200 && open; ++i) {
    open = drip.send("G");
    std::this_thread::sleep_for(milliseconds(20));
  }
  EXPECT_FALSE(open);
  EXPECT_TRUE(silent.closed());
  EXPECT_EQ(second.receive().status, 408);
  EXPECT_TRUE(alive());
}

TEST_F(HttpServer, IdleConnectionsAreClosedQuietly) {
  ServerOptions options;
  options.limits.idle_timeout = milliseconds(200);
  start(options);
  HttpClient client(port());
  EXPECT_EQ(client.get("/").status, 200);
  EXPECT_TRUE(client.closed());
}

TEST_F(HttpServer, ClientsThatTakeNothingAreCut) {
  ServerOptions options;
  options.limits.write_timeout = milliseconds(200);
  start(options);
  HttpClient client(port());
  constexpr int kReplies = 20;  // 100 MB: more than the kernel keeps for anybody
  for (int i = 0; i < kReplies; ++i) client.send("GET /large HTTP/1.1\r\nHost: a\r\n\r\n");
  while (running_->server().stats().accepted == 0 || running_->server().stats().connections > 0)
    std::this_thread::sleep_for(milliseconds(5));
  int whole = 0;
  while (client.receive().status == 200) ++whole;
  EXPECT_LT(whole, kReplies);
}

TEST_F(HttpServer, HalfClosedClientsAreAnswered) {
  HttpClient client(port());
  client.send("GET /later HTTP/1.1\r\nHost: a\r\n\r\n");
  client.finish_sending();
  parked_.wait_for(1);
  parked_.answer("still there");
  EXPECT_EQ(client.receive().body, "still there");
  EXPECT_TRUE(client.closed());
}

TEST_F(HttpServer, StopsGracefully) {
  start();
  HttpClient idle(port()), busy(port());
  EXPECT_EQ(idle.get("/").status, 200);
  busy.send("GET /later HTTP/1.1\r\nHost: a\r\n\r\n");
  parked_.wait_for(1);
  EXPECT_TRUE(running_->server().ready());
  running_->server().stop();
  EXPECT_TRUE(idle.closed());
  EXPECT_FALSE(running_->server().ready());
  EXPECT_THROW(HttpClient refused(port()), std::runtime_error);
  parked_.answer("done");
  const HttpReply reply = busy.receive();
  EXPECT_EQ(reply.body, "done");
  EXPECT_EQ(reply.headers.at("connection"), "close");
  EXPECT_TRUE(running_->stop());
}

TEST_F(HttpServer, TheGracePeriodEnds) {
  ServerOptions options;
  options.grace = milliseconds(100);
  start(options);
  HttpClient busy(port());
  busy.send("GET /later HTTP/1.1\r\nHost: a\r\n\r\n");
  parked_.wait_for(1);
  EXPECT_FALSE(running_->stop());
  parked_.answer("too late");
}

TEST_F(HttpServer, TooManyConnectionsAreToldSo) {
  ServerOptions options;
  options.limits.connections = 2;
  start(options);
  HttpClient first(port()), second(port());
  EXPECT_EQ(first.get("/").status, 200);
  EXPECT_EQ(second.get("/").status, 200);
  HttpClient third(port());
  EXPECT_EQ(third.receive().status, 503);
  EXPECT_EQ(running_->server().stats().rejected.at("too_many_connections"), 1u);
}

TEST_F(HttpServer, SurvivesRunningOutOfDescriptors) {
  ServerOptions options;
  options.limits.accept_backoff = milliseconds(20);
  start(options);
  ASSERT_TRUE(alive());
  HttpClient before(port());
  ASSERT_EQ(before.get("/").status, 200);
  // The client's socket exists before the limit falls, so only the server runs out.
  rlimit limit{};
  ASSERT_EQ(getrlimit(RLIMIT_NOFILE, &limit), 0);
  std::vector<int> taken;
  rlimit tight = limit;
  tight.rlim_cur = 200;
  ASSERT_EQ(setrlimit(RLIMIT_NOFILE, &tight), 0);
  for (int fd = dup(0); fd >= 0; fd = dup(0)) taken.push_back(fd);
  ASSERT_FALSE(taken.empty());
  close(taken.back());
  taken.pop_back();
  HttpClient starved(port());  // takes the last one
  EXPECT_TRUE(starved.closed());
  EXPECT_EQ(before.get("/").status, 200) << "open connections go on";
  for (const int fd : taken) close(fd);
  setrlimit(RLIMIT_NOFILE, &limit);
  while (!running_->server().ready()) std::this_thread::sleep_for(milliseconds(5));
  EXPECT_TRUE(alive());
  EXPECT_GE(running_->server().stats().rejected.at("out_of_descriptors"), 1u);
}

TEST_F(HttpServer, Counts) {
  start();
  {
    HttpClient client(port());
    client.get("/");
    client.get("/none");
    client.send("bad\r\n\r\n");
    client.receive();
  }
  const StatsSnapshot stats = running_->server().stats();
  EXPECT_EQ(stats.by_class[2], 1u);
  EXPECT_EQ(stats.by_class[4], 2u);
  EXPECT_EQ(stats.accepted, 1u);
  EXPECT_EQ(stats.rejected.at("bad_request_line"), 1u);
  EXPECT_GT(stats.bytes_sent, 100u);
}

TEST(HttpServerListen, SaysWhyItCannot) {
  Router router;
  ServerOptions options;
  options.port = 0;
  options.address = "nonsense";
  const auto bad = Server::listen(router, options);
  ASSERT_FALSE(bad);
  EXPECT_EQ(bad.error().code, Errc::invalid_argument);
  options.address = "127.0.0.1";
  const auto first = Server::listen(router, options);
  ASSERT_TRUE(first);
  options.port = (*first)->port();
  const auto second = Server::listen(router, options);
  ASSERT_FALSE(second);
  EXPECT_NE(second.error().what.find("in use"), std::string::npos);
}

}  // namespace
}  // namespace tind::http
