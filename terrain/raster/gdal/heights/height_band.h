#pragma once
// The heights in a raster: which band, or which colours, they are in, and what their numbers mean.

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "terrain/base/result.h"
#include "terrain/raster/dem_source.h"
#include "terrain/raster/gdal/heights/gdal_verify.h"
#include "terrain/raster/raster_content.h"

class GDALDataset;

namespace tind::gdal {

/// Bounds of what is opened at all.
struct RasterLimits {
  std::int64_t max_side = std::int64_t(1) << 30;  // posts
  std::int64_t max_block_bytes = 64 << 20;        // one block, decoded
  std::int64_t max_whole_bytes = 512 << 20;       // formats that are decoded as a whole
};
inline constexpr RasterLimits kRasterLimits;

/// Made for one dataset and used with others of the same file. Thread-safe once made.
class HeightBand {
 public:
  /// Judges the dataset before a block of it is decoded: what would be costly or meaningless is an
  /// error. `path` begins every message; `vertical_unit_m` counts where the band names no unit (0:
  /// neither does its CRS). `whole`: the bytes were checked when they were unpacked.
  static Result<HeightBand> of(const std::string& path, GDALDataset&, double vertical_unit_m,
                               bool whole, const DemOptions&);

  double z_unit_m() const { return z_unit_m_; }
  const RasterContent& content() const { return content_; }
  /// What read() gives is a float as it is (32-bit integers: up to 2^24).
  bool exact() const { return exact_; }

  /// The numbers of a window, decoded, in the file's unit before scale and offset; NaN where the
  /// file's mask or its colours say that there is nothing. `file`: what lies behind the dataset.
  Result<void> read_raw(GDALDataset&, const std::string& file, int col, int row, int cols, int rows,
                        std::span<double> out) const;
  bool is_void(double raw) const;
  /// Metres, or the file's own unit where that was asked for; NaN for a void.
  double height(double raw) const;

 private:
  HeightBand() = default;
  Result<void> choose(const std::string& path, GDALDataset&, const DemOptions&);
  Result<void> interpret(const std::string& path, GDALDataset&, double vertical_unit_m,
                         const DemOptions&);
  Result<void> read_colours(GDALDataset&, int col, int row, int cols, int rows,
                            std::span<double> out) const;

  int band_ = 1;  // the first of three where heights are colours
  HeightEncoding encoding_ = HeightEncoding::number;
  std::vector<std::uint32_t> palette_;  // 0xAARRGGBB; empty: colours are in three bands
  double scale_ = 1, offset_ = 0, z_unit_m_ = 1;
  int alpha_ = 0;  // a band of transparency that GDAL makes no mask of; 0: none
  bool is_float_ = false, masked_ = false, exact_ = true;
  std::vector<double> nodata_;
  RasterContent content_;
  std::unique_ptr<BlockSums> sums_, mask_sums_;
};

}  // namespace tind::gdal
