// The plan is a function of what the layers say of themselves and of the range of their heights. So
// it is made again by the code that made it, of DEMs that only say.

#include "terrain/pyramid/plan/past_build.h"

#include <fmt/format.h>

#include <cmath>
#include <memory>
#include <utility>

#include "terrain/base/hash.h"

namespace tind {

namespace {

/// A DEM of which the record knows, and nobody the heights.
class PastSource : public DemSource {
 public:
  explicit PastSource(const LayerRecord& r, std::size_t number) : plain_(r.plain) {
    info_.files.assign(std::size_t(std::max<std::int64_t>(1, std::min<std::int64_t>(r.files, 2))),
                       fmt::format("layer {} as it was", number));
    info_.cols = r.cols, info_.rows = r.rows;
    info_.has_geotransform = true;
    info_.post_to_crs = r.post_to_crs;
    info_.crs_kind = CrsKind::geographic;  // there is one
    info_.bounds = r.bounds;
    info_.extents = r.extents;
    info_.wraps_longitude = r.wraps;
    info_.period_cols = r.period_cols;
    info_.spacing_x_m = r.spacing_x_m, info_.spacing_y_m = r.spacing_y_m;
    info_.rounding_m = r.rounding_m;
  }

  const DemInfo& info() const override { return info_; }
  Result<HeightGrid> read(std::int64_t, std::int64_t, int, int) const override {
    return fail(Errc::internal, info_.files[0] + " has no heights any more");
  }
  Result<HeightGrid> read_decimated(std::int64_t col, std::int64_t row, int cols, int rows,
                                    int) const override {
    return read(col, row, cols, rows);
  }
  void to_post(std::span<const Geographic>, std::span<Vec2> out) const override {
    std::ranges::fill(out, Vec2{NAN, NAN});
  }
  void to_geographic(std::span<const Vec2>, std::span<Geographic> out) const override {
    std::ranges::fill(out, Geographic{NAN, NAN});
  }
  bool is_plain_geographic() const override { return plain_; }

 private:
  DemInfo info_;
  bool plain_;
};

LayerRecord record_of(const SurfaceLayer& layer) {
  const DemInfo& info = layer.source->info();
  LayerRecord r;
  r.crs = hash128(fmt::format("{} {} {} {}", info.crs_wkt, info.crs_way,
                              info.crs_accuracy_m.value_or(-1), name(info.datum)))
              .text();
  r.post_to_crs = info.post_to_crs;
  r.cols = info.cols, r.rows = info.rows;
  r.files = std::int64_t(info.files.size());
  r.plain = layer.source->is_plain_geographic();
  r.wraps = info.wraps_longitude;
  r.period_cols = info.period_cols;
  r.spacing_x_m = info.spacing_x_m, r.spacing_y_m = info.spacing_y_m;
  r.rounding_m = info.rounding_m;
  r.blend_m = layer.blend_m;
  r.max_error_m = layer.max_error_m;
  r.bounds = info.bounds;
  r.extents = info.extents;
  return r;
}

/// As many blocks as `bytes` hold? So that a damaged record takes no memory.
bool has_room(const std::vector<LayerRecord>& layers, std::size_t bytes) {
  constexpr double kLargestBlock = 256 * 256, kHash = 8;
  double least = 0;
  for (const LayerRecord& r : layers)
    least += double(r.cols) / kLargestBlock * double(r.rows) * kHash;
  return least <= double(bytes);
}

}  // namespace

std::vector<LayerRecord> layer_records(const Surface& surface) {
  std::vector<LayerRecord> records;
  for (const SurfaceLayer& layer : surface.layers()) records.push_back(record_of(layer));
  return records;
}

Result<PastBuild> past_build(const BuildRecord& record, std::string_view blocks,
                             const TileSetOptions& options) {
  if (record.layers.empty() || !has_room(record.layers, blocks.size()))
    return fail(Errc::bad_data, "the record does not know its layers");
  std::vector<SurfaceLayer> layers;
  layers.reserve(record.layers.size());
  for (const LayerRecord& r : record.layers)
    layers.push_back({.name = std::to_string(layers.size()),
                      .source = std::make_shared<const PastSource>(r, layers.size()),
                      .blend_m = std::max(0.0, r.blend_m),
                      .max_error_m = r.max_error_m});
  auto surface = Surface::of_layers(std::move(layers));
  if (!surface) return std::unexpected(surface.error());
  HeightRange range{record.range_m.first, record.range_m.second, 1};
  range.of_levels = record.level_ranges_m;
  TileSetOptions all = options;
  all.first_level = 0, all.last_level = -1;
  auto plan = TilePlan::make(*surface, range, all);
  if (!plan) return std::unexpected(plan.error());
  auto hashes = SurfaceBlocks::decode(blocks, *surface, record.heights);
  if (!hashes) return std::unexpected(hashes.error());
  return PastBuild{record.layers, std::move(*surface), std::move(*plan), std::move(*hashes)};
}

}  // namespace tind
