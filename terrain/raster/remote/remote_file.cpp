#include "terrain/raster/remote/remote_file.h"

#include <algorithm>
#include <cstring>
#include <optional>

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

struct RemoteFile::Flight {
  std::optional<Result<Block>> landed;
};

struct RemoteFile::Run {
  Block kept;                                     // the first, or
  std::shared_ptr<Flight> another;                // who fetches it, or
  std::vector<std::shared_ptr<Flight>> to_fetch;  // it, and those behind it that nobody has
};

RemoteFile::Run RemoteFile::take(std::uint64_t first, std::uint64_t end) const {
  Run run;
  const std::lock_guard lock(mutex_);
  for (std::uint64_t k = first; k < end && k - first < kMostAtOnce; ++k) {
    const Block* const found = blocks_.find(k);
    const auto flight = flights_.find(k);
    if (!found && flight == flights_.end()) {
      run.to_fetch.push_back(std::make_shared<Flight>());
      flights_.emplace(k, run.to_fetch.back());
      continue;
    }
    if (k > first) break;
    if (found)
      run.kept = *found;
    else
      run.another = flight->second;
    break;
  }
  return run;
}

/// Blocks [first, end) by one request.
Result<std::vector<RemoteFile::Block>> RemoteFile::fetch(std::uint64_t first,
                                                         std::uint64_t end) const {
  const std::uint64_t at = first * kBlock, stop = std::min(end * kBlock, version_.size);
  const auto bytes = read(at, std::size_t(stop - at));
  if (!bytes) return std::unexpected(bytes.error());
  std::vector<Block> blocks;
  for (std::uint64_t k = first; k < end; ++k) {
    const auto begin = bytes->begin() + std::ptrdiff_t((k - first) * kBlock);
    const std::ptrdiff_t size = std::min<std::ptrdiff_t>(kBlock, bytes->end() - begin);
    blocks.push_back(std::make_shared<const std::vector<std::uint8_t>>(begin, begin + size));
  }
  return blocks;
}

/// The first of these blocks, and as many behind it as come with it.
Result<std::vector<RemoteFile::Block>> RemoteFile::blocks_from(std::uint64_t first,
                                                               std::uint64_t end) const {
  const Run run = take(first, end);
  if (run.kept) return std::vector{run.kept};
  if (run.another) {
    std::unique_lock lock(mutex_);
    landed_.wait(lock, [&] { return run.another->landed.has_value(); });
    const Result<Block>& block = *run.another->landed;
    if (!block) return std::unexpected(block.error());
    return std::vector{*block};
  }
  Result<std::vector<Block>> blocks = fail(Errc::internal, url_ + " was not read");
  // Whatever becomes of it, those who wait are told.
  const auto land = [&] {
    const std::lock_guard lock(mutex_);
    for (std::size_t k = 0; k < run.to_fetch.size(); ++k) {
      if (blocks) {
        blocks_.insert(first + k, (*blocks)[k]);
        run.to_fetch[k]->landed.emplace((*blocks)[k]);
      } else {
        run.to_fetch[k]->landed.emplace(std::unexpected(blocks.error()));
      }
      flights_.erase(first + k);
    }
    landed_.notify_all();
  };
  try {
    blocks = fetch(first, first + run.to_fetch.size());
  } catch (...) {  // no memory
    land();
    throw;
  }
  land();
  return blocks;
}

Result<void> RemoteFile::read_kept(std::uint64_t at, std::span<std::uint8_t> to) const {
  if (to.empty()) return {};
  if (at > version_.size || to.size() > version_.size - at)
    return fail(Errc::bad_data, url_ + " has no so many bytes");
  const std::uint64_t first = at / kBlock, end = (at + to.size() - 1) / kBlock + 1;
  std::uint64_t done = first;
  while (done < end) {
    const auto blocks = blocks_from(done, end);
    if (!blocks) return std::unexpected(blocks.error());
    for (const Block& block : *blocks) {
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
