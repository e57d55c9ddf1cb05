#include "terrain/shapes/shaped_dem.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "terrain/base/hash.h"
#include "terrain/shapes/post_areas.h"
#include "terrain/shapes/surface_shapes.h"

namespace tind {

namespace {

/// Rectangles that cover what an area has of one: quarters of quarters, six times at most.
void cover(const AreaSet& areas, const GeoRect& r, int depth, std::vector<GeoRect>& out) {
  const double lon = (r.west + r.east) / 2, lat = (r.south + r.north) / 2;
  const bool mixed = areas.crosses(r);
  if (!mixed && areas.holding(lon, lat) == AreaSet::kNone) return;
  if (!mixed || depth == 0) {
    out.push_back(r);
    return;
  }
  cover(areas, {r.west, r.south, lon, lat}, depth - 1, out);
  cover(areas, {lon, r.south, r.east, lat}, depth - 1, out);
  cover(areas, {r.west, lat, lon, r.north}, depth - 1, out);
  cover(areas, {lon, lat, r.east, r.north}, depth - 1, out);
}

class ShapedDem : public DemSource {
 public:
  ShapedDem(std::shared_ptr<const DemSource> source, std::shared_ptr<const SurfaceShapes> shapes)
      : source_(std::move(source)), shapes_(std::move(shapes)), info_(source_->info()) {
    const AreaSet& level = shapes_->level_areas();
    for (std::uint32_t p = 0; p < level.polygons(); ++p)
      for (const PostRect& r : post_rects(*source_, level.bounds(p))) level_rects_.push_back(r);
    info_.fingerprint =
        hash128(info_.fingerprint + " " + shapes_->digest() + " " + shapes_->level_digest()).text();
    if (!shapes_->boundary().empty()) cut_extents();
  }

  const DemInfo& info() const override { return info_; }

  Result<HeightGrid> read(std::int64_t col, std::int64_t row, int cols, int rows) const override {
    return shaped(source_->read(col, row, cols, rows), col, row, 1);
  }
  Result<HeightGrid> read_decimated(std::int64_t col, std::int64_t row, int cols, int rows,
                                    int step) const override {
    return shaped(source_->read_decimated(col, row, cols, rows, step), col, row, step);
  }
  void to_post(std::span<const Geographic> in, std::span<Vec2> out) const override {
    source_->to_post(in, out);
  }
  void to_geographic(std::span<const Vec2> in, std::span<Geographic> out) const override {
    source_->to_geographic(in, out);
  }
  std::vector<UndeclaredNodata> undeclared_nodata() const override {
    return source_->undeclared_nodata();
  }
  bool is_plain_geographic() const override { return source_->is_plain_geographic(); }
  Result<void> unchanged() const override {
    if (auto same = source_->unchanged(); !same) return same;
    return shapes_->unchanged();
  }
  const SurfaceShapes& shapes() const { return *shapes_; }

 private:
  std::shared_ptr<const DemSource> source_;
  std::shared_ptr<const SurfaceShapes> shapes_;
  DemInfo info_;
  std::vector<PostRect> level_rects_;  // posts elsewhere are in no level polygon

  void cut_extents() {
    std::vector<GeoRect> given = info_.extents, cut;
    if (given.empty()) given.push_back(info_.bounds);
    for (const GeoRect& r : given) cover(shapes_->boundary(), r, 6, cut);
    info_.extents = cut;
    if (cut.empty()) return;
    GeoRect& all = info_.bounds = cut.front();
    for (const GeoRect& r : cut)
      all = {std::min(all.west, r.west), std::min(all.south, r.south), std::max(all.east, r.east),
             std::max(all.north, r.north)};
  }

  Result<HeightGrid> shaped(Result<HeightGrid> posts, std::int64_t col, std::int64_t row,
                            int step) const {
    if (!posts || posts->size() == 0) return posts;
    const std::int64_t last_col = col + std::int64_t(posts->cols() - 1) * step;
    const std::int64_t last_row = row + std::int64_t(posts->rows() - 1) * step;
    const bool level = std::ranges::any_of(level_rects_, [&](const PostRect& r) {
      return r.col <= last_col && r.last_col >= col && r.row <= last_row && r.last_row >= row;
    });
    const bool cut = !shapes_->boundary().empty();
    if (!level && !cut) return posts;
    AreaRow levels(shapes_->level_areas(), *source_), inside(shapes_->boundary(), *source_);
    each_post_place(*source_, col, row, posts->cols(), posts->rows(), step,
                    [&](std::size_t k, double lon, double lat) {
                      float& z = posts->values()[k];
                      if (std::isnan(z)) return;
                      if (cut && inside.holding(lon, lat) == AreaSet::kNone) {
                        z = HeightGrid::kVoid;
                        return;
                      }
                      const std::uint32_t in = level ? levels.holding(lon, lat) : AreaSet::kNone;
                      if (in != AreaSet::kNone) z = float(shapes_->level_of(in));
                    });
    return posts;
  }
};

}  // namespace

std::shared_ptr<const DemSource> shaped_dem(std::shared_ptr<const DemSource> source,
                                            std::shared_ptr<const SurfaceShapes> shapes) {
  return std::make_shared<const ShapedDem>(std::move(source), std::move(shapes));
}

Result<std::shared_ptr<const DemSource>> shaped_dem(std::shared_ptr<const DemSource> source,
                                                    const ShapeFiles& files) {
  if (!files.any()) return source;
  auto shapes = SurfaceShapes::make(std::span(&source, 1), files);
  if (!shapes) return std::unexpected(shapes.error());
  return shaped_dem(std::move(source), std::move(*shapes));
}

const SurfaceShapes* shapes_of(const DemSource& source) {
  const auto* shaped = dynamic_cast<const ShapedDem*>(&source);
  return shaped ? &shaped->shapes() : nullptr;
}

}  // namespace tind
