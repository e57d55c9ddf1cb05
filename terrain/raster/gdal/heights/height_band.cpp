// The header is judged first, since one hostile block can ask for gigabytes. Heights as colours
// (terrain-RGB): mapbox counts tenths of a metre from -10000, terrarium 256ths from -32768; both
// leave black where there is no tile, which no place on earth has as its height.

#include "terrain/raster/gdal/heights/height_band.h"

#include <cpl_vsi.h>
#include <fmt/format.h>
#include <gdal_priv.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>

#include "terrain/base/lower_case.h"

namespace tind::gdal {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr double kFoot = 0.3048, kUsFoot = 1200.0 / 3937.0;

/// Metres per unit as the band's unit type names it; 0 where it names none, NaN where unknown.
double unit_in_metres(std::string_view said) {
  const std::string unit = lower_case(said);
  if (unit.empty()) return 0;
  for (const char* name : {"m", "metre", "metres", "meter", "meters"})
    if (unit == name) return 1;
  for (const char* name : {"ft", "foot", "feet", "international foot", "international feet"})
    if (unit == name) return kFoot;
  for (const char* name : {"us survey foot", "us survey feet", "ftus", "us-ft", "us_survey_foot",
                           "foot_us", "us_ft", "sft"})
    if (unit == name) return kUsFoot;
  if (unit == "cm" || unit == "centimetre" || unit == "centimeter") return 0.01;
  if (unit == "dm" || unit == "decimetre" || unit == "decimeter") return 0.1;
  if (unit == "mm" || unit == "millimetre" || unit == "millimeter") return 0.001;
  if (unit == "km" || unit == "kilometre" || unit == "kilometer") return 1000;
  return kNaN;
}

bool is_alpha(GDALDataset& set, int band) {
  return set.GetRasterBand(band)->GetColorInterpretation() == GCI_AlphaBand;
}

/// Refuses what would be costly: sizes, blocks, formats that are decoded as a whole.
Result<void> within_limits(const std::string& path, GDALDataset& set, GDALRasterBand& band) {
  const std::int64_t cols = set.GetRasterXSize(), rows = set.GetRasterYSize();
  if (cols < 1 || rows < 1 || cols > kRasterLimits.max_side || rows > kRasterLimits.max_side)
    return fail(Errc::out_of_range, fmt::format("{}: {} x {} posts is beyond {} a side", path, cols,
                                                rows, kRasterLimits.max_side));
  int block_cols = 0, block_rows = 0;
  band.GetBlockSize(&block_cols, &block_rows);
  const std::int64_t sample =
      std::int64_t(GDALGetDataTypeSizeBytes(band.GetRasterDataType())) * set.GetRasterCount();
  if (std::int64_t(block_cols) * block_rows > kRasterLimits.max_block_bytes / sample)
    return fail(Errc::out_of_range,
                fmt::format("{}: blocks of {} x {} are larger than {} MiB; rewrite it with "
                            "gdal_translate -co TILED=YES",
                            path, block_cols, block_rows, kRasterLimits.max_block_bytes >> 20));
  const std::string driver = set.GetDriverName();
  if (driver == "GTiff") {  // each block has a place in the directory, sparse ones a zero
    constexpr std::int64_t kLeastPlace = 2;
    const std::int64_t blocks =
        ((cols + block_cols - 1) / block_cols) * ((rows + block_rows - 1) / block_rows);
    VSIStatBufL stat;  // of what GDAL has open: unpacked, where it was packed
    const std::int64_t bytes =
        VSIStatExL(set.GetDescription(), &stat, VSI_STAT_SIZE_FLAG) == 0 ? stat.st_size : 0;
    if (bytes > 0 && blocks * kLeastPlace > bytes)
      return fail(
          Errc::bad_data,
          fmt::format("{}: says that it has {} blocks, more than a file of {} bytes can list", path,
                      blocks, bytes));
  }
  const bool whole = driver == "PNG" || driver == "USGSDEM";
  if (whole && cols * rows > kRasterLimits.max_whole_bytes / sample)
    return fail(Errc::out_of_range, path + ": too large for its format; convert it to GeoTIFF");
  return {};
}

/// The bands whose blocks lie apart from one another in the file.
std::vector<int> planes(GDALDataset& set, int first, int count) {
  std::vector<int> bands{first};
  const char* interleave = set.GetMetadataItem("INTERLEAVE", "IMAGE_STRUCTURE");
  if (!interleave || std::string(interleave) != "BAND") return bands;
  for (int b = 1; b <= set.GetRasterCount(); ++b)
    if ((b > first && b < first + count) || (b != first && is_alpha(set, b))) bands.push_back(b);
  return bands;
}

double decoded(HeightEncoding encoding, unsigned red, unsigned green, unsigned blue) {
  if (red == 0 && green == 0 && blue == 0) return kNaN;
  const unsigned number = red << 16 | green << 8 | blue;
  return encoding == HeightEncoding::mapbox ? -10000 + number * 0.1 : number / 256.0 - 32768;
}

/// Of a mask in the file, or in FILE.msk beside it.
GDALDataset* mask_of(GDALDataset& set, int band) {
  return set.GetRasterBand(band)->GetMaskBand()->GetDataset();
}

std::vector<std::uint32_t> colours_of(const GDALColorTable& table) {
  std::vector<std::uint32_t> colours;
  for (int i = 0; i < std::min(table.GetColorEntryCount(), 256); ++i) {
    GDALColorEntry e{};
    table.GetColorEntryAsRGB(i, &e);
    const auto byte = [](short c) { return std::uint32_t(std::clamp<int>(c, 0, 255)); };
    colours.push_back(byte(e.c4) << 24 | byte(e.c1) << 16 | byte(e.c2) << 8 | byte(e.c3));
  }
  return colours;
}

}  // namespace

Result<void> HeightBand::choose(const std::string& path, GDALDataset& set,
                                const DemOptions& options) {
  const int bands = set.GetRasterCount();
  if (bands < 1) return fail(Errc::unsupported, path + ": has no raster");
  encoding_ = options.encoding;
  band_ = options.band > 0 ? options.band : 1;
  if (band_ > bands)
    return fail(Errc::invalid_argument, fmt::format("{}: has {} band{}, so there is no band {}",
                                                    path, bands, bands == 1 ? "" : "s", band_));
  GDALRasterBand& band = *set.GetRasterBand(band_);
  const GDALDataType type = band.GetRasterDataType();
  if (encoding_ == HeightEncoding::number) {
    if (options.band == 0 && bands > 1 && !(bands == 2 && is_alpha(set, 2)))
      return fail(Errc::unsupported,
                  fmt::format("{}: has {} bands; a DEM has one: name it with --band{}", path, bands,
                              bands >= 3 && type == GDT_Byte
                                  ? ", or, where its colours are heights, say --encoding mapbox or "
                                    "terrarium"
                                  : ""));
    if (GDALDataTypeIsComplex(type) || (band.GetColorTable() && options.band == 0))
      return fail(Errc::unsupported, path + ": its numbers are colours or complex, not heights");
    return {};
  }
  if (type == GDT_Byte && band.GetColorTable()) palette_ = colours_of(*band.GetColorTable());
  bool three = band_ + 2 <= bands;
  for (int b = band_; three && b < band_ + 3; ++b)
    three = set.GetRasterBand(b)->GetRasterDataType() == GDT_Byte && !is_alpha(set, b);
  if (options.band == 0 && bands > 4)
    return fail(
        Errc::unsupported,
        fmt::format("{}: has {} bands; say with --band which is the first of the three that "
                    "hold heights as colours",
                    path, bands));
  if (palette_.empty() && !three)
    return fail(Errc::unsupported,
                fmt::format("{}: heights as colours ({}) are three bands of bytes, red, green and "
                            "blue; it has {} of {}",
                            path, name_of(encoding_), bands, GDALGetDataTypeName(type)));
  return {};
}

Result<void> HeightBand::interpret(const std::string& path, GDALDataset& set,
                                   double vertical_unit_m, const DemOptions& options) {
  GDALRasterBand& band = *set.GetRasterBand(band_);
  const bool colours = encoding_ != HeightEncoding::number;
  int has = 0;
  scale_ = colours ? 1 : band.GetScale(&has);
  offset_ = colours ? 0 : band.GetOffset(&has);
  if (options.scale) scale_ = *options.scale;
  if (options.offset) offset_ = *options.offset;
  if (!std::isfinite(scale_) || scale_ == 0 || !std::isfinite(offset_))
    return fail(Errc::bad_data, path + ": its scale or offset is not a number");
  z_unit_m_ = colours ? 1 : unit_in_metres(band.GetUnitType());
  if (std::isnan(z_unit_m_))
    return fail(Errc::unsupported, fmt::format("{}: heights in the unit '{}', which tind does not "
                                               "know; set m or ft with gdal_edit.py -units",
                                               path, band.GetUnitType()));
  if (z_unit_m_ == 0) z_unit_m_ = vertical_unit_m;
  if (z_unit_m_ == 0) z_unit_m_ = 1;

  content_ = {.type = GDALGetDataTypeName(band.GetRasterDataType()),
              .band = band_,
              .bands = set.GetRasterCount(),
              .encoding = encoding_,
              .scale = scale_,
              .offset = offset_,
              .unit_m = z_unit_m_,
              .nodata = {}};
  const GDALDataType type = band.GetRasterDataType();
  is_float_ = GDALDataTypeIsFloating(type);
  const bool converted =
      scale_ != 1 || offset_ != 0 || (z_unit_m_ != 1 && !options.keep_source_units);
  exact_ = !converted && type != GDT_Float64 && encoding_ != HeightEncoding::mapbox;
  if (!options.keep_source_units) {
    scale_ *= z_unit_m_;
    offset_ *= z_unit_m_;
  }
  nodata_ = options.nodata;
  const double declared = band.GetNoDataValue(&has);
  if (has && !options.ignore_declared_nodata && !colours) nodata_.push_back(declared);
  // 0: a mask of this band alone.
  masked_ = band.GetMaskFlags() == 0 || (band.GetMaskFlags() & GMF_PER_DATASET) != 0;
  for (int b = 1; b <= set.GetRasterCount() && !masked_; ++b)  // beside floats GDAL passes over it
    if (b != band_ && is_alpha(set, b)) alpha_ = b;
  content_.nodata = nodata_;
  content_.mask = masked_ || alpha_ > 0;
  return {};
}

namespace {

/// GDAL takes a mask that it cannot make out for none, and what it hides for heights.
Result<void> no_mask_beside(const std::string& path) {
  std::error_code ignored;
  for (const char* const end : {".msk", ".MSK"})
    if (std::filesystem::exists(std::filesystem::symlink_status(path + end, ignored)))
      return fail(Errc::bad_data, path + end +
                                      ": is no mask that could be read; mend it, or move it away "
                                      "if there is to be none");
  return {};
}

}  // namespace

Result<HeightBand> HeightBand::of(const std::string& path, GDALDataset& set, double vertical_unit_m,
                                  bool whole, const DemOptions& options) {
  HeightBand heights;
  if (auto ok = heights.choose(path, set, options); !ok) return std::unexpected(ok.error());
  if (auto ok = within_limits(path, set, *set.GetRasterBand(heights.band_)); !ok)
    return std::unexpected(ok.error());
  if (auto ok = heights.interpret(path, set, vertical_unit_m, options); !ok)
    return std::unexpected(ok.error());
  if (!heights.masked_ && !whole)
    if (auto ok = no_mask_beside(path); !ok) return std::unexpected(ok.error());
  const bool three = heights.encoding_ != HeightEncoding::number && heights.palette_.empty();
  if (!whole)
    heights.sums_ = std::make_unique<BlockSums>(set, planes(set, heights.band_, three ? 3 : 1));
  if (GDALDataset* const mask = heights.masked_ ? mask_of(set, heights.band_) : nullptr;
      mask && !whole)
    heights.mask_sums_ = std::make_unique<BlockSums>(
        *mask,
        std::vector<int>{std::max(1, set.GetRasterBand(heights.band_)->GetMaskBand()->GetBand())});
  return heights;
}

Result<void> HeightBand::read_colours(GDALDataset& set, int col, int row, int cols, int rows,
                                      std::span<double> out) const {
  const std::size_t posts = out.size(), bands = palette_.empty() ? 3 : 1;
  std::vector<GByte> bytes(posts * bands);
  for (std::size_t b = 0; b < bands; ++b)
    if (set.GetRasterBand(band_ + int(b))
            ->RasterIO(GF_Read, col, row, cols, rows, &bytes[b * posts], cols, rows, GDT_Byte, 0, 0,
                       nullptr) != CE_None)
      return fail(Errc::bad_data, "");
  for (std::size_t i = 0; i < posts; ++i) {
    if (palette_.empty()) {
      out[i] = decoded(encoding_, bytes[i], bytes[posts + i], bytes[2 * posts + i]);
      continue;
    }
    const std::uint32_t c = bytes[i] < palette_.size() ? palette_[bytes[i]] : 0;
    out[i] = c >> 24 == 0 ? kNaN : decoded(encoding_, c >> 16 & 255, c >> 8 & 255, c & 255);
  }
  return {};
}

Result<void> HeightBand::read_raw(GDALDataset& set, const std::string& file, int col, int row,
                                  int cols, int rows, std::span<double> out) const {
  if (sums_)
    if (auto ok = sums_->check(set, file, col, row, cols, rows); !ok) return ok;
  GDALRasterBand& band = *set.GetRasterBand(band_);
  if (encoding_ != HeightEncoding::number) {
    if (auto ok = read_colours(set, col, row, cols, rows, out); !ok) return ok;
  } else if (band.RasterIO(GF_Read, col, row, cols, rows, out.data(), cols, rows, GDT_Float64, 0, 0,
                           nullptr) != CE_None) {
    return fail(Errc::bad_data, "");
  }
  if (alpha_ > 0) {
    std::vector<double> alpha(out.size());
    if (set.GetRasterBand(alpha_)->RasterIO(GF_Read, col, row, cols, rows, alpha.data(), cols, rows,
                                            GDT_Float64, 0, 0, nullptr) != CE_None)
      return fail(Errc::bad_data, "");
    for (std::size_t i = 0; i < alpha.size(); ++i)
      if (!(alpha[i] > 0)) out[i] = kNaN;
  }
  if (!masked_) return {};
  if (GDALDataset* const own = mask_sums_ ? mask_of(set, band_) : nullptr) {
    const std::string beside = own->GetDescription();
    if (auto ok = mask_sums_->check(*own, lower_case(beside).ends_with(".msk") ? beside : file, col,
                                    row, cols, rows);
        !ok)
      return fail("its mask", ok.error());
  }
  std::vector<GByte> mask(out.size());
  if (band.GetMaskBand()->RasterIO(GF_Read, col, row, cols, rows, mask.data(), cols, rows, GDT_Byte,
                                   0, 0, nullptr) != CE_None)
    return fail(Errc::bad_data, "");
  for (std::size_t i = 0; i < mask.size(); ++i)
    if (mask[i] == 0) out[i] = kNaN;
  return {};
}

bool HeightBand::is_void(double raw) const {
  // NaN, infinite, what 32 bits hold at most (+-3.4e38, 1.7e38), or 64 bits (+-1.8e308).
  constexpr double kLeast = 1e38, kMostOf32 = 3.5e38, kMostOf64 = 1.7e308;
  const double size = std::abs(raw);
  if (!(size < kLeast) && !(size > kMostOf32 && size < kMostOf64)) return true;
  // A float32 nodata value is often written in decimal with other digits than the stored float.
  return std::ranges::any_of(nodata_, [&](double nodata) {
    return raw == nodata || (is_float_ && float(raw) == float(nodata));
  });
}

double HeightBand::height(double raw) const { return is_void(raw) ? kNaN : raw * scale_ + offset_; }

}  // namespace tind::gdal
