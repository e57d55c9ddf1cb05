#pragma once
// Another source, and how much is asked of it.

#include <atomic>
#include <memory>
#include <utility>

#include "terrain/base/result.h"
#include "terrain/raster/dem_source.h"
#include "terrain/raster/height_grid.h"

namespace tind::test {

class CountedSource : public DemSource {
 public:
  explicit CountedSource(std::shared_ptr<const DemSource> source) : source_(std::move(source)) {}

  const DemInfo& info() const override { return source_->info(); }
  Result<HeightGrid> read(std::int64_t col, std::int64_t row, int cols, int rows) const override {
    posts_read += std::int64_t(cols) * rows;
    return source_->read(col, row, cols, rows);
  }
  Result<HeightGrid> read_decimated(std::int64_t col, std::int64_t row, int cols, int rows,
                                    int step) const override {
    posts_read += std::int64_t(cols) * rows;
    return source_->read_decimated(col, row, cols, rows, step);
  }
  void to_post(std::span<const Geographic> in, std::span<Vec2> out) const override {
    source_->to_post(in, out);
  }
  void to_geographic(std::span<const Vec2> in, std::span<Geographic> out) const override {
    places_asked += std::int64_t(in.size());
    source_->to_geographic(in, out);
  }
  bool is_plain_geographic() const override { return source_->is_plain_geographic(); }

  mutable std::atomic<std::int64_t> posts_read = 0, places_asked = 0;

 private:
  std::shared_ptr<const DemSource> source_;
};

}  // namespace tind::test
