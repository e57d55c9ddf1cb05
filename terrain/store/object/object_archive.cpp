#include "terrain/store/object/object_archive.h"

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <utility>

#include "terrain/base/errno_text.h"
#include "terrain/base/temporary_folder.h"

namespace tind {

namespace {

/// A whole file as bytes, which the system reads when they are looked at. The file is ours alone.
class MappedFile {
 public:
  static Result<MappedFile> open(const std::string& path) {
    const int file = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
    struct stat status {};
    if (file < 0 || ::fstat(file, &status) != 0) {
      const int why = errno;
      if (file >= 0) ::close(file);
      return fail(Errc::io, path + ": " + errno_text(why));
    }
    const auto size = std::size_t(status.st_size);
    void* const at = size > 0 ? ::mmap(nullptr, size, PROT_READ, MAP_PRIVATE, file, 0) : nullptr;
    const int why = errno;
    ::close(file);
    if (at == MAP_FAILED) return fail(Errc::io, path + ": " + errno_text(why));
    return MappedFile(at, size);
  }
  MappedFile(MappedFile&& other) noexcept
      : at_(std::exchange(other.at_, nullptr)), size_(other.size_) {}
  MappedFile& operator=(MappedFile&&) = delete;
  ~MappedFile() {
    if (at_) ::munmap(at_, size_);
  }
  std::string_view bytes() const { return {static_cast<const char*>(at_), at_ ? size_ : 0}; }

 private:
  MappedFile(void* at, std::size_t size) : at_(at), size_(size) {}
  void* at_;
  std::size_t size_;
};

class ObjectArchive : public ArchiveWriter {
 public:
  ObjectArchive(std::string url, const remote::Objects& objects, TemporaryFolder folder,
                std::string file, std::unique_ptr<ArchiveWriter> writer)
      : url_(std::move(url)),
        objects_(objects),
        folder_(std::move(folder)),
        file_(std::move(file)),
        writer_(std::move(writer)) {}

  void put_in_order(std::vector<TileId>& ids) const override { writer_->put_in_order(ids); }
  Result<void> add(TileId id, const std::vector<std::uint8_t>& packed, TileFacts facts) override {
    return writer_->add(id, packed, facts);
  }
  Result<void> finish() override {
    if (auto done = writer_->finish(); !done) return done;
    const auto whole = MappedFile::open(file_);
    if (!whole) return std::unexpected(whole.error());
    const auto put = objects_.put(url_, whole->bytes(), "application/vnd.pmtiles");
    if (!put) return std::unexpected(put.error());
    return {};
  }

 private:
  const std::string url_;
  const remote::Objects objects_;
  const TemporaryFolder folder_;  // outlives the writer
  const std::string file_;
  const std::unique_ptr<ArchiveWriter> writer_;
};

}  // namespace

Result<std::unique_ptr<ArchiveWriter>> write_object_archive(const std::string& url,
                                                            const std::string& name,
                                                            const remote::Objects& objects,
                                                            const WriteArchive& write) {
  auto folder = TemporaryFolder::make("archive");
  if (!folder) return std::unexpected(folder.error());
  std::string file = folder->path() + "/" + name;
  auto writer = write(file);
  if (!writer) return std::unexpected(writer.error());
  return std::make_unique<ObjectArchive>(url, objects, std::move(*folder), std::move(file),
                                         std::move(*writer));
}

}  // namespace tind
