// A file stays open, so that what is read is of one archive whatever becomes of its name; on
// another machine its version is asked for with every range.

#include "terrain/store/pmtiles/archive_bytes.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <utility>

#include "terrain/base/errno_text.h"
#include "terrain/base/whole_io.h"
#include "terrain/raster/remote/remote_file.h"

namespace tind::pmtiles {

namespace {

using proto::PmtilesSection;
using Bytes = std::vector<std::uint8_t>;

class LocalBytes : public ArchiveBytes {
 public:
  static Result<std::unique_ptr<const ArchiveBytes>> open(const std::string& path) {
    // A pipe in its place must not keep us waiting.
    const int file = ::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK);
    if (file < 0)
      return fail(errno == ENOENT ? Errc::not_found : Errc::io, path + ": " + errno_text(errno));
    std::unique_ptr<LocalBytes> made(new LocalBytes(path, file));
    struct stat status {};
    if (::fstat(file, &status) != 0) return fail(Errc::io, path + ": " + errno_text(errno));
    if (!S_ISREG(status.st_mode)) return fail(Errc::bad_data, path + " is not a file");
    made->size_ = std::uint64_t(status.st_size);
    return made;
  }
  ~LocalBytes() override { ::close(file_); }
  LocalBytes(const LocalBytes&) = delete;
  LocalBytes& operator=(const LocalBytes&) = delete;

  std::uint64_t size() const override { return size_; }
  Result<Bytes> read(const PmtilesSection& part) const override {
    Bytes bytes(part.size);
    const ReadBytes got = read_up_to(file_, part.at, bytes.data(), bytes.size());
    if (got.error != 0)
      return fail(Errc::io, "cannot read " + path_ + ": " + errno_text(got.error));
    if (got.size < bytes.size())
      return fail(Errc::io, path_ + " is shorter than when it was opened");
    return bytes;
  }

 private:
  LocalBytes(std::string path, int file) : path_(std::move(path)), file_(file) {}

  const std::string path_;
  const int file_;
  std::uint64_t size_ = 0;
};

class RemoteBytes : public ArchiveBytes {
 public:
  explicit RemoteBytes(std::shared_ptr<const remote::RemoteFile> file) : file_(std::move(file)) {}

  std::uint64_t size() const override { return file_->size(); }
  Result<Bytes> read(const PmtilesSection& part) const override {
    // What opening has read already is not fetched again.
    if (part.end() <= remote::RemoteFile::kBlock) return read_small(part);
    return file_->read(part.at, part.size);
  }
  Result<Bytes> read_small(const PmtilesSection& part) const override {
    if (part.size > remote::RemoteFile::kBlock) return read(part);
    Bytes bytes(part.size);
    if (auto got = file_->read_kept(part.at, bytes); !got) return std::unexpected(got.error());
    return bytes;
  }

 private:
  const std::shared_ptr<const remote::RemoteFile> file_;
};

}  // namespace

Result<std::unique_ptr<const ArchiveBytes>> open_archive_bytes(const std::string& location) {
  if (!remote::is_remote(location)) return LocalBytes::open(location);
  auto file = remote::RemoteFile::open(remote::Objects::of_environment(), location);
  if (!file) return std::unexpected(file.error());
  return std::make_unique<RemoteBytes>(std::move(*file));
}

}  // namespace tind::pmtiles
