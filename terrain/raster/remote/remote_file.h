#pragma once
// One file on another machine, read by ranges: always of the version that was opened.

#include <condition_variable>
#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <span>
#include <string>
#include <vector>

#include "terrain/base/lru.h"
#include "terrain/base/result.h"
#include "terrain/raster/remote/objects.h"

namespace tind::remote {

/// Thread-safe. A version that another took the place of gives busy; failures are not remembered.
class RemoteFile {
 public:
  /// Reads the first bytes. Fails as Objects::get_first(), and (unsupported) where the server says
  /// nothing by which a version is known: neither ETag nor Last-Modified. `kept_bytes`: of blocks
  /// that are kept.
  static Result<std::shared_ptr<const RemoteFile>> open(const Objects&, const std::string& url,
                                                        std::size_t kept_bytes = 16u << 20u);

  const std::string& url() const { return url_; }
  std::uint64_t size() const { return version_.size; }
  const ObjectState& version() const { return version_; }

  /// Exactly these bytes, in one request. REQUIRES: they lie in the file.
  Result<std::vector<std::uint8_t>> read(std::uint64_t at, std::size_t size) const;
  /// By way of blocks that are kept: for what is read in small pieces, or twice. Of those who want
  /// a block at once one asks for it, and all have its answer.
  Result<void> read_kept(std::uint64_t at, std::span<std::uint8_t> to) const;

  /// Is it still the version that was opened? Asks the server. io, busy, not_found.
  Result<void> unchanged() const;

  static constexpr std::size_t kBlock = 64u << 10u;

 private:
  using Block = std::shared_ptr<const std::vector<std::uint8_t>>;
  struct Flight;  // a block on its way
  struct Run;     // blocks that somebody else has, fetches, or that are the caller's to fetch

  RemoteFile(const Objects& objects, std::string url, std::size_t kept_blocks)
      : objects_(objects), url_(std::move(url)), blocks_(kept_blocks) {}
  Run take(std::uint64_t first, std::uint64_t end) const;
  Result<std::vector<Block>> fetch(std::uint64_t first, std::uint64_t end) const;
  Result<std::vector<Block>> blocks_from(std::uint64_t first, std::uint64_t end) const;

  const Objects objects_;
  const std::string url_;
  ObjectState version_;
  mutable std::mutex mutex_;
  mutable std::condition_variable landed_;
  mutable Lru<std::uint64_t, Block> blocks_;
  mutable std::map<std::uint64_t, std::shared_ptr<Flight>> flights_;  // by block
};

}  // namespace tind::remote
