// Who keeps a place when there are too many clients, and who gives way.

#include <sys/resource.h>

#include "tests/server/http/server_fixture.h"

namespace tind::http {
namespace {

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

}  // namespace
}  // namespace tind::http
