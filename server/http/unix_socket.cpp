// The socket is bound under another name, given its mode, and moved to its own: it is never there
// with other rights, and two that start at once do not remove each other's.

#include "server/http/unix_socket.h"

#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

#include "terrain/base/descriptor.h"
#include "terrain/base/errno_text.h"

namespace tind::http {
namespace {

std::unexpected<Error> cannot(const std::string& path, const std::string& what) {
  return fail(Errc::io, "cannot listen at " + path + ": " + what);
}

sockaddr_un address_of(const std::string& path) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  std::memcpy(address.sun_path, path.data(), path.size());
  return address;
}

int new_socket() { return ::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0); }

/// Nothing at the path, or a socket that nobody listens at.
Result<void> is_free(const std::string& path) {
  struct stat there {};
  if (::lstat(path.c_str(), &there) != 0)
    return errno == ENOENT ? Result<void>() : cannot(path, errno_text(errno));
  if (!S_ISSOCK(there.st_mode)) return cannot(path, "there is a file that is no socket");
  const Descriptor probe(new_socket());
  const sockaddr_un address = address_of(path);
  if (::connect(probe.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0 ||
      errno == EAGAIN)
    return cannot(path, "another process listens there");
  if (errno != ECONNREFUSED) return cannot(path, errno_text(errno));
  return {};
}

}  // namespace

Result<UnixSocket> UnixSocket::listen(const std::string& path, int backlog) {
  const std::string before = path + ".new";
  if (path.empty() || before.size() >= sizeof(sockaddr_un::sun_path))
    return fail(Errc::invalid_argument, path + ": the path of a socket has 1 to " +
                                            std::to_string(sizeof(sockaddr_un::sun_path) - 5) +
                                            " bytes");
  for (const std::string& one : {path, before})
    if (auto free = is_free(one); !free) return std::unexpected(free.error());
  Descriptor fd(new_socket());
  if (fd.get() < 0) return cannot(path, errno_text(errno));
  ::unlink(before.c_str());
  const sockaddr_un address = address_of(before);
  if (::bind(fd.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0)
    return cannot(path, errno_text(errno));
  // Nobody can connect before listen().
  struct stat made {};
  if (::chmod(before.c_str(), S_IRUSR | S_IWUSR) != 0 || ::stat(before.c_str(), &made) != 0 ||
      ::listen(fd.get(), backlog) != 0 || ::rename(before.c_str(), path.c_str()) != 0) {
    const int error = errno;
    ::unlink(before.c_str());
    return cannot(path, errno_text(error));
  }
  return UnixSocket(path, made.st_ino, fd.release());
}

UnixSocket::~UnixSocket() {
  if (fd_ >= 0) ::close(fd_);
  struct stat there {};
  if (!path_.empty() && ::lstat(path_.c_str(), &there) == 0 && there.st_ino == inode_)
    ::unlink(path_.c_str());
}

}  // namespace tind::http
