#include "tests/support/program.h"

#include <fcntl.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <stdexcept>

namespace tind::test {

namespace {

std::string rest_of(std::FILE* file) {
  std::string text;
  std::array<char, 4096> part;
  for (std::size_t n; (n = fread(part.data(), 1, part.size(), file)) > 0;)
    text.append(part.data(), n);
  return text;
}

/// The program, loaded once for all of this process's starts (fork_server.cc). It ends with us,
/// when the pipe does.
class ForkServer {
 public:
  ForkServer() {
    const std::string socket_file = folder_.file("socket");
    sockaddr_un place = {};
    place.sun_family = AF_UNIX;
    if (socket_file.size() >= sizeof place.sun_path) throw std::runtime_error(socket_file);
    socket_file.copy(place.sun_path, socket_file.size());
    const int listening = ::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
    int alive[2];
    if (listening < 0 || pipe2(alive, O_CLOEXEC) != 0 ||
        bind(listening, reinterpret_cast<const sockaddr*>(&place), sizeof place) != 0 ||
        listen(listening, 64) != 0)
      throw std::runtime_error("no socket for the fork server");
    setenv("TIND_AS_ROOT", "true", 0);  // tests may run in a container that has no other user
    const std::string told = std::to_string(listening) + "," + std::to_string(alive[0]);
    const char* const asan = std::getenv("ASAN_OPTIONS");
    const std::string options = std::string(asan ? asan : "") + ":verify_asan_link_order=0";
    if (fork() == 0) {
      for (const int fd : {listening, alive[0]}) fcntl(fd, F_SETFD, 0);
      setenv("TIND_FORK_SERVER", told.c_str(), 1);
      setenv("LD_PRELOAD", TIND_FORK_LIBRARY, 1);
      setenv("ASAN_OPTIONS", options.c_str(), 1);
      execl(TIND_BINARY, TIND_BINARY, nullptr);
      _exit(127);
    }
    close(listening), close(alive[0]);
    command_ = "TIND_FORK_SOCKET='" + socket_file + "' " TIND_FORK_CLIENT;
  }

  const std::string& command() const { return command_; }

 private:
  TempDir folder_;
  std::string command_;
};

/// What starts the program in the shell.
const std::string& start_of_tind() {
  static const ForkServer server;
  return server.command();
}

}  // namespace

Ran run_tind(const std::string& arguments, const std::string& before) {
  const TempDir folder;
  const std::string errors = folder.file("stderr");
  // What stands before it may be of its process: limits, other libraries.
  const std::string program = before.empty() ? start_of_tind() : before + " " TIND_BINARY;
  const std::string command = program + " " + arguments + " 2>'" + errors + "'";
  Ran ran;
  std::FILE* const pipe = popen(command.c_str(), "r");
  ran.answer = rest_of(pipe);
  ran.code = WEXITSTATUS(pclose(pipe));
  ran.out = ran.answer;
  if (std::FILE* const file = std::fopen(errors.c_str(), "r")) {
    ran.out += rest_of(file);
    std::fclose(file);
  }
  return ran;
}

std::string tind_binary() { return TIND_BINARY; }

}  // namespace tind::test
