// What of an image lies under the DEM is read once, averaged down to about the DEM's own
// resolution, then looked up post by post.

#include "terrain/raster/gdal/pictures/image_source.h"

#include <gdal_priv.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <memory>
#include <optional>

#include "terrain/base/existing_file.h"
#include "terrain/raster/gdal/crs/gdal_crs.h"
#include "terrain/raster/gdal/crs/gdal_frame.h"
#include "terrain/raster/gdal/crs/geotransform.h"
#include "terrain/raster/gdal/gdal_setup.h"
#include "terrain/raster/gdal/heights/beside_raster.h"
#include "terrain/raster/gdal/pictures/pixel_scale.h"

namespace tind {

namespace {

using Dataset = std::unique_ptr<GDALDataset, decltype([](GDALDataset* d) { GDALClose(d); })>;

/// The longest side that is kept of an image, pixels: 3 floats each.
constexpr int kLongestSide = 8192;
constexpr Colour kWhite{1, 1, 1};
/// How far from its middle a pixel ends, and what rounding of places adds.
constexpr double kEdge = 0.5 + 1e-6;

/// A part of an image, in pixels of the file.
struct Window {
  int x = 0, y = 0, cols = 0, rows = 0;
};

struct Image {
  Window window;                    // of the file, which is kept
  int width = 0, height = 0;        // as kept
  double scale_x = 1, scale_y = 1;  // kept pixels per pixel of the file
  std::vector<Colour> pixels;
  std::vector<std::uint8_t> there;  // whether the image says a colour of that pixel

  std::size_t index(int x, int y) const {
    x = std::clamp(x, 0, width - 1), y = std::clamp(y, 0, height - 1);
    return std::size_t(y) * std::size_t(width) + std::size_t(x);
  }
  /// At a place in pixels of the file, whose first pixel's centre is (0, 0), by the pixels around
  /// it that are there; nothing where none is, or beyond the window.
  std::optional<Colour> sample(double file_x, double file_y) const {
    const double x = (file_x - window.x + 0.5) * scale_x - 0.5,
                 y = (file_y - window.y + 0.5) * scale_y - 0.5;
    if (!(x >= -kEdge && y >= -kEdge && x <= width - 1 + kEdge && y <= height - 1 + kEdge))
      return {};
    const int x0 = int(std::floor(x)), y0 = int(std::floor(y));
    const float fx = float(x - x0), fy = float(y - y0);
    Colour sum{};
    float weight = 0;
    const auto add = [&](int px, int py, float w) {
      const std::size_t at = index(px, py);
      if (w <= 0 || !there[at]) return;
      weight += w;
      for (std::size_t i = 0; i < 3; ++i) sum[i] += w * pixels[at][i];
    };
    add(x0, y0, (1 - fx) * (1 - fy)), add(x0 + 1, y0, fx * (1 - fy));
    add(x0, y0 + 1, (1 - fx) * fy), add(x0 + 1, y0 + 1, fx * fy);
    if (weight <= 0) return {};
    for (float& c : sum) c /= weight;
    return sum;
  }
};

Result<std::vector<float>> read_band(GDALRasterBand& band, const Image& image, bool average) {
  const Window& w = image.window;
  std::vector<float> values(std::size_t(image.width) * image.height);
  GDALRasterIOExtraArg how;
  INIT_RASTERIO_EXTRA_ARG(how);
  how.eResampleAlg = average ? GRIORA_Average : GRIORA_NearestNeighbour;
  const gdal::Complaints complaints;
  const CPLErr done = band.RasterIO(GF_Read, w.x, w.y, w.cols, w.rows, values.data(), image.width,
                                    image.height, GDT_Float32, 0, 0, &how);
  if (done != CE_None || complaints.failed()) return complaints.no_pixels();
  return values;
}

/// Kept size of a side of `pixels`: at most twice the DEM's posts.
int kept(int pixels, std::int64_t posts) {
  return int(std::clamp<std::int64_t>(2 * posts, 1, std::min(pixels, kLongestSide)));
}

Result<Image> read_image(GDALDataset& set, const Window& window, const DemInfo& dem) {
  Image image;
  image.window = window;
  image.width = kept(window.cols, dem.cols);
  image.height = kept(window.rows, dem.rows);
  image.scale_x = double(image.width) / window.cols;
  image.scale_y = double(image.height) / window.rows;
  image.pixels.resize(std::size_t(image.width) * image.height);
  image.there.assign(image.pixels.size(), 1);
  const GDALColorTable* palette = set.GetRasterBand(1)->GetColorTable();
  const int bands = set.GetRasterCount() >= 3 && !palette ? 3 : 1;
  for (int b = 0; b < bands; ++b) {
    GDALRasterBand& band = *set.GetRasterBand(b + 1);
    const auto values = read_band(band, image, !palette);
    if (!values) return std::unexpected(values.error());
    const double scale = 1 / gdal::full_scale(band.GetRasterDataType());
    for (std::size_t i = 0; i < image.pixels.size(); ++i) {
      const float v = (*values)[i];
      Colour& c = image.pixels[i];
      if (palette) {
        GDALColorEntry e{};
        palette->GetColorEntryAsRGB(int(std::clamp(v, 0.0f, 65535.0f)), &e);
        c = {e.c1 / 255.0f, e.c2 / 255.0f, e.c3 / 255.0f};
      } else {
        if (!std::isfinite(v)) image.there[i] = 0;
        const float unit = std::isfinite(v) ? std::clamp(float(v * scale), 0.0f, 1.0f) : 0.0f;
        if (bands == 1)
          c = {unit, unit, unit};
        else
          c[b] = unit;
      }
    }
  }
  GDALRasterBand& first = *set.GetRasterBand(1);
  if (first.GetMaskFlags() & GMF_ALL_VALID) return image;
  const auto mask = read_band(*first.GetMaskBand(), image, false);
  if (!mask) return std::unexpected(mask.error());
  for (std::size_t i = 0; i < mask->size(); ++i)
    if (!((*mask)[i] > 127)) image.there[i] = 0;
  return image;
}

/// The image's own frame, when both it and the DEM know where they are.
Result<std::optional<gdal::Frame>> image_frame(GDALDataset& set, const DemInfo& dem) {
  if (dem.crs_kind == CrsKind::none) return std::nullopt;
  const auto map = gdal::pixel_to_crs(set);
  if (!map) return std::unexpected(map.error());
  if (!*map) return std::nullopt;
  const auto crs = gdal::describe(set.GetSpatialRef());
  if (!crs) return std::unexpected(crs.error());
  if (crs->kind == CrsKind::none) return std::nullopt;
  auto frame = gdal::Frame::make(*crs, **map, set.GetRasterXSize(), set.GetRasterYSize());
  if (!frame) return std::unexpected(frame.error());
  return std::optional(std::move(*frame));
}

/// Where the posts of one row lie on the image, in pixels of the file.
class Placer {
 public:
  Placer(const DemSource& dem, const GDALDataset& set, const std::optional<gdal::Frame>& frame)
      : dem_(dem), frame_(frame), posts_(dem.info().cols), places_(posts_.size()) {
    auto* image = const_cast<GDALDataset*>(&set);  // GDAL's getters are not const
    const DemInfo& info = dem.info();
    step_x_ = double(image->GetRasterXSize()) / double(info.cols);
    step_y_ = double(image->GetRasterYSize()) / double(info.rows);
  }
  std::span<const Vec2> row(int r) {
    for (std::size_t c = 0; c < posts_.size(); ++c) posts_[c] = {double(c), double(r)};
    if (!frame_) {
      for (std::size_t c = 0; c < posts_.size(); ++c)
        places_[c] = {(double(c) + 0.5) * step_x_ - 0.5, (r + 0.5) * step_y_ - 0.5};
      return places_;
    }
    geographic_.resize(posts_.size());
    dem_.to_geographic(posts_, geographic_);
    frame_->to_pixel(geographic_, places_);
    return places_;
  }

 private:
  const DemSource& dem_;
  const std::optional<gdal::Frame>& frame_;
  std::vector<Vec2> posts_, places_;
  std::vector<Geographic> geographic_;
  double step_x_, step_y_;
};

/// What of the image lies under the DEM, by some of its rows, and a little more; empty where
/// nothing does.
Window window_under(Placer& placer, GDALDataset& set, int rows) {
  constexpr int kRows = 64;
  constexpr double kMore = 1.0 / kRows;
  Vec2 low{HUGE_VAL, HUGE_VAL}, high{-HUGE_VAL, -HUGE_VAL};
  for (int k = 0; k <= kRows; ++k)
    for (const Vec2& p : placer.row(int(std::int64_t(rows - 1) * k / kRows))) {
      if (!std::isfinite(p.x) || !std::isfinite(p.y)) continue;
      low = {std::min(low.x, p.x), std::min(low.y, p.y)};
      high = {std::max(high.x, p.x), std::max(high.y, p.y)};
    }
  const auto part = [](double from, double to, int pixels, int& first, int& count) {
    const double more = (to - from) * kMore + 2;
    first = int(std::clamp(std::floor(from - more), 0.0, double(pixels)));
    count = int(std::clamp(std::ceil(to + more) + 1, 0.0, double(pixels))) - first;
  };
  Window window;
  if (!(low.x <= high.x)) return window;
  part(low.x, high.x, set.GetRasterXSize(), window.x, window.cols);
  part(low.y, high.y, set.GetRasterYSize(), window.y, window.rows);
  return window;
}

}  // namespace

Result<Drape> drape_image(const std::string& path, const DemSource& dem) {
  gdal::set_up();
  if (auto there = check_is_file(path); !there) return std::unexpected(there.error());
  if (auto ok = gdal::look_beside(path); !ok) return std::unexpected(ok.error());
  const gdal::Complaints complaints;
  const Dataset set(GDALDataset::Open(path.c_str(), GDAL_OF_RASTER | GDAL_OF_READONLY,
                                      gdal::raster_drivers(false, path)));
  if (!set) return fail(Errc::bad_data, path + ": " + complaints.text("not an image tind reads"));
  const auto frame = image_frame(*set, dem.info());
  if (!frame) return fail(path, frame.error());
  const int cols = int(dem.info().cols), rows = int(dem.info().rows);
  Placer placer(dem, *set, *frame);
  const Window window = window_under(placer, *set, rows);
  const auto beside = [&] {
    return fail(Errc::bad_data, path + ": no post of the DEM lies on this image");
  };
  if (window.cols <= 0 || window.rows <= 0) return beside();
  const auto image = read_image(*set, window, dem.info());
  if (!image) return fail(path, image.error());

  Drape drape;
  drape.by_coordinates = frame->has_value();
  drape.colours.reserve(std::size_t(cols) * rows);
  std::size_t inside = 0;
  for (int r = 0; r < rows; ++r) {
    for (const Vec2& p : placer.row(r)) {
      const auto colour = image->sample(p.x, p.y);
      inside += colour.has_value();
      drape.colours.push_back(colour.value_or(kWhite));
    }
  }
  if (inside == 0) return beside();
  drape.covered = double(inside) / double(drape.colours.size());
  return drape;
}

}  // namespace tind
