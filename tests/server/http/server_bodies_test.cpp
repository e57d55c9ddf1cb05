// Bodies of requests and of answers: lengths, limits, and the memory that all of them share.

#include "tests/server/http/server_fixture.h"

namespace tind::http {
namespace {

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
  options.buffer_bytes = 28'000'000;
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
  EXPECT_LE(held(), 28'000'000u);
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

TEST_F(HttpServer, ASlowReaderGetsAllOfALargeReply) {
  HttpClient client(port());
  for (int i = 0; i < 4; ++i) client.send("GET /large HTTP/1.1\r\nHost: a\r\n\r\n");
  for (int i = 0; i < 4; ++i) {
    std::this_thread::sleep_for(milliseconds(20));
    EXPECT_EQ(client.receive().body.size(), 5'000'000u);
  }
}

}  // namespace
}  // namespace tind::http
