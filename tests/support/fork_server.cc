// Starts `tind` without loading it again. Loading GDAL and what it needs takes longer than most of
// what tests ask of the program, so one process loads it all and waits before main(); each start is
// a fork of it. Preloaded into the program as it is: its main(), its static objects and what it
// prints are those of a start of its own. tests/support/fork_client.cc is what asks; program.cpp
// starts both.
//
// TIND_FORK_SERVER: "LISTENING,ALIVE", a socket and a pipe that ends with whoever wants the server.
#include <dlfcn.h>
#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <map>
#include <string>
#include <vector>

#include "tests/support/fork_wire.h"

namespace {

using Main = int (*)(int, char**, char**);
using Start = int (*)(Main, int, char**, void (*)(), void (*)(), void (*)(), void*);

int wake[2];

/// What a start hands over.
struct Asked : tind::test::ForkAsked {
  int fds[tind::test::kForkFds];
  std::string words;
};

bool read_all(int fd, void* to, std::size_t n) {
  for (auto* p = static_cast<char*>(to); n > 0;) {
    const ssize_t got = read(fd, p, n);
    if (got < 0 && errno == EINTR) continue;
    if (got <= 0) return false;
    p += got, n -= static_cast<std::size_t>(got);
  }
  return true;
}

bool receive(int conversation, Asked& asked) {
  tind::test::ForkAsked& head = asked;
  iovec part = {&head, sizeof head};
  alignas(cmsghdr) char control[CMSG_SPACE(sizeof asked.fds)];
  msghdr message = {};
  message.msg_iov = &part, message.msg_iovlen = 1;
  message.msg_control = control, message.msg_controllen = sizeof control;
  if (recvmsg(conversation, &message, MSG_CMSG_CLOEXEC) != sizeof head) return false;
  const cmsghdr* const passed = CMSG_FIRSTHDR(&message);
  if (!passed || passed->cmsg_type != SCM_RIGHTS) return false;
  std::memcpy(asked.fds, CMSG_DATA(passed), sizeof asked.fds);
  asked.words.resize(asked.bytes);
  return read_all(conversation, asked.words.data(), asked.words.size());
}

/// As the kernel lays them out: arguments, null, environment, null.
std::vector<char*> start_of(Asked& asked) {
  std::vector<char*> start;
  for (char *p = asked.words.data(), *end = p + asked.words.size(); p < end; p += strlen(p) + 1) {
    if (static_cast<int>(start.size()) == asked.argc) start.push_back(nullptr);
    start.push_back(p);
  }
  if (static_cast<int>(start.size()) == asked.argc) start.push_back(nullptr);
  start.push_back(nullptr);
  return start;
}

void tell(int conversation, int status) {
  [[maybe_unused]] const auto told = send(conversation, &status, sizeof status, MSG_NOSIGNAL);
  close(conversation);
}

/// Returns in a child only.
Asked* serve(int listening, int alive) {
  if (pipe2(wake, O_CLOEXEC | O_NONBLOCK) != 0) _exit(1);
  struct sigaction act = {}, usual = {};
  act.sa_handler = [](int) { [[maybe_unused]] const auto told = write(wake[1], "", 1); };
  sigaction(SIGCHLD, &act, &usual);
  std::map<pid_t, int> running;  // and who waits for it
  for (;;) {
    pollfd events[] = {{listening, POLLIN, 0}, {alive, 0, 0}, {wake[0], POLLIN, 0}};
    if (poll(events, 3, -1) < 0 && errno != EINTR) _exit(1);
    if (events[1].revents) {  // nobody wants it any more
      for (const auto& [pid, conversation] : running) kill(pid, SIGKILL);
      _exit(0);
    }
    char drained[64];
    while (read(wake[0], drained, sizeof drained) > 0) {
    }
    int status = 0;
    for (pid_t pid; (pid = waitpid(-1, &status, WNOHANG)) > 0;)
      if (const auto at = running.find(pid); at != running.end())
        tell(at->second, status), running.erase(at);
    if (!(events[0].revents & POLLIN)) continue;
    const int conversation = accept4(listening, nullptr, nullptr, SOCK_CLOEXEC);
    auto* const asked = new Asked;
    if (conversation < 0 || !receive(conversation, *asked)) {
      close(conversation);
      delete asked;
      continue;
    }
    const pid_t pid = fork();
    if (pid == 0) {
      sigaction(SIGCHLD, &usual, nullptr);
      for (const int fd : {wake[0], wake[1], listening, alive, conversation}) close(fd);
      for (const auto& [other, waits] : running) close(waits);
      return asked;
    }
    for (const int fd : asked->fds) close(fd);
    delete asked;
    if (pid < 0) {
      tell(conversation, 127 << 8);
      continue;
    }
    running[pid] = conversation;
  }
}

}  // namespace

extern "C" int __libc_start_main(Main main, int argc, char** argv, void (*init)(), void (*fini)(),
                                 void (*loader)(), void* stack) {
  const auto start = reinterpret_cast<Start>(dlsym(RTLD_NEXT, "__libc_start_main"));
  int listening = -1, alive = -1;
  const char* const told = std::getenv("TIND_FORK_SERVER");
  if (!told || std::sscanf(told, "%d,%d", &listening, &alive) != 2)
    return start(main, argc, argv, init, fini, loader, stack);
  Asked* const asked = serve(listening, alive);
  static std::vector<char*> words;
  words = start_of(*asked);
  environ = words.data() + asked->argc + 1;
  for (int fd = 0; fd < 3; ++fd)
    if (asked->closed >> fd & 1)
      close(fd);
    else
      dup2(asked->fds[fd], fd);
  if (fchdir(asked->fds[3]) != 0) _exit(127);
  for (const int fd : asked->fds)
    if (fd > 2) close(fd);
  return start(main, asked->argc, words.data(), init, fini, loader, stack);
}
