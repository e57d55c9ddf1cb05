// A daemon whose socket is somebody else's, as under systemd.

#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <array>
#include <csignal>
#include <cstddef>
#include <cstdlib>
#include <cstring>
#include <string>

#include "server/cli/daemon/daemon_parts.h"
#include "terrain/base/descriptor.h"
#include "tests/support/daemon_process.h"
#include "tests/support/listener.h"

namespace tind::test {
namespace {

using testing::HasSubstr;

class ServiceManager : public testing::Test {
 protected:
  /// What a child does first.
  static std::function<void()> hands_over(int descriptor, const char* count = "1") {
    return [=] {
      ::dup2(descriptor, 3);
      ::fcntl(3, F_SETFD, 0);  // it may have been 3 before
      ::setenv("LISTEN_PID", std::to_string(::getpid()).c_str(), 1);
      ::setenv("LISTEN_FDS", count, 1);
    };
  }
  /// A client that has asked, whether somebody accepts it or not.
  Descriptor asked() const {
    Descriptor client(listener_.connected());
    const std::string request = "GET /livez HTTP/1.1\r\nHost: t\r\nConnection: close\r\n\r\n";
    EXPECT_EQ(::send(client.get(), request.data(), request.size(), 0), ssize_t(request.size()));
    return client;
  }
  static std::string answer(const Descriptor& client) {
    std::string all;
    std::array<char, 4096> part;
    for (ssize_t size; (size = ::recv(client.get(), part.data(), part.size(), 0)) > 0;)
      all.append(part.data(), std::size_t(size));
    return all;
  }

  Listener listener_;
};

TEST_F(ServiceManager, WhoComesBetweenTwoDaemonsIsServedByTheNextOne) {
  Descriptor waiting;
  for (int life = 0; life < 3; ++life) {
    DaemonProcess daemon(hands_over(listener_.descriptor()));
    ASSERT_TRUE(daemon.says("serving 1 datasets at " + listener_.url() + "/")) << daemon.said();
    if (life > 0) {
      EXPECT_THAT(answer(waiting), HasSubstr("200 OK"));
    }
    EXPECT_THAT(answer(asked()), HasSubstr("200 OK"));
    daemon.hears(SIGTERM);
    ASSERT_TRUE(daemon.says("stopped")) << daemon.said();
    waiting = asked();
    EXPECT_EQ(daemon.exit_code(), 0);
  }
}

/// The flag is the socket's, and any holder's to take away.
TEST_F(ServiceManager, AnotherHolderWhoTakesNonblockingAwayFreezesNoDaemon) {
  DaemonProcess daemon(hands_over(listener_.descriptor()));
  ASSERT_TRUE(daemon.says("serving 1 datasets")) << daemon.said();
  const int flags = ::fcntl(listener_.descriptor(), F_GETFL);
  ASSERT_TRUE(flags & O_NONBLOCK);
  ASSERT_EQ(::fcntl(listener_.descriptor(), F_SETFL, flags & ~O_NONBLOCK), 0);
  for (int i = 0; i < 4; ++i) EXPECT_THAT(answer(asked()), HasSubstr("200 OK"));
  daemon.hears(SIGTERM);
  EXPECT_EQ(daemon.exit_code(), 0);
}

TEST_F(ServiceManager, ADaemonWhoseSocketIsShutDownStopsAndSaysSo) {
  DaemonProcess daemon(hands_over(listener_.descriptor()));
  ASSERT_TRUE(daemon.says("serving 1 datasets")) << daemon.said();
  ASSERT_EQ(::shutdown(listener_.descriptor(), SHUT_RDWR), 0);
  EXPECT_TRUE(daemon.says("nobody can be accepted any more")) << daemon.said();
  EXPECT_EQ(daemon.exit_code(), 75);
}

TEST_F(ServiceManager, HearsWhenTheDaemonServes) {
  const TempDir folder;
  const std::string path = folder.file("notify");
  for (const std::string& name : {path, "@" + path + std::string(107 - path.size(), 'x')}) {
    sockaddr_un at{};
    at.sun_family = AF_UNIX;
    std::memcpy(at.sun_path, name.data(), name.size());
    if (name[0] == '@') at.sun_path[0] = '\0';
    const Descriptor heard(::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0));
    ASSERT_EQ(::bind(heard.get(), reinterpret_cast<sockaddr*>(&at),
                     socklen_t(offsetof(sockaddr_un, sun_path) + name.size())),
              0);
    DaemonProcess daemon([&] { ::setenv("NOTIFY_SOCKET", name.c_str(), 1); });
    std::array<char, 64> said{};
    EXPECT_GT(::recv(heard.get(), said.data(), said.size(), 0), 0);
    EXPECT_STREQ(said.data(), "READY=1");
    EXPECT_TRUE(daemon.says("serving 1 datasets"));
  }
}

TEST_F(ServiceManager, WhoCannotBeToldIsNamedInTheLog) {
  DaemonProcess daemon([] { ::setenv("NOTIFY_SOCKET", "/no/such/socket", 1); });
  EXPECT_TRUE(daemon.says("/no/such/socket")) << daemon.said();
}

TEST(ListensHereAlone, AlsoWhereAnAddressOfTheOldInternetIsWrittenAsOneOfTheNew) {
  for (const char* const here :
       {"127.0.0.1:8080", "127.9.0.1:1", "[::1]:8080", "[::ffff:127.0.0.1]:0", "[::ffff:7f00:1]:0"})
    EXPECT_TRUE(cli::listens_here_alone(here)) << here;
  for (const char* const more : {"0.0.0.0:8080", "[::]:8080", "10.0.0.1:1", "[::ffff:10.0.0.1]:0"})
    EXPECT_FALSE(cli::listens_here_alone(more)) << more;
}

TEST_F(ServiceManager, WhatIsNoSocketThatListensIsRefused) {
  const Descriptor file(::open("/dev/null", O_RDWR | O_CLOEXEC));
  const Descriptor silent(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0));
  const Descriptor datagrams(::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0));
  for (const int descriptor : {file.get(), silent.get(), datagrams.get()}) {
    DaemonProcess daemon(hands_over(descriptor));
    EXPECT_TRUE(daemon.says("ListenStream=")) << daemon.said();
    EXPECT_EQ(daemon.exit_code(), 2);
  }
  DaemonProcess daemon(hands_over(listener_.descriptor(), "2"));
  EXPECT_TRUE(daemon.says("LISTEN_FDS is 2")) << daemon.said();
  EXPECT_EQ(daemon.exit_code(), 2);
}

/// Variables of a process further up, which keeps its sockets to itself.
TEST_F(ServiceManager, SocketsOfOthersAreNone) {
  DaemonProcess daemon([] {
    ::setenv("LISTEN_PID", "1", 1);
    ::setenv("LISTEN_FDS", "1", 1);
  });
  EXPECT_TRUE(daemon.says("serving 1 datasets")) << daemon.said();
}

}  // namespace
}  // namespace tind::test
