// A server at a file.

#include "server/http/unix_socket.h"

#include <gtest/gtest.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <cstring>
#include <filesystem>
#include <fstream>

#include "tests/support/http_client.h"
#include "tests/support/support.h"

namespace tind::http {
namespace {

namespace fs = std::filesystem;

int connected(const std::string& path) {
  const int fd = ::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  std::memcpy(address.sun_path, path.data(), path.size());
  if (::connect(fd, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0) return fd;
  ::close(fd);
  return -1;
}

TEST(UnixSocket, ServesItsOwnerAndIsGoneAfterwards) {
  const test::TempDir folder;
  const std::string path = folder.file("s");
  Router router;
  router.get("/a",
             [](const Request&, DeferredReply&) { return make_reply(200, "text/plain", "b"); });
  ServerOptions options;
  options.socket = path;
  {
    test::RunningServer server(router, options);
    EXPECT_EQ(server.server().url(), "unix:" + path);
    struct stat made {};
    ASSERT_EQ(::stat(path.c_str(), &made), 0);
    EXPECT_TRUE(S_ISSOCK(made.st_mode));
    EXPECT_EQ(made.st_mode & 0777, 0600u);
    const int fd = connected(path);
    ASSERT_GE(fd, 0);
    const std::string request = "GET /a HTTP/1.1\r\nHost: h\r\nConnection: close\r\n\r\n";
    EXPECT_EQ(::send(fd, request.data(), request.size(), MSG_NOSIGNAL), ssize_t(request.size()));
    std::string reply;
    char bytes[4096];
    for (ssize_t n = 0; (n = ::read(fd, bytes, sizeof bytes)) > 0;) reply.append(bytes, size_t(n));
    ::close(fd);
    EXPECT_TRUE(reply.starts_with("HTTP/1.1 200 ")) << reply;
    EXPECT_TRUE(reply.ends_with("\r\n\r\nb")) << reply;
  }
  EXPECT_FALSE(fs::exists(path));
}

TEST(UnixSocket, ReplacesOnlyWhatNobodyListensAt) {
  const test::TempDir folder;
  const std::string path = folder.file("s");
  {
    auto first = UnixSocket::listen(path, 4);
    ASSERT_TRUE(first) << first.error().what;
    const auto second = UnixSocket::listen(path, 4);
    ASSERT_FALSE(second);
    EXPECT_NE(second.error().what.find("another process listens"), std::string::npos);
    // As a process leaves it that is killed.
    fs::rename(path, path + ".left");
  }
  fs::rename(path + ".left", path);
  EXPECT_EQ(connected(path), -1);
  {
    auto again = UnixSocket::listen(path, 4);
    ASSERT_TRUE(again) << again.error().what;
    const int fd = connected(path);
    EXPECT_GE(fd, 0);
    ::close(fd);
  }
  std::ofstream(path) << "precious";
  const auto file = UnixSocket::listen(path, 4);
  ASSERT_FALSE(file);
  EXPECT_NE(file.error().what.find("no socket"), std::string::npos);
  EXPECT_EQ(fs::file_size(path), 8u);
  EXPECT_FALSE(UnixSocket::listen(folder.file(std::string(200, 'a')), 4));
  EXPECT_FALSE(UnixSocket::listen(folder.file("none/s"), 4));
}

}  // namespace
}  // namespace tind::http
