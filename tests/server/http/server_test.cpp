// The whole HTTP side over real sockets.

#include "server/http/server.h"

#include <gtest/gtest.h>
#include <sys/resource.h>

#include <atomic>
#include <mutex>

#include "server/http/message/problem.h"
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
  router.get("/medium", [](const Request&, Later&) {
    return make_reply(200, "text/plain", std::string(200'000, 'y'));
  });
  router.get_always("/health",
                    [](const Request&, Later&) { return make_reply(200, "text/plain", "well"); });
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
  router.get("/pieces", [](const Request&, Later&) {
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
  router.post("/json/{where}", json, [](const Request& request, Later&) {
    return make_reply(200, "text/plain", std::to_string(request.body.size()));
  });
  router.post("/count", {.max_bytes = 100'000, .type = ""}, [](const Request& request, Later&) {
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

TEST_F(HttpServer, BodiesThatNobodyTakesAreNotRead) {
  HttpClient form(port());
  form.send(
      "POST /json/here HTTP/1.1\r\nHost: a\r\nContent-Type: text/plain\r\n"
      "Content-Length: 1000000\r\nExpect: 100-continue\r\n\r\n");
  const HttpReply wrong = form.receive();
  EXPECT_EQ(wrong.status, 415);
  EXPECT_EQ(wrong.headers.at("accept-post"), "application/json");
  EXPECT_TRUE(form.closed());
  HttpClient client(port());
  const std::string head =
      " HTTP/1.1\r\nHost: a\r\nContent-Type: Application/JSON ; charset=utf-8\r\n"
      "Content-Length: ";
  client.send("POST /json/here" + head + "2\r\n\r\n{}");
  EXPECT_EQ(client.receive().body, "2");
  client.send("POST /json/there" + head + "1000000\r\n\r\n");
  EXPECT_EQ(client.receive().status, 404) << "before the body";
  EXPECT_TRUE(client.closed());
}

TEST_F(HttpServer, BodiesShareOneBudget) {
  ServerOptions options;
  options.buffer_bytes = 4'000'000;
  start(options);
  const auto begin = [&](HttpClient& client) {
    client.send(
        "POST /json/here HTTP/1.1\r\nHost: a\r\nContent-Type: application/json\r\n"
        "Content-Length: 1000000\r\n\r\n" +
        std::string(999'999, ' '));
  };
  std::vector<std::unique_ptr<HttpClient>> clients;
  for (int i = 0; i < 3; ++i) {
    begin(*clients.emplace_back(std::make_unique<HttpClient>(port())));
    while (held() < std::size_t(i + 1) * 1'000'000) std::this_thread::sleep_for(milliseconds(1));
  }
  for (int i = 0; i < 20; ++i) begin(*clients.emplace_back(std::make_unique<HttpClient>(port())));
  int refused = 0;
  for (std::size_t i = 3; i < clients.size(); ++i) {
    clients[i]->send(" ");
    const HttpReply reply = clients[i]->receive();
    refused += reply.status == 503;
    if (reply.status == 503) {
      EXPECT_EQ(reply.headers.at("retry-after"), "1");
    } else {
      EXPECT_EQ(reply.body, "1000000");
    }
    EXPECT_LE(held(), 4'000'000u);
  }
  EXPECT_GT(refused, 0);
  for (std::size_t i = 0; i < 3; ++i) {
    clients[i]->send(" ");
    EXPECT_EQ(clients[i]->receive().body, "1000000");
  }
  clients.clear();
  while (running_->server().stats().connections > 0) std::this_thread::sleep_for(milliseconds(1));
  EXPECT_EQ(held(), 0u);
}

TEST_F(HttpServer, ResponsesThatNobodyReadsShareOneBudget) {
  ServerOptions options;
  options.buffer_bytes = 22'000'000;
  start(options);
  std::vector<std::unique_ptr<HttpClient>> clients;
  for (int i = 0; i < 6; ++i) {
    clients.push_back(std::make_unique<HttpClient>(port()));
    for (int k = 0; k < 2; ++k) clients.back()->send("GET /large HTTP/1.1\r\nHost: a\r\n\r\n");
  }
  // Each holds at most one: a client must take the first before the second is asked for. Some of
  // what is sent lies in the kernel, which is why all of it is counted until the last byte is gone.
  while (!running_->server().stats().rejected.contains("memory"))
    std::this_thread::sleep_for(milliseconds(1));
  EXPECT_LE(held(), 22'000'000u);
  EXPECT_TRUE(alive()) << "small replies need no room";
  int whole = 0;
  for (const auto& client : clients)
    for (int k = 0; k < 2; ++k) {
      const HttpReply reply = client->receive();
      if (reply.status == 200) {
        EXPECT_EQ(reply.body.size(), 5'000'000u);
        ++whole;
      } else {
        EXPECT_EQ(reply.status, 503);
        EXPECT_EQ(reply.headers.at("retry-after"), "1");
      }
    }
  EXPECT_GE(whole, 4);
  while (held() > 0) std::this_thread::sleep_for(milliseconds(1));
}

TEST_F(HttpServer, ABodyInPiecesCountsOnceAndArrivesWhole) {
  start();
  HttpClient client(port());
  std::string all = "[";
  for (int i = 0; i < 3000; ++i) all += "," + std::string(std::size_t(i % 7) * 700, 'p');
  client.send("HEAD /pieces HTTP/1.1\r\nHost: a\r\n\r\n");
  const HttpReply head = client.receive(true);
  EXPECT_EQ(head.headers.at("content-length"), std::to_string(all.size()));
  std::vector<std::unique_ptr<HttpClient>> clients;
  for (int i = 0; i < 8; ++i) {
    clients.push_back(std::make_unique<HttpClient>(port()));
    clients.back()->send("GET /pieces HTTP/1.1\r\nHost: a\r\n\r\n");
  }
  while (held() == 0) std::this_thread::sleep_for(milliseconds(1));
  for (const auto& other : clients) {
    EXPECT_LT(held(), 8u * 300'000u) << "eight of " << all.size() << " bytes";
    EXPECT_EQ(other->receive().body, all);
  }
  while (held() > 0) std::this_thread::sleep_for(milliseconds(1));
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

/// What a connection is left with, after which exchanges, and how much of their answers its client
/// has taken meanwhile: every one ends by itself, and says why where a request was begun.
TEST_F(HttpServer, EveryWaitEnds) {
  ServerOptions options;
  options.limits.head_timeout = options.limits.idle_timeout = milliseconds(400);
  options.limits.body_timeout = milliseconds(400);
  options.limits.linger_timeout = milliseconds(100);
  start(options);
  const std::string get = " HTTP/1.1\r\nHost: a\r\n\r\n";
  const std::string post = "POST /count HTTP/1.1\r\nHost: a\r\nContent-Length: 5\r\n\r\n";
  struct Before {
    std::string bytes;
    std::vector<std::size_t> bodies;  // of the answers
  };
  const Before befores[] = {{"", {}},
                            {"GET /" + get, {5}},
                            {post + "hello", {1}},
                            {"GET /medium" + get, {200'000}},
                            {"GET /medium" + get + post + "hello", {200'000, 1}},
                            {"GET /later" + get, {5}},
                            {"GET /medium" + get + "GET /later" + get, {200'000, 5}}};
  struct Left {
    std::string bytes;
    int status;  // 0: closed without a word
  };
  const Left lefts[] = {
      {"", 0}, {"GET / HT", 408}, {post, 408}, {post + "hell", 408}, {"GET /later" + get, 200}};
  struct Case {
    const Before& before;
    const Left& left;
    std::unique_ptr<HttpClient> client;
  };
  std::vector<Case> cases;
  for (const Before& before : befores)
    for (const Left& left : lefts)
      for (const bool narrow : {false, true}) {
        Case& c =
            cases.emplace_back(before, left, std::make_unique<HttpClient>(port(), nullptr, narrow));
        c.client->send(before.bytes + left.bytes);
      }
  std::this_thread::sleep_for(milliseconds(600));  // longer than any but a blocked write has
  std::atomic<bool> stop{false};
  std::thread answering([&] {
    while (!stop) {
      parked_.answer("later");
      std::this_thread::sleep_for(milliseconds(1));
    }
  });
  for (const Case& c : cases) {
    const std::string what = "after \"" + c.before.bytes + "\", \"" + c.left.bytes + "\"";
    for (const std::size_t size : c.before.bodies)
      EXPECT_EQ(c.client->receive().body.size(), size) << what;
    if (c.left.status != 0) {
      EXPECT_EQ(c.client->receive().status, c.left.status) << what;
    }
    EXPECT_TRUE(c.client->closed()) << what;
  }
  stop = true;
  answering.join();
  while (running_->server().stats().connections > 0) std::this_thread::sleep_for(milliseconds(5));
}

TEST_F(HttpServer, ABusyPipelinerHasTheWholeTimeForEachHead) {
  ServerOptions options;
  options.limits.head_timeout = milliseconds(1000);
  start(options);
  HttpClient client(port());
  // Never a moment without half a head, for three times as long as one head may take.
  client.send("GET / HT");
  for (int i = 0; i < 30; ++i) {
    std::this_thread::sleep_for(milliseconds(100));
    client.send("TP/1.1\r\nHost: a\r\n\r\nGET / HT");
    ASSERT_EQ(client.receive().status, 200) << i;
  }
}

TEST_F(HttpServer, ASteadyReaderIsNotCut) {
  ServerOptions options;
  options.limits.write_timeout = milliseconds(500);
  start(options);
  HttpClient client(port(), nullptr, true);
  client.send("GET /large HTTP/1.1\r\nHost: a\r\n\r\n");
  // So slowly that the kernel finds the socket not worth writing to for much longer than that.
  std::size_t taken = 0;
  for (int i = 0; i < 100; ++i) {
    std::this_thread::sleep_for(milliseconds(20));
    taken += client.take(2000);
  }
  EXPECT_EQ(taken, 200'000u);
  EXPECT_EQ(client.receive().body.size(), 5'000'000u);
}

TEST_F(HttpServer, AReaderBelowTheLeastRateIsCut) {
  ServerOptions options;
  options.limits.write_timeout = milliseconds(300);
  options.limits.write_rate = 10'000'000;
  start(options);
  HttpClient client(port(), nullptr, true);
  for (int i = 0; i < 4; ++i) client.send("GET /large HTTP/1.1\r\nHost: a\r\n\r\n");
  while (running_->server().stats().accepted == 0 || running_->server().stats().connections > 0) {
    client.take(2000);
    std::this_thread::sleep_for(milliseconds(10));
  }
  EXPECT_EQ(held(), 0u);
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

TEST_F(HttpServer, WhoHangsUpWhileAHandlerWorksIsNoticed) {
  ServerOptions options;
  options.limits.look_after = milliseconds(100);
  start(options);
  const auto first_has_gone = [&] {
    const std::lock_guard lock(parked_.mutex);
    return parked_.waiting.front().gone().stop_requested();
  };
  for (const char* more : {"", "GET / HTTP/1.1\r\nHost: a\r\n\r\n"}) {  // and does not read on
    auto client = std::make_unique<HttpClient>(port());
    client->send("GET /later HTTP/1.1\r\nHost: a\r\n\r\n" + std::string(more));
    parked_.wait_for(1);
    std::this_thread::sleep_for(milliseconds(300));
    EXPECT_FALSE(first_has_gone()) << "it is waiting";
    client.reset();
    while (!first_has_gone()) std::this_thread::sleep_for(milliseconds(5));
    parked_.answer("to nobody");
    while (running_->server().stats().connections > 0) std::this_thread::sleep_for(milliseconds(5));
  }
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

TEST_F(HttpServer, WhoOnlyWaitsGivesWay) {
  ServerOptions options;
  options.threads = 1;
  options.limits.connections = 3;
  start(options);
  HttpClient kept(port()), silent(port()), busy(port());
  EXPECT_EQ(kept.get("/").status, 200);
  busy.send("GET /later HTTP/1.1\r\nHost: a\r\n\r\n");
  parked_.wait_for(1);
  HttpClient fourth(port());
  EXPECT_EQ(fourth.get("/").status, 200);
  EXPECT_TRUE(silent.closed()) << "it never asked for anything: the first to go";
  HttpClient fifth(port());
  EXPECT_EQ(fifth.get("/").status, 200);
  EXPECT_TRUE(kept.closed()) << "idle for longest";
  EXPECT_EQ(fourth.get("/").status, 200);
  parked_.answer("done");
  EXPECT_EQ(busy.receive().body, "done");
  EXPECT_EQ(running_->server().stats().rejected.at("gave_way"), 2u);
}

TEST_F(HttpServer, HalfRequestsGiveWay) {
  ServerOptions options;
  options.threads = 1;
  options.limits.connections = 3;
  options.limits.stall_age = milliseconds(0);
  start(options);
  HttpClient busy(port()), head(port()), body(port());
  busy.send("GET /later HTTP/1.1\r\nHost: a\r\n\r\n");
  head.send("GET / HT");
  body.send("POST /count HTTP/1.1\r\nHost: a\r\nContent-Length: 9\r\nExpect: 100-continue\r\n\r\n");
  parked_.wait_for(1);
  EXPECT_EQ(body.receive().status, 100);
  std::vector<std::unique_ptr<HttpClient>> more;
  for (std::size_t i = 0; i < 2; ++i) {
    more.push_back(std::make_unique<HttpClient>(port()));
    more.back()->send("GET /later HTTP/1.1\r\nHost: a\r\n\r\n");
    parked_.wait_for(2 + i);
  }
  EXPECT_TRUE(head.closed());
  EXPECT_TRUE(body.closed());
  EXPECT_EQ(HttpClient(port()).get("/").status, 503) << "all are busy now";
  parked_.answer("done");
  EXPECT_EQ(busy.receive().body, "done");
  for (const auto& client : more) EXPECT_EQ(client->receive().body, "done");
}

TEST_F(HttpServer, WhoIsStillSendingKeepsItsPlace) {
  ServerOptions options;
  options.threads = 1;
  options.limits.connections = 1;
  options.limits.stall_age = std::chrono::hours(1);
  start(options);
  HttpClient slow(port());
  slow.send("POST /count HTTP/1.1\r\nHost: a\r\nContent-Length: 3\r\nExpect: 100-continue\r\n\r\n");
  EXPECT_EQ(slow.receive().status, 100);
  EXPECT_EQ(HttpClient(port()).get("/").status, 503);
  slow.send("abc");
  EXPECT_EQ(slow.receive().body, "3");
}

TEST_F(HttpServer, EveryThreadIsAskedWhoGivesWay) {
  ServerOptions options;
  options.threads = 3;
  options.limits.per_address = 1;
  start(options);
  // One on each thread, since each has fewest before it comes.
  HttpClient a(port(), "127.0.0.3"), b(port(), "127.0.0.4"), c(port(), "127.0.0.5");
  while (running_->server().stats().connections < 3) std::this_thread::sleep_for(milliseconds(1));
  for (const char* from : {"127.0.0.3", "127.0.0.4", "127.0.0.5"})
    EXPECT_EQ(HttpClient(port(), from).get("/").body, "hello") << from;
}

TEST_F(HttpServer, TooManyBusyConnectionsAreToldSo) {
  ServerOptions options;
  options.threads = 1;
  options.limits.connections = 2;
  options.limits.extra = 2;
  start(options);
  HttpClient first(port()), second(port());
  for (HttpClient* client : {&first, &second})
    client->send("GET /later HTTP/1.1\r\nHost: a\r\n\r\n");
  parked_.wait_for(2);
  HttpClient third(port());
  const HttpReply told = third.get("/");
  EXPECT_EQ(told.status, 503);
  EXPECT_EQ(told.headers.at("retry-after"), "1");
  EXPECT_TRUE(third.closed());
  // However many hold on to the last places, whoever asks for its health is answered.
  std::vector<std::unique_ptr<HttpClient>> silent;
  for (int i = 0; i < 50; ++i) {
    silent.push_back(std::make_unique<HttpClient>(port()));
    if (i % 2 == 0) silent.back()->send("GET / HT");
    const HttpReply health = HttpClient(port()).get("/health");
    EXPECT_EQ(health.body, "well") << i;
    EXPECT_EQ(health.headers.at("connection"), "close");
  }
  EXPECT_LE(running_->server().stats().connections, 4u);
  EXPECT_GE(running_->server().stats().rejected.at("too_many_connections"), 1u);
  parked_.answer("done");
  EXPECT_EQ(first.receive().body, "done");
  EXPECT_EQ(second.receive().body, "done");
}

TEST_F(HttpServer, OneAddressCannotTakeEveryPlace) {
  ServerOptions options;
  options.threads = 1;
  options.limits.connections = 8;
  options.limits.per_address = 2;
  start(options);
  std::vector<std::unique_ptr<HttpClient>> busy;
  for (int i = 0; i < 2; ++i) {
    busy.push_back(std::make_unique<HttpClient>(port()));
    busy.back()->send("GET /later HTTP/1.1\r\nHost: a\r\n\r\n");
  }
  parked_.wait_for(2);
  HttpClient third(port());
  EXPECT_EQ(third.get("/").status, 503);
  EXPECT_EQ(HttpClient(port()).get("/health").status, 200);
  HttpClient other(port(), "127.0.0.2");
  EXPECT_EQ(other.get("/").status, 200);
  EXPECT_EQ(running_->server().stats().rejected.at("too_many_from_one_address"), 1u);
  parked_.answer("done");
  for (const auto& client : busy) EXPECT_EQ(client->receive().body, "done");
  HttpClient again(port());
  EXPECT_EQ(again.get("/").status, 200) << "those only wait now";
  EXPECT_EQ(other.get("/").status, 200) << "and not for another address";
}

TEST_F(HttpServer, SilentConnectionsKeepNobodyOut) {
  ServerOptions options;
  options.limits.connections = 400;
  options.limits.per_address = 100;
  start(options);
  std::vector<std::unique_ptr<HttpClient>> silent;
  for (const char* from : {"127.0.0.3", "127.0.0.4", "127.0.0.5", "127.0.0.6", "127.0.0.7"})
    for (int i = 0; i < 120; ++i) silent.push_back(std::make_unique<HttpClient>(port(), from));
  for (const char* from : {"127.0.0.3", "127.0.0.1", "127.0.0.2"}) {
    EXPECT_EQ(HttpClient(port(), from).get("/").body, "hello") << from;
    EXPECT_EQ(HttpClient(port(), from).get("/health").body, "well") << from;
  }
}

TEST_F(HttpServer, SurvivesRunningOutOfDescriptors) {
  ServerOptions options;
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
