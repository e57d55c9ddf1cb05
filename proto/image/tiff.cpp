#include "proto/image/tiff.h"

#include <cstdint>
#include <optional>
#include <vector>

#include "terrain/base/bytes.h"

namespace tind::proto {
namespace {

enum Tag : std::uint16_t {
  kStripOffsets = 273,
  kStripBytes = 279,
  kTileOffsets = 324,
  kTileBytes = 325
};
enum Type : std::uint16_t { kShort = 3, kLong = 4 };

/// Of one value, by its type.
constexpr std::uint64_t kSizes[] = {0, 1, 1, 2, 4, 8, 1, 1, 2, 4, 8, 4, 8};
constexpr std::uint64_t kEntry = 12, kInEntry = 4;  // bytes; of values that stand in it

using Numbers = std::vector<std::uint32_t>;

class Directory {
 public:
  explicit Directory(std::string_view bytes) : bytes_(bytes) {}

  bool is_whole() {
    if (!has(0, 8) || !bytes_.starts_with(std::string_view("II*\0", 4))) return false;
    const std::uint64_t at = load<std::uint32_t>(&bytes_[4]);
    if (!has(at, 2)) return false;
    const std::uint64_t entries = load<std::uint16_t>(&bytes_[at]);
    if (!has(at + 2, entries * kEntry + 4)) return false;
    for (std::uint64_t i = 0; i < entries; ++i)
      if (!take(at + 2 + i * kEntry)) return false;
    return offsets_ && sizes_ && are_there(*offsets_, *sizes_);
  }

 private:
  const std::string_view bytes_;
  std::optional<Numbers> offsets_, sizes_;  // of strips or tiles

  bool has(std::uint64_t at, std::uint64_t size) const {
    return at <= bytes_.size() && size <= bytes_.size() - at;
  }

  bool take(std::uint64_t entry) {
    const auto tag = load<std::uint16_t>(&bytes_[entry]);
    const auto type = load<std::uint16_t>(&bytes_[entry + 2]);
    const std::uint64_t count = load<std::uint32_t>(&bytes_[entry + 4]);
    if (type >= std::size(kSizes)) return false;
    const std::uint64_t size = count * kSizes[type];
    const std::uint64_t at = size <= kInEntry ? entry + 8 : load<std::uint32_t>(&bytes_[entry + 8]);
    if (!has(at, size)) return false;
    if (tag == kStripOffsets || tag == kTileOffsets) offsets_ = numbers(at, type, count);
    if (tag == kStripBytes || tag == kTileBytes) sizes_ = numbers(at, type, count);
    return true;
  }

  std::optional<Numbers> numbers(std::uint64_t at, std::uint16_t type, std::uint64_t count) const {
    if (type != kShort && type != kLong) return {};
    Numbers all;
    all.reserve(count);
    for (std::uint64_t i = 0; i < count; ++i)
      all.push_back(type == kLong ? load<std::uint32_t>(&bytes_[at + 4 * i])
                                  : load<std::uint16_t>(&bytes_[at + 2 * i]));
    return all;
  }

  bool are_there(const Numbers& offsets, const Numbers& sizes) const {
    if (offsets.empty() || offsets.size() != sizes.size()) return false;
    for (std::size_t i = 0; i < offsets.size(); ++i)
      if (!has(offsets[i], sizes[i])) return false;
    return true;
  }
};

}  // namespace

bool is_whole_tiff(std::string_view bytes) { return Directory(bytes).is_whole(); }

}  // namespace tind::proto
