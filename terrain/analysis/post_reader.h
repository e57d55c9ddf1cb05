#pragma once
// Single posts of a DEM, asked for in an order that stays close together: along a line, say.

#include <cstdint>
#include <limits>
#include <map>
#include <optional>
#include <utility>

#include "terrain/base/result.h"
#include "terrain/raster/dem_source.h"

namespace tind {

/// Reads squares of posts and keeps the last of them: a line reads each once. For one thread. The
/// source is to outlive it.
class PostReader {
 public:
  explicit PostReader(const DemSource& source) : source_(source) {}

  /// NaN for a void, beyond the DEM, and after an error.
  double operator()(std::int64_t col, std::int64_t row) {
    const std::pair<std::int64_t, std::int64_t> key(floor_div(row), floor_div(col));
    if (!last_ || key != last_key_) {
      last_ = square(key);
      last_key_ = key;
    }
    if (!last_) return std::numeric_limits<double>::quiet_NaN();
    return last_->at(int(col - key.second * kSide), int(row - key.first * kSide));
  }
  /// To be asked at the end: a read error is never a void.
  const std::optional<Error>& error() const { return error_; }

 private:
  static constexpr std::int64_t kSide = 128;
  static constexpr std::size_t kMost = 64;

  static std::int64_t floor_div(std::int64_t i) { return (i >= 0 ? i : i - kSide + 1) / kSide; }
  const HeightGrid* square(const std::pair<std::int64_t, std::int64_t>& key) {
    if (const auto found = squares_.find(key); found != squares_.end()) return &found->second;
    if (error_) return nullptr;
    auto posts = source_.read(key.second * kSide, key.first * kSide, int(kSide), int(kSide));
    if (!posts) {
      error_ = posts.error();
      return nullptr;
    }
    if (squares_.size() >= kMost) squares_.clear();
    return &(squares_[key] = std::move(*posts));
  }

  const DemSource& source_;
  std::map<std::pair<std::int64_t, std::int64_t>, HeightGrid> squares_;
  std::pair<std::int64_t, std::int64_t> last_key_{};
  const HeightGrid* last_ = nullptr;
  std::optional<Error> error_;
};

}  // namespace tind
