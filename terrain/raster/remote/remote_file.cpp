#include "terrain/raster/remote/remote_file.h"

#include <algorithm>
#include <cstring>

namespace tind::remote {

namespace {
constexpr std::uint64_t kMostAtOnce = 64;  // blocks of one request
}

Result<std::shared_ptr<const RemoteFile>> RemoteFile::open(const Objects& objects,
                                                           const std::string& url,
                                                           std::size_t kept_bytes) {
  auto first = objects.get_first(url, kBlock);
  if (!first) return std::unexpected(first.error());
  if (first->state.etag.empty() && first->state.modified.empty())
    return fail(Errc::unsupported,
                url +
                    ": the server sends neither ETag nor Last-Modified, so that nobody can tell "
                    "whether it changes; copy it here");
  const std::size_t blocks = std::max<std::size_t>(2, kept_bytes / kBlock);
  std::shared_ptr<RemoteFile> file(new RemoteFile(objects, url, blocks));
  file->version_ = std::move(first->state);
  file->blocks_.insert(0,
                       std::make_shared<const std::vector<std::uint8_t>>(std::move(first->bytes)));
  return file;
}

Result<std::vector<std::uint8_t>> RemoteFile::read(std::uint64_t at, std::size_t size) const {
  if (size == 0) return std::vector<std::uint8_t>();
  if (at > version_.size || size > version_.size - at)
    return fail(Errc::bad_data, url_ + " has no so many bytes");
  return objects_.get_range(url_, version_, at, size);
}

RemoteFile::Block RemoteFile::kept(std::uint64_t number) const {
  const std::lock_guard lock(mutex_);
  const Block* const found = blocks_.find(number);
  return found ? *found : nullptr;
}

/// Blocks [first, end), none of which is kept, by one request.
Result<void> RemoteFile::fetch(std::uint64_t first, std::uint64_t end,
                               std::vector<Block>& to) const {
  const std::uint64_t at = first * kBlock, stop = std::min(end * kBlock, version_.size);
  const auto bytes = read(at, std::size_t(stop - at));
  if (!bytes) return std::unexpected(bytes.error());
  const std::lock_guard lock(mutex_);
  for (std::uint64_t k = first; k < end; ++k) {
    const auto begin = bytes->begin() + std::ptrdiff_t((k - first) * kBlock);
    const std::ptrdiff_t size = std::min<std::ptrdiff_t>(kBlock, bytes->end() - begin);
    to.push_back(std::make_shared<const std::vector<std::uint8_t>>(begin, begin + size));
    blocks_.insert(k, to.back());
  }
  return {};
}

Result<void> RemoteFile::read_kept(std::uint64_t at, std::span<std::uint8_t> to) const {
  if (to.empty()) return {};
  if (at > version_.size || to.size() > version_.size - at)
    return fail(Errc::bad_data, url_ + " has no so many bytes");
  const std::uint64_t first = at / kBlock, end = (at + to.size() - 1) / kBlock + 1;
  std::uint64_t done = first;
  while (done < end) {
    std::vector<Block> blocks;
    if (Block block = kept(done)) {
      blocks.push_back(std::move(block));
    } else {
      std::uint64_t missing = done + 1;
      while (missing < end && missing - done < kMostAtOnce && !kept(missing)) ++missing;
      if (auto got = fetch(done, missing, blocks); !got) return got;
    }
    for (const Block& block : blocks) {
      const std::uint64_t begin = done * kBlock;
      const std::uint64_t from = std::max(at, begin),
                          until = std::min(at + to.size(), begin + block->size());
      std::memcpy(to.data() + (from - at), block->data() + (from - begin), until - from);
      ++done;
    }
  }
  return {};
}

Result<void> RemoteFile::unchanged() const {
  const auto now = objects_.head(url_);
  if (!now) return std::unexpected(now.error());
  if (*now == version_) return {};
  return fail(Errc::io, url_ +
                            ": was replaced by another while it was in use; open it anew (a "
                            "daemon: reload) to read what is there now");
}

}  // namespace tind::remote
