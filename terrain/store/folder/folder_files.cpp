#include "terrain/store/folder/folder_files.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <filesystem>

#include "terrain/base/errno_text.h"
#include "terrain/base/whole_io.h"

namespace tind {

namespace {

Result<void> cannot(const std::string& what, const std::string& path, int code) {
  return fail(Errc::io, "cannot " + what + " " + path + ": " + errno_text(code));
}

/// A descriptor that ends with its scope.
struct Opened {
  Opened(const std::string& path, int flags)
      : file(::open(path.c_str(), flags | O_CLOEXEC, 0666)) {}
  ~Opened() {
    if (file >= 0) ::close(file);
  }
  Opened(const Opened&) = delete;
  Opened& operator=(const Opened&) = delete;
  int file;
};

}  // namespace

Result<void> FolderFiles::make_folder(const std::string& path) {
  std::error_code error;
  std::filesystem::create_directories(path, error);
  if (error) return cannot("make the folder", path, error.value());
  return {};
}

Result<void> FolderFiles::write(const std::string& path, std::string_view bytes) {
  // Not through a link: who knows whose file it would be.
  const int file =
      ::open(path.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_NOFOLLOW | O_CLOEXEC, 0666);
  if (file < 0 && errno == ELOOP)
    return fail(Errc::invalid_argument, path + " is in the way: it is a link");
  if (file < 0) return cannot("create", path, errno);
  int code = write_whole_at(file, 0, bytes);
  if (::close(file) != 0 && code == 0) code = errno;  // some report a full disk here
  if (code == 0) return {};
  ::unlink(path.c_str());
  return cannot("write", path, code);
}

Result<void> FolderFiles::write_at(const std::string& path, std::uint64_t at,
                                   std::string_view bytes) {
  const Opened to(path, O_WRONLY);
  if (to.file < 0) return cannot("open", path, errno);
  if (const int code = write_whole_at(to.file, at, bytes)) return cannot("write", path, code);
  return {};
}

Result<void> FolderFiles::rename(const std::string& from, const std::string& to) {
  if (::rename(from.c_str(), to.c_str()) != 0) return cannot("put into place", to, errno);
  return {};
}

Result<void> FolderFiles::remove(const std::string& path) {
  std::error_code error;
  std::filesystem::remove(path, error);
  if (error) return cannot("remove", path, error.value());
  return {};
}

Result<void> FolderFiles::sync_file(const std::string& path) {
  const Opened it(path, O_RDONLY);
  if (it.file < 0 || ::fsync(it.file) != 0) return cannot("sync", path, errno);
  return {};
}

Result<void> FolderFiles::sync_folder(const std::string& path) {
  const Opened it(path, O_RDONLY | O_DIRECTORY);
  // Some network file systems do not sync folders: their servers keep names by themselves.
  if (it.file < 0 || (::fsync(it.file) != 0 && errno != EINVAL)) return cannot("sync", path, errno);
  return {};
}

Result<void> FolderFiles::sync_all(const std::string& folder) {
  const Opened it(folder, O_RDONLY | O_DIRECTORY);
  if (it.file < 0 || ::syncfs(it.file) != 0) return cannot("sync", folder, errno);
  return {};
}

}  // namespace tind
