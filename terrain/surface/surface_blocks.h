#pragma once
// What an update compares: the blocks of every layer of a surface.

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "terrain/base/result.h"
#include "terrain/raster/source_blocks.h"
#include "terrain/surface/surface.h"

namespace tind {

/// Of one DEM it is that one's SourceBlocks, bytes and digest.
class SurfaceBlocks {
 public:
  explicit SurfaceBlocks(const Surface&);

  std::span<SourceBlocks> layers() { return layers_; }
  std::span<const SourceBlocks> layers() const { return layers_; }

  /// 32 digits that stand for every post.
  std::string digest() const;
  std::string encode() const;
  /// Fails with bad_data unless it is what encode() made for these grids and has this digest.
  static Result<SurfaceBlocks> decode(std::string_view bytes, const Surface&,
                                      const std::string& digest);

 private:
  std::vector<SourceBlocks> layers_;
  std::string hashes() const;
};

}  // namespace tind
