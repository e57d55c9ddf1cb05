// Asks a fork server (fork_server.cc) for a start of `tind` with these arguments, this environment,
// these streams and this folder; ends as that ends. TIND_FORK_SOCKET: where it listens.
#include <fcntl.h>
#include <signal.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <string>

#include "tests/support/fork_wire.h"

namespace {

[[noreturn]] void no(const char* what) {
  std::perror(what);
  _exit(127);
}

void send_all(int fd, const char* p, std::size_t n) {
  while (n > 0) {
    const ssize_t sent = write(fd, p, n);
    if (sent <= 0) no("fork_client: write");
    p += sent, n -= static_cast<std::size_t>(sent);
  }
}

}  // namespace

int main(int argc, char** argv) {
  sockaddr_un place = {};
  place.sun_family = AF_UNIX;
  const char* const name = std::getenv("TIND_FORK_SOCKET");
  if (!name || std::strlen(name) >= sizeof place.sun_path) no("fork_client: TIND_FORK_SOCKET");
  std::strcpy(place.sun_path, name);
  unsetenv("TIND_FORK_SOCKET");
  const int server = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
  if (connect(server, reinterpret_cast<const sockaddr*>(&place), sizeof place) != 0)
    no("fork_client: connect");

  std::string words;
  for (int i = 0; i < argc; ++i) words.append(argv[i]).push_back('\0');
  for (char** e = environ; *e; ++e) words.append(*e).push_back('\0');
  tind::test::ForkAsked asked{argc, 0, words.size()};
  const int folder = open(".", O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  int fds[tind::test::kForkFds] = {0, 1, 2, folder};
  for (int fd = 0; fd < 3; ++fd)
    if (fcntl(fd, F_GETFD) < 0) asked.closed |= 1 << fd, fds[fd] = folder;
  iovec part = {&asked, sizeof asked};
  alignas(cmsghdr) char control[CMSG_SPACE(sizeof fds)] = {};
  msghdr message = {};
  message.msg_iov = &part, message.msg_iovlen = 1;
  message.msg_control = control, message.msg_controllen = sizeof control;
  cmsghdr* const passed = CMSG_FIRSTHDR(&message);
  passed->cmsg_level = SOL_SOCKET, passed->cmsg_type = SCM_RIGHTS;
  passed->cmsg_len = CMSG_LEN(sizeof fds);
  std::memcpy(CMSG_DATA(passed), fds, sizeof fds);
  if (sendmsg(server, &message, 0) != sizeof asked) no("fork_client: sendmsg");
  send_all(server, words.data(), words.size());

  int status = 0;
  if (read(server, &status, sizeof status) != sizeof status) no("fork_client: the server is gone");
  if (!WIFSIGNALED(status)) return WEXITSTATUS(status);
  signal(WTERMSIG(status), SIG_DFL);
  raise(WTERMSIG(status));
  return 128 + WTERMSIG(status);
}
