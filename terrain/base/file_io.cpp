// POSIX calls instead of streams: a stream cannot say *why* a write failed, and close() is where
// some file systems report a full disk.

#include "terrain/base/file_io.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <charconv>
#include <climits>
#include <cstdio>
#include <filesystem>
#include <random>
#include <utility>

#include "terrain/base/descriptor.h"
#include "terrain/base/errno_text.h"
#include "terrain/base/folder_entries.h"
#include "terrain/base/whole_io.h"

namespace tind {
namespace {

std::unexpected<Error> failed(const std::string& what, const std::string& path, int code,
                              Errc errc = Errc::io) {
  return fail(errc, "cannot " + what + " " + path + ": " + errno_text(code));
}

/// A link is followed, so that it stays one, also one to a file that is not there yet.
std::string target_of(const std::string& path) {
  namespace fs = std::filesystem;
  std::error_code error;
  if (const fs::path real = fs::canonical(path, error); !error) return real.string();
  fs::path target = path;
  for (int links = 0; links < 40 && fs::is_symlink(target, error); ++links)
    target = target.parent_path() / fs::read_symlink(target, error);
  return target.string();
}

/// What is open under a path, or -1: with `-o /dev/stdout > FILE` the file is the shell's, which
/// may be in the midst of it.
int open_descriptor(std::string_view path) {
  if (path == "/dev/stdout") return STDOUT_FILENO;
  if (path == "/dev/stderr") return STDERR_FILENO;
  for (const std::string_view folder : {"/dev/fd/", "/proc/self/fd/"}) {
    if (!path.starts_with(folder)) continue;
    int file = -1;
    const auto end = path.data() + path.size();
    const auto read = std::from_chars(path.data() + folder.size(), end, file);
    if (read.ec == std::errc() && read.ptr == end && ::fcntl(file, F_GETFD) >= 0) return file;
  }
  return -1;
}

std::string folder_of(const std::string& path) {
  const std::string folder = std::filesystem::path(path).parent_path().string();
  return folder.empty() ? "." : folder;
}

bool is_special(const std::string& path) {
  struct stat status {};
  return ::stat(path.c_str(), &status) == 0 && !S_ISREG(status.st_mode);
}

constexpr std::string_view kPartial = ".partial-";
constexpr std::size_t kPartialDigits = 16;

/// What may not be opened, or not now, is not what is not there: who goes on without it would lose
/// it.
Errc code_of_open(int error) {
  return error == ENOENT || error == ENOTDIR ? Errc::not_found : Errc::io;
}

/// As much of a file's name as its partial can bear.
std::string beginning_of_partial(const std::string& name) {
  return name.substr(0, NAME_MAX - kPartial.size() - kPartialDigits);
}

/// Of processes on any host, no two get the same.
std::string partial_name(const std::string& target) {
  std::random_device random;
  char digits[kPartialDigits + 1];
  std::snprintf(digits, sizeof digits, "%08x%08x", random(), random());
  const std::size_t name = target.find_last_of('/') + 1;
  return target.substr(0, name) + beginning_of_partial(target.substr(name)) +
         std::string(kPartial) + digits;
}

/// 0, or errno.
int sync_folder(const std::string& folder) {
  const int file = ::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (file < 0) return errno;
  const int code = ::fsync(file) == 0 || errno == EINVAL ? 0 : errno;  // some network file systems
  ::close(file);
  return code;
}

}  // namespace

Result<std::string> read_whole_file(const std::string& path) {
  const int file = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (file < 0) return failed("open", path, errno, code_of_open(errno));
  std::string bytes;
  struct stat status {};
  if (::fstat(file, &status) == 0 && S_ISREG(status.st_mode) && status.st_size > 0)
    bytes.reserve(std::size_t(status.st_size) + 1);
  char buffer[1 << 16];
  for (;;) {
    const ssize_t got = ::read(file, buffer, sizeof buffer);
    if (got > 0) bytes.append(buffer, std::size_t(got));
    if (got == 0) break;
    if (got < 0 && errno != EINTR) {
      const int code = errno;
      ::close(file);
      return failed("read", path, code);
    }
  }
  ::close(file);
  return bytes;
}

Result<std::string> read_regular_file(const std::string& path) {
  if (is_special(path)) return fail(Errc::io, "cannot read " + path + ": not a regular file");
  return read_whole_file(path);
}

/// A file on its way to its name, which is `path` as the caller says it. Where the file system can,
/// it has none until it is whole, so that nothing is left of it when the process is killed.
struct FileWriter::Partial {
  const std::string path, target;
  int file = -1;
  bool direct = false;    // what was open before, or no regular file: written as it comes
  bool borrowed = false;  // what was open before
  std::string name;       // while it has one that is not its own

  explicit Partial(const std::string& asked) : path(asked), target(target_of(asked)) {
    file = open_descriptor(path);
    borrowed = file >= 0;
    direct = borrowed || is_special(target);
    if (borrowed) return;
    if (direct)
      file = ::open(target.c_str(), O_WRONLY | O_CLOEXEC);
    else
      file = ::open(folder_of(target).c_str(), O_TMPFILE | O_RDWR | O_CLOEXEC, 0666);
    if (file < 0 && !direct) open_named();
  }
  ~Partial() {
    if (file >= 0 && !borrowed) ::close(file);
    if (!name.empty()) ::unlink(name.c_str());
  }
  Partial(const Partial&) = delete;
  Partial& operator=(const Partial&) = delete;

  void open_named() {
    std::string wanted = partial_name(target);
    file = ::open(wanted.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
    if (file >= 0) name = std::move(wanted);
  }
  std::unexpected<Error> not_opened() const {
    return failed(direct ? "open" : "create", path, errno);
  }

  /// What follows: 0, or errno.
  int get_a_name() {
    std::string wanted = partial_name(target);
    const std::string self = "/proc/self/fd/" + std::to_string(file);
    if (::linkat(AT_FDCWD, self.c_str(), AT_FDCWD, wanted.c_str(), AT_SYMLINK_FOLLOW) != 0)
      return copy_to_named();  // there is no /proc
    name = std::move(wanted);
    return 0;
  }
  int copy_to_named() {
    const int nameless = file;
    open_named();
    int code = file < 0 ? errno : 0;
    std::string buffer(1 << 16, '\0');
    for (off_t at = 0; code == 0;) {
      const ssize_t got = ::pread(nameless, buffer.data(), buffer.size(), at);
      if (got < 0 && errno == EINTR) continue;
      if (got < 0) code = errno;
      if (got <= 0) break;
      code = write_whole(file, {buffer.data(), std::size_t(got)});
      at += got;
    }
    ::close(nameless);
    return code == 0 ? sync() : code;
  }
  int sync() { return ::fsync(file) == 0 ? 0 : errno; }
  int finish() {
    if (borrowed) return 0;
    if (direct) return ::close(std::exchange(file, -1)) == 0 ? 0 : errno;
    int code = sync();
    if (code == 0 && name.empty()) code = get_a_name();
    if (code == 0 && ::rename(name.c_str(), target.c_str()) != 0) code = errno;
    if (code != 0) return code;
    name.clear();
    return sync_folder(folder_of(target));
  }
};

FileWriter::FileWriter(std::unique_ptr<Partial> partial) : partial_(std::move(partial)) {}
FileWriter::FileWriter(FileWriter&&) noexcept = default;
FileWriter::~FileWriter() = default;

Result<FileWriter> FileWriter::create(const std::string& path) {
  auto partial = std::make_unique<Partial>(path);
  if (partial->file < 0) return partial->not_opened();
  return FileWriter(std::move(partial));
}

Result<void> FileWriter::write(std::string_view bytes) {
  if (const int code = write_whole(partial_->file, bytes); code != 0)
    return failed("write", partial_->path, code);
  return {};
}

Result<void> FileWriter::finish() {
  if (const int code = partial_->finish(); code != 0) return failed("write", partial_->path, code);
  return {};
}

Result<void> write_whole_file(const std::string& path, std::string_view bytes) {
  auto file = FileWriter::create(path);
  if (!file) return std::unexpected(file.error());
  if (auto done = file->write(bytes); !done) return done;
  return file->finish();
}

Result<std::string> read_beginning(const std::string& path, std::size_t most) {
  const Descriptor file(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK));
  if (file.get() < 0) return failed("open", path, errno, code_of_open(errno));
  std::string bytes(most, '\0');
  const ReadBytes got = read_up_to(file.get(), 0, bytes.data(), bytes.size());
  if (got.error != 0) return failed("read", path, got.error);
  bytes.resize(got.size);
  return bytes;
}

std::string finished_name(const std::string& name) {
  const auto at = name.rfind(kPartial);
  if (at == name.npos) return {};
  const std::string_view digits = std::string_view(name).substr(at + kPartial.size());
  const bool all_of_hex = digits.find_first_not_of("0123456789abcdef") == digits.npos;
  return digits.size() == kPartialDigits && all_of_hex ? name.substr(0, at) : std::string();
}

Result<void> remove_partials_of(const std::string& path) {
  namespace fs = std::filesystem;
  const auto entries = entries_of(folder_of(path));
  if (!entries) return std::unexpected(entries.error());
  const std::string ours = beginning_of_partial(fs::path(path).filename().string());
  for (const fs::directory_entry& entry : *entries) {
    if (finished_name(entry.path().filename().string()) != ours) continue;
    std::error_code error;
    const auto type = entry.symlink_status(error).type();
    if (type == fs::file_type::regular) fs::remove(entry.path(), error);
    if (error) return failed("remove", entry.path().string(), error.value());
  }
  return {};
}

Result<void> can_write_file(const std::string& path) {
  if (open_descriptor(path) >= 0) return {};
  const std::string target = target_of(path);
  struct stat status {};
  if (::stat(target.c_str(), &status) == 0 && S_ISDIR(status.st_mode))
    return failed("write", path, EISDIR);
  if (is_special(target)) {
    if (::access(target.c_str(), W_OK) != 0) return failed("open", path, errno);
    return {};
  }
  if (::lstat(target.c_str(), &status) != 0 && errno == ENAMETOOLONG)
    return failed("create", path, errno);
  if (auto file = FileWriter::create(path); !file) return std::unexpected(file.error());
  return {};
}

}  // namespace tind
