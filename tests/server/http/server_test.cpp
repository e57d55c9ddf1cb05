// The whole HTTP side over real sockets: requests in, answers out.

#include <sys/resource.h>

#include <atomic>
#include <csignal>
#include <cstdlib>
#include <system_error>

#include "tests/server/http/server_fixture.h"
#include "tests/support/http_probes.h"

namespace tind::http {
namespace {

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

TEST_F(HttpServer, HeadHasNoBodyWhereItIsRefused) {
  HttpClient client(port());
  EXPECT_EQ(client.head("/%zz").status, 400);
  EXPECT_TRUE(client.closed()) << "nothing came behind the head";
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
  EXPECT_GE(test::probes().size(), 400u);
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

#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)  // they need room of their own
/// Ends with 7 where the caller is told, and the threads that there were have ended.
[[noreturn]] void run_without_room_for_threads() {
  const Router router;
  ServerOptions options;
  options.port = 0;
  options.threads = 64;
  const auto server = Server::listen(router, options);
  rlimit no_room{};
  no_room.rlim_cur = no_room.rlim_max = 100 << 20;  // a thread has a stack of 8 MB
  if (!server || setrlimit(RLIMIT_AS, &no_room) != 0) std::_Exit(2);
  try {
    (*server)->run();
  } catch (const std::system_error&) {
    std::_Exit(7);
  }
  std::_Exit(3);
}

TEST(HttpServerRun, SaysWhenThereIsNoThreadForALoop) {
  EXPECT_EXIT(run_without_room_for_threads(), testing::ExitedWithCode(7), "");
}
#endif

/// A server was there and is gone, in a process of its own; then there is a signal.
[[noreturn]] void come_and_go(bool signals_to_the_end, int signal) {
  const Router router;
  ServerOptions any_port;
  any_port.port = 0;
  any_port.signals_to_the_end = signals_to_the_end;
  for (int time = 0; time < 2; ++time) {
    const auto server = Server::listen(router, any_port);
    if (!server) std::_Exit(8);
    (*server)->stop();
    (*server)->run();
  }
  std::raise(signal);
  std::_Exit(7);
}

/// Whoever is ending by himself (a thread could not be had, say) keeps his own exit code.
TEST(ServerSignals, AHangupAfterItIsGoneEndsNobody) {
  EXPECT_EXIT(come_and_go(false, SIGHUP), testing::ExitedWithCode(7), "");
}

TEST(ServerSignals, OnesToTheEndEndNobodyAfterItIsGone) {
  for (const int signal : {SIGTERM, SIGINT, SIGHUP})
    EXPECT_EXIT(come_and_go(true, signal), testing::ExitedWithCode(7), "") << signal;
}

/// Other tests go on in the process in which a server was.
TEST(ServerSignals, OthersHaveTheirDefaultActionAfterItIsGone) {
  for (const int signal : {SIGTERM, SIGINT})
    EXPECT_EXIT(come_and_go(false, signal), testing::KilledBySignal(signal), "") << signal;
}

}  // namespace
}  // namespace tind::http
