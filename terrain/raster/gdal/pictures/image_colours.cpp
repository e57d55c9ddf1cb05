// Pixels are kept as pictures have them (sRGB, a byte a channel), and averaged as light.

#include "terrain/raster/image_colours.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include "terrain/base/hash.h"
#include "terrain/raster/gdal/gdal_setup.h"
#include "terrain/raster/gdal/pictures/pixel_scale.h"
#include "terrain/raster/gdal/pictures/placed_raster.h"

namespace tind {
namespace {

constexpr int kLongestSide = 8192;  // pixels that are kept
constexpr int kStrip = 256;         // rows that are read at a time

/// IEC 61966-2-1.
const std::array<float, 256>& light_of_byte() {
  static const auto table = [] {
    std::array<float, 256> t;
    for (std::size_t i = 0; i < t.size(); ++i) {
      const double c = double(i) / 255;
      t[i] = float(c <= .04045 ? c / 12.92 : std::pow((c + .055) / 1.055, 2.4));
    }
    return t;
  }();
  return table;
}

/// The byte whose light is nearest.
std::uint8_t byte_of_light(float light) {
  const auto& table = light_of_byte();
  const auto above = std::ranges::lower_bound(table, light);
  if (above == table.begin()) return 0;
  if (above == table.end()) return 255;
  return std::uint8_t(above - table.begin() - (light - above[-1] < *above - light ? 1 : 0));
}

using Pixel = std::array<std::uint8_t, 4>;  // red, green, blue; 255 where the image is, else 0

struct Picture {
  int width = 0, height = 0;
  std::vector<Pixel> pixels;

  const Pixel& at(int x, int y) const {
    return pixels[std::size_t(std::clamp(y, 0, height - 1)) * std::size_t(width) +
                  std::size_t(std::clamp(x, 0, width - 1))];
  }
};

struct Weighted {
  std::array<float, 3> light{};
  float weight = 0;

  void add(const Pixel& p, float w) {
    if (p[3] == 0) return;
    weight += w;
    for (std::size_t k = 0; k < 3; ++k) light[k] += w * light_of_byte()[p[k]];
  }
  /// REQUIRES: weight > 0.
  ImageColours::Linear mean() const {
    return {light[0] / weight, light[1] / weight, light[2] / weight};
  }
};

/// Four pixels become one; at an odd edge two, or one.
Picture halved(const Picture& p) {
  Picture out{(p.width + 1) / 2, (p.height + 1) / 2, {}};
  out.pixels.reserve(std::size_t(out.width) * std::size_t(out.height));
  for (int y = 0; y < out.height; ++y)
    for (int x = 0; x < out.width; ++x) {
      Weighted sum;
      for (int j = 2 * y; j < std::min(2 * y + 2, p.height); ++j)
        for (int i = 2 * x; i < std::min(2 * x + 2, p.width); ++i) sum.add(p.at(i, j), 1);
      Pixel pixel{};
      if (sum.weight > 0) {
        const auto mean = sum.mean();
        for (std::size_t k = 0; k < 3; ++k) pixel[k] = byte_of_light(mean[k]);
        pixel[3] = 255;
      }
      out.pixels.push_back(pixel);
    }
  return out;
}

/// Reads an open image, strip by strip.
class Reader {
 public:
  explicit Reader(GDALDataset& set)
      : set_(set),
        first_(*set.GetRasterBand(1)),
        palette_(first_.GetColorTable()),
        bands_(set.GetRasterCount() >= 3 && !palette_ ? 3 : 1) {
    const double most = std::max(set.GetRasterXSize(), set.GetRasterYSize());
    const double kept = std::min(1.0, kLongestSide / most);
    out_.width = std::max(1, int(std::lround(set.GetRasterXSize() * kept)));
    out_.height = std::max(1, int(std::lround(set.GetRasterYSize() * kept)));
    out_.pixels.assign(std::size_t(out_.width) * std::size_t(out_.height), Pixel{0, 0, 0, 255});
  }

  Result<Picture> read() {
    const gdal::Complaints complaints;
    for (int row = 0; row < out_.height; row += kStrip)
      if (!read_strip(row, std::min(kStrip, out_.height - row)) || complaints.failed())
        return complaints.no_pixels();
    return std::move(out_);
  }

 private:
  GDALDataset& set_;
  GDALRasterBand& first_;
  const GDALColorTable* palette_;
  const int bands_;
  Picture out_;

  bool read_band(GDALRasterBand& band, int row, int rows, bool average,
                 std::vector<float>& values) {
    values.resize(std::size_t(out_.width) * std::size_t(rows));
    const double scale = double(set_.GetRasterYSize()) / out_.height;
    GDALRasterIOExtraArg how;
    INIT_RASTERIO_EXTRA_ARG(how);
    how.eResampleAlg = average ? GRIORA_Average : GRIORA_NearestNeighbour;
    how.bFloatingPointWindowValidity = TRUE;
    how.dfXOff = 0, how.dfXSize = set_.GetRasterXSize();
    how.dfYOff = row * scale, how.dfYSize = rows * scale;
    const int top = int(how.dfYOff);
    const int bottom = std::min(set_.GetRasterYSize(), int(std::ceil(how.dfYOff + how.dfYSize)));
    return band.RasterIO(GF_Read, 0, top, set_.GetRasterXSize(), bottom - top, values.data(),
                         out_.width, rows, GDT_Float32, 0, 0, &how) == CE_None;
  }

  bool read_strip(int row, int rows) {
    Pixel* const pixels = &out_.pixels[std::size_t(row) * std::size_t(out_.width)];
    std::vector<float> values;
    for (int b = 0; b < bands_; ++b) {
      GDALRasterBand& band = *set_.GetRasterBand(b + 1);
      if (!read_band(band, row, rows, !palette_, values)) return false;
      const double scale = 255 / gdal::full_scale(band.GetRasterDataType());
      for (std::size_t i = 0; i < values.size(); ++i) take(values[i], scale, b, pixels[i]);
    }
    if (first_.GetMaskFlags() & GMF_ALL_VALID) return true;
    if (!read_band(*first_.GetMaskBand(), row, rows, false, values)) return false;
    for (std::size_t i = 0; i < values.size(); ++i)
      if (!(values[i] > 127)) pixels[i] = {};
    return true;
  }

  void take(float value, double scale, int band, Pixel& pixel) const {
    if (palette_) {
      GDALColorEntry e{};
      palette_->GetColorEntryAsRGB(int(std::clamp(value, 0.f, 65535.f)), &e);
      pixel = {std::uint8_t(e.c1), std::uint8_t(e.c2), std::uint8_t(e.c3), 255};
      return;
    }
    if (!std::isfinite(value)) {
      pixel[3] = 0;
      return;
    }
    const auto byte = std::uint8_t(std::lround(std::clamp(double(value) * scale, 0., 255.)));
    for (int k = 0; k < 3; ++k)
      if (bands_ == 1 || k == band) pixel[std::size_t(k)] = byte;
  }
};

class ColourPyramid : public ImageColours {
 public:
  ColourPyramid(Picture picture, gdal::Frame frame, Vec2 shrunk, std::string fingerprint)
      : frame_(std::move(frame)), shrunk_(shrunk), fingerprint_(std::move(fingerprint)) {
    const Vec2 spacing = frame_.spacing_m();
    pixel_m_ = std::max(spacing.x / shrunk_.x, spacing.y / shrunk_.y);
    bounds_ = frame_.bounds();
    levels_.push_back(std::move(picture));
    while (levels_.back().width > 1 || levels_.back().height > 1)
      levels_.push_back(halved(levels_.back()));
  }

  void at(std::span<const Geographic> places, double pixel_m,
          std::span<std::optional<Linear>> out) const override {
    const double finer = std::ceil(std::log2(std::max(pixel_m / pixel_m_, 1.0)) - .01);
    const auto level = std::min(std::size_t(std::max(finer, 0.0)), levels_.size() - 1);
    std::vector<Vec2> pixels(places.size());
    frame_.to_pixel(places, pixels);
    for (std::size_t i = 0; i < places.size(); ++i) out[i] = sample(pixels[i], level);
  }

  const std::string& fingerprint() const override { return fingerprint_; }
  const GeoRect& bounds() const override { return bounds_; }

 private:
  gdal::Frame frame_;
  Vec2 shrunk_;  // kept pixels a pixel of the file
  std::string fingerprint_;
  double pixel_m_ = 1;  // of level 0
  GeoRect bounds_;
  std::vector<Picture> levels_;

  /// `file`: in pixels of the file, whose first one's centre is (0, 0).
  std::optional<Linear> sample(Vec2 file, std::size_t level) const {
    const Vec2 kept{(file.x + .5) * shrunk_.x, (file.y + .5) * shrunk_.y};  // from the corner
    if (!(kept.x >= 0 && kept.y >= 0 && kept.x <= levels_[0].width && kept.y <= levels_[0].height))
      return {};
    const Picture& picture = levels_[level];
    const double side = std::ldexp(1, int(level));
    const double x = kept.x / side - .5, y = kept.y / side - .5;
    const int x0 = int(std::floor(x)), y0 = int(std::floor(y));
    const auto fx = float(x - x0), fy = float(y - y0);
    Weighted sum;
    sum.add(picture.at(x0, y0), (1 - fx) * (1 - fy));
    sum.add(picture.at(x0 + 1, y0), fx * (1 - fy));
    sum.add(picture.at(x0, y0 + 1), (1 - fx) * fy);
    sum.add(picture.at(x0 + 1, y0 + 1), fx * fy);
    if (sum.weight <= 0) return {};
    return sum.mean();
  }
};

}  // namespace

Result<std::shared_ptr<const ImageColours>> ImageColours::open(const std::string& path) {
  auto raster = gdal::open_placed(path, "an image tind reads");
  if (!raster) return std::unexpected(raster.error());
  const auto& set = raster->set;
  GDALRasterBand& first = *set->GetRasterBand(1);
  const GDALDataType type = first.GetRasterDataType();
  const bool grey = set->GetRasterCount() < 3 && !first.GetColorTable();
  if (grey && type != GDT_Byte && type != GDT_UInt16)
    return fail(Errc::bad_data,
                path + ": one band of " + GDALGetDataTypeName(type) +
                    " holds heights or other numbers rather than colours; a picture is grey (8 or "
                    "16 bits without sign), has a palette, or red, green and blue");
  auto picture = Reader(*set).read();
  if (!picture) return fail(path, picture.error());
  if (std::ranges::all_of(picture->pixels, [](const Pixel& p) { return p[3] == 0; }))
    return fail(Errc::bad_data,
                path + ": it shows nothing: every pixel is transparent, masked or no data");
  const Vec2 shrunk{double(picture->width) / set->GetRasterXSize(),
                    double(picture->height) / set->GetRasterYSize()};
  const auto pixels = hash128({picture->pixels.data(), picture->pixels.size() * sizeof(Pixel)});
  const std::string said =
      raster->place + " " + std::to_string(picture->width) + " " + pixels.text();
  return std::make_shared<ColourPyramid>(std::move(*picture), std::move(raster->frame), shrunk,
                                         hash128(said).text());
}

}  // namespace tind
