// Pages of elsewhere whose name was made to lead to this machine.

#include "server/api/web_pages.h"

#include "tests/server/api/processes_fixture.h"

namespace tind::api {
namespace {

TEST_F(ProcessesApi, AreNotForPagesUnderForeignNames) {
  app_.job_pages = {{"terrain.example.org"}, {"https://gis.example.org", "*"}};
  const auto status = [&](const std::string& target, const std::string& host,
                          const std::string& fields) {
    HttpClient client(port());
    client.send("GET " + target + " HTTP/1.1\r\nHost: " + host + "\r\n" + fields + "\r\n");
    return client.receive().status;
  };
  const std::string page = "Sec-Fetch-Site: same-origin\r\n";
  EXPECT_EQ(status("/jobs", "evil.com:80", page), 403);
  EXPECT_EQ(status("/jobs", "evil.com", "Origin: http://evil.com\r\n"), 403);
  EXPECT_EQ(status("/jobs/0123/results", "127.0.0.1.evil.com", page), 403);
  EXPECT_EQ(status("/jobs", "localhost.evil.com", page), 403);
  for (const char* host : {"127.0.0.1:8080", "localhost", "[::1]:80", "Terrain.Example.org:443"})
    EXPECT_EQ(status("/jobs", host, page), 200) << host;
  EXPECT_EQ(status("/jobs", "evil.com", ""), 403) << "a page, too, asks its own origin like that";
  EXPECT_EQ(status("/jobs", "127.0.0.1", "Origin: http://evil.com\r\n"), 403);
  EXPECT_EQ(status("/jobs", "127.0.0.1", "Origin: null\r\n"), 403);
  EXPECT_EQ(status("/jobs", "127.0.0.1", "Origin: http://localhost:3000\r\n"), 200);
  EXPECT_EQ(status("/jobs", "127.0.0.1", "Origin: https://gis.example.org\r\n"), 200);
  EXPECT_EQ(status("/datasets", "evil.com", page), 200) << "no secret";

  HttpClient client(port());
  client.send("DELETE /jobs/0123 HTTP/1.1\r\nHost: evil.com\r\nOrigin: http://evil.com\r\n\r\n");
  EXPECT_EQ(client.receive().status, 403);
  HttpClient other(port());
  const std::string body = inputs(R"("max_error": 50)");
  other.send("POST /processes/simplify/execution HTTP/1.1\r\nHost: evil.com\r\n" + page +
             "Content-Type: application/json\r\nContent-Length: " + std::to_string(body.size()) +
             "\r\n\r\n" + body);
  EXPECT_EQ(other.receive().status, 403);
}

}  // namespace
}  // namespace tind::api
