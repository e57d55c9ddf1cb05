// Every wait for a client ends, and those who are only slow are not cut.

#include <atomic>

#include "tests/server/http/server_fixture.h"

namespace tind::http {
namespace {

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
    return parked_.waiting.front().asker().gone.stop_requested();
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

}  // namespace
}  // namespace tind::http
