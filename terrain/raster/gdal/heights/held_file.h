#pragma once
// Posts in memory, read as those of a file are.

#include <memory>
#include <span>
#include <string>

#include "terrain/base/result.h"
#include "terrain/raster/gdal/heights/height_file.h"
#include "terrain/raster/held_posts.h"

namespace tind::gdal {

class HeldFile final : public HeightFile {
 public:
  static Result<std::unique_ptr<HeightFile>> make(HeldPosts, const DemOptions&);

  const FileFacts& facts() const override { return facts_; }
  const FileStates& states() const override { return states_; }
  Result<void> read(int col, int row, int cols, int rows, std::span<double> out) const override;
  Result<void> read_posts(std::span<const Post>) const override;
  std::uint64_t customary(std::size_t) const override { return 0; }
  /// Of the heights and their place: there is no file to be looked at.
  Result<std::string> fingerprint() const override;

 private:
  explicit HeldFile(HeightGrid heights) : heights_(std::move(heights)) {}
  Result<void> learn_crs(const std::string& said, const VerticalDatum&, const DemOptions&);

  HeightGrid heights_;
  FileFacts facts_;
  FileStates states_;  // none
};

}  // namespace tind::gdal
