#pragma once
// The tiles of a shard that are made so far, in their order: what a run that was stopped, killed or
// cut off leaves for the next one.

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "terrain/base/result.h"
#include "terrain/geo/tiling_scheme.h"
#include "terrain/store/tile_store.h"

namespace tind {

class ShardSpool {
 public:
  /// Takes the file, or where somebody else has it, one without a name that goes with the process.
  /// What is in it of these tiles and this seed, from the first on, is kept; the rest is cut off.
  static Result<ShardSpool> open(const std::string& path, std::uint64_t seed,
                                 std::span<const TileId> ids);
  ShardSpool(ShardSpool&& other) noexcept;
  ShardSpool& operator=(ShardSpool&&) = delete;
  ~ShardSpool();  // what was appended stays

  std::size_t size() const { return places_.size(); }
  const TileFacts& facts(std::size_t k) const { return places_[k].facts; }
  /// REQUIRES: ids[size()] is the tile.
  Result<void> append(const std::vector<std::uint8_t>& packed, TileFacts facts);
  /// The bytes of tile k, with no look at their hash.
  Result<std::vector<std::uint8_t>> read(std::size_t k) const;
  Result<void> sync();
  /// The file has served its purpose.
  void remove();

 private:
  struct Place {
    std::uint64_t at = 0;
    TileFacts facts;
  };
  ShardSpool(int file, std::string path, std::uint64_t seed, std::span<const TileId> ids)
      : file_(file), path_(std::move(path)), seed_(seed), ids_(ids) {}
  Result<void> look();

  int file_;
  std::string path_;  // empty: it has no name
  std::uint64_t seed_;
  std::span<const TileId> ids_;
  std::vector<Place> places_;
  std::uint64_t end_ = 0;
};

}  // namespace tind
