// XXH3 of the heights as they lie in memory; a void counts as one value, whatever its bits.

#include "terrain/raster/source_blocks.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

#include "terrain/base/hash.h"

namespace tind {

namespace {

constexpr std::int64_t kMostBlocks = 1 << 18;  // 2 MB
constexpr int kLargestSide = 256;              // those of scan_heights are whole ones
constexpr std::string_view kMagic{"TNSB\1\0\0\0", 8};

/// Of a block of so many posts.
std::uint64_t hash_of_voids(std::size_t posts) {
  const std::vector<float> voids(posts, std::numeric_limits<float>::quiet_NaN());
  return hash64({voids.data(), voids.size() * sizeof(float)}) | 1;
}

}  // namespace

SourceBlocks::SourceBlocks(const DemInfo& info) : cols_(info.cols), rows_(info.rows) {
  const auto count = [](std::int64_t posts, int side) { return (posts + side - 1) / side; };
  while (side_ < kLargestSide && count(info.cols, side_) * count(info.rows, side_) > kMostBlocks)
    side_ *= 2;
  across_ = count(info.cols, side_);
  down_ = count(info.rows, side_);
  hashes_.resize(std::size_t(across_ * down_));
}

void SourceBlocks::add(std::int64_t col, std::int64_t row, const HeightGrid& grid) {
  std::vector<float> posts;
  for (int r = 0; r < grid.rows(); r += side_)
    for (int c = 0; c < grid.cols(); c += side_) {
      posts.clear();
      bool voids = false;
      for (int j = r; j < std::min(r + side_, grid.rows()); ++j)
        for (int i = c; i < std::min(c + side_, grid.cols()); ++i) {
          const float z = grid.at(i, j);
          voids = voids || std::isnan(z);
          posts.push_back(std::isnan(z) ? std::numeric_limits<float>::quiet_NaN() : z);
        }
      const std::uint64_t hash = hash64({posts.data(), posts.size() * sizeof(float)});
      hashes_[std::size_t((row + r) / side_ * across_ + (col + c) / side_)] =
          (hash & ~std::uint64_t(1)) | std::uint64_t(voids);
    }
}

void SourceBlocks::add_void(std::int64_t col, std::int64_t row, int cols, int rows) {
  const auto side = std::size_t(side_);
  const std::uint64_t whole = hash_of_voids(side * side);
  for (int r = 0; r < rows; r += side_)
    for (int c = 0; c < cols; c += side_) {
      const std::size_t posts =
          std::size_t(std::min(side_, rows - r)) * std::size_t(std::min(side_, cols - c));
      hashes_[std::size_t((row + r) / side_ * across_ + (col + c) / side_)] =
          posts == side * side ? whole : hash_of_voids(posts);
    }
}

bool SourceBlocks::all_void(std::int64_t i, std::int64_t j) const {
  if (i >= across_ || j >= down_) return true;
  const std::int64_t cols = std::min<std::int64_t>(side_, cols_ - i * side_),
                     rows = std::min<std::int64_t>(side_, rows_ - j * side_);
  return has_void(i, j) && hash(i, j) == hash_of_voids(std::size_t(cols * rows));
}

bool SourceBlocks::differs(std::int64_t i, std::int64_t j, const SourceBlocks& other) const {
  const bool both = i < across_ && j < down_ && i < other.across_ && j < other.down_;
  if (both && hash(i, j) == other.hash(i, j)) return false;  // of other posts: voids all of them
  return !all_void(i, j) || !other.all_void(i, j);
}

std::string SourceBlocks::digest() const {
  return hash128({hashes_.data(), hashes_.size() * sizeof hashes_[0]}).text();
}

std::string SourceBlocks::encode() const {
  std::string out(kMagic);
  out.append(reinterpret_cast<const char*>(hashes_.data()), hashes_.size() * sizeof hashes_[0]);
  return out;
}

bool SourceBlocks::whole(std::string_view bytes, const std::string& digest) {
  if (!bytes.starts_with(kMagic) && !bytes.starts_with(kLayersMagic)) return false;
  bytes.remove_prefix(kMagic.size());
  return hash128(bytes).text() == digest;
}

Result<SourceBlocks> SourceBlocks::decode(std::string_view bytes, const DemInfo& info,
                                          const std::string& digest) {
  SourceBlocks blocks(info);
  const std::size_t size = blocks.hashes_.size() * sizeof blocks.hashes_[0];
  if (!bytes.starts_with(kMagic) || bytes.size() != kMagic.size() + size)
    return fail(Errc::bad_data, "not the blocks of this grid");
  std::memcpy(blocks.hashes_.data(), bytes.data() + kMagic.size(), size);
  if (blocks.digest() != digest) return fail(Errc::bad_data, "damaged");
  return blocks;
}

}  // namespace tind
