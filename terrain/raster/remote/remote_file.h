#pragma once
// One file on another machine, read by ranges: always of the version that was opened.

#include <cstdint>
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
  /// By way of blocks that are kept: for what is read in small pieces, or twice.
  Result<void> read_kept(std::uint64_t at, std::span<std::uint8_t> to) const;

  /// Is it still the version that was opened? Asks the server. io, busy, not_found.
  Result<void> unchanged() const;

  static constexpr std::size_t kBlock = 64u << 10u;

 private:
  using Block = std::shared_ptr<const std::vector<std::uint8_t>>;

  RemoteFile(const Objects& objects, std::string url, std::size_t kept_blocks)
      : objects_(objects), url_(std::move(url)), blocks_(kept_blocks) {}
  Block kept(std::uint64_t number) const;
  Result<void> fetch(std::uint64_t first, std::uint64_t end, std::vector<Block>& to) const;

  const Objects objects_;
  const std::string url_;
  ObjectState version_;
  mutable std::mutex mutex_;
  mutable Lru<std::uint64_t, Block> blocks_;
};

}  // namespace tind::remote
