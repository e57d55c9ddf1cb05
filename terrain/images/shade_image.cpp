// The gradient between neighbouring places of one lattice: its mean over a pixel is then what H
// differs between the pixel's sides, whatever lies between them.

#include "terrain/images/shade_image.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

#include "terrain/geo/ellipsoid.h"
#include "terrain/images/sample_lattice.h"

namespace tind {
namespace {

constexpr double kDegree = std::numbers::pi / 180;
constexpr float kNone = std::numeric_limits<float>::quiet_NaN();

constexpr std::array<std::string_view, 3> kStyles = {"hillshade", "slope", "aspect"};

/// Of three heights `step` apart, the middle one of which there is.
double difference(double before, double here, double after, double step) {
  if (!std::isnan(before) && !std::isnan(after)) return (after - before) / (2 * step);
  if (!std::isnan(after)) return (after - here) / step;
  return (here - before) / step;  // NaN: nothing to go by
}

/// The rows of places that a row of pixels needs, and one on each side; kept from one to the next.
class Rows {
 public:
  explicit Rows(SampleLattice& lattice)
      : lattice_(lattice), rows_(std::size_t(lattice.samples()) + 2) {}

  /// Heights of a row from one place before the tile to one beyond it.
  const std::vector<double>& row(int row) {
    Row& kept = rows_[std::size_t(row + 1) % rows_.size()];
    if (kept.number != row || kept.heights.empty()) {
      kept.heights.resize(std::size_t(lattice_.side()) + 2);
      lattice_.heights(row, -1, kept.heights);
      kept.number = row;
    }
    return kept.heights;
  }

 private:
  struct Row {
    int number = 0;
    std::vector<double> heights;
  };
  SampleLattice& lattice_;
  std::vector<Row> rows_;
};

struct Sum {
  double east = 0, north = 0;
  int count = 0;
};

/// Adds the gradients of one row of places to the pixels in it.
void add_row(const SampleLattice& lattice, Rows& rows, int row, std::vector<Sum>& sums) {
  const auto &above = rows.row(row - 1), &here = rows.row(row), &below = rows.row(row + 1);
  const double lat = lattice.lat_of(row);
  const Vec2 degree = wgs84::metres_per_degree(lat);
  const double east = degree.x * 360 / std::ldexp(double(lattice.side()), lattice.level());
  const double north = degree.y * (lattice.lat_of(row - .5) - lattice.lat_of(row + .5));
  const auto n = std::size_t(lattice.samples());
  for (std::size_t i = 1; i + 1 < here.size(); ++i) {
    if (std::isnan(here[i])) continue;
    const double to_east = difference(here[i - 1], here[i], here[i + 1], east);
    const double to_north = difference(below[i], here[i], above[i], north);
    if (std::isnan(to_east) || std::isnan(to_north)) continue;
    Sum& sum = sums[(i - 1) / n];
    sum.east += to_east, sum.north += to_north, ++sum.count;
  }
}

/// A full colour of this hue, degrees.
std::array<std::uint8_t, 3> hue_colour(double hue) {
  const auto channel = [hue](double peak) {
    const double away = std::abs(std::remainder(hue - peak, 360));
    return std::uint8_t(std::lround(255 * std::clamp(2 - away / 60, 0., 1.)));
  };
  return {channel(0), channel(120), channel(240)};
}

void put_pixel(double east, double north, const Shade& shade, std::vector<std::uint8_t>& out) {
  switch (shade.style) {
    case ShadeStyle::hillshade:
      out.push_back(hillshade_grey(east, north, shade));
      break;
    case ShadeStyle::slope:
      out.push_back(std::uint8_t(std::lround(slope_deg(east, north) * 255 / 90)));
      break;
    case ShadeStyle::aspect: {
      const bool flat = east == 0 && north == 0;
      const auto colour =
          flat ? std::array<std::uint8_t, 3>{} : hue_colour(aspect_deg(east, north));
      out.insert(out.end(), colour.begin(), colour.end());
      out.push_back(flat ? 0 : 255);
      return;
    }
  }
  out.push_back(255);
}

std::vector<proto::PngText> texts(const GradientImage& image, const Shade& shade) {
  std::vector<proto::PngText> all = {
      {"Style", std::string(name(shade.style))},
      {"Samples of each pixel", fmt::format("{}", image.samples * image.samples)}};
  if (shade.style != ShadeStyle::hillshade) return all;
  all.emplace_back("Azimuth in degrees", fmt::format("{}", shade.azimuth_deg));
  all.emplace_back("Altitude in degrees", fmt::format("{}", shade.altitude_deg));
  all.emplace_back("Factor of heights", fmt::format("{}", shade.z_factor));
  return all;
}

}  // namespace

std::optional<ShadeStyle> shade_style_named(std::string_view word) {
  const auto found = std::ranges::find(kStyles, word);
  if (found == kStyles.end()) return {};
  return ShadeStyle(found - kStyles.begin());
}

std::string_view name(ShadeStyle style) { return kStyles[std::size_t(style)]; }

bool GradientImage::empty(std::size_t pixel) const { return std::isnan(east[pixel]); }

double slope_deg(double east, double north) { return std::atan(std::hypot(east, north)) / kDegree; }

double aspect_deg(double east, double north) {
  const double deg = std::atan2(-east, -north) / kDegree;
  const double turned = deg < 0 ? deg + 360 : deg + 0.0;  // -0 is north, too
  return turned < 360 ? turned : 0;
}

std::uint8_t hillshade_grey(double east, double north, const Shade& shade) {
  const double azimuth = shade.azimuth_deg * kDegree, altitude = shade.altitude_deg * kDegree;
  const double x = -shade.z_factor * east, y = -shade.z_factor * north;
  const double light = x * std::sin(azimuth) * std::cos(altitude) +
                       y * std::cos(azimuth) * std::cos(altitude) + std::sin(altitude);
  const double cosine = light / std::sqrt(x * x + y * y + 1);
  return std::uint8_t(std::lround(1 + 254 * std::clamp(cosine, 0., 1.)));
}

Result<GradientImage> gradient_image(const Surface& surface, web_mercator::Tile tile, int pixels,
                                     std::stop_token stop) {
  SampleLattice lattice(surface, tile, pixels);
  GradientImage image{.pixels = pixels, .east = {}, .north = {}, .samples = lattice.samples()};
  image.east.reserve(std::size_t(pixels) * std::size_t(pixels));
  image.north.reserve(image.east.capacity());
  Rows rows(lattice);
  std::vector<Sum> sums;
  const auto done = lattice.each_pixel_row(1, stop, [&](int row) {
    sums.assign(std::size_t(pixels), {});
    for (int j = 0; j < image.samples; ++j) add_row(lattice, rows, row * image.samples + j, sums);
    for (const Sum& sum : sums) {
      image.east.push_back(sum.count > 0 ? float(sum.east / sum.count) : kNone);
      image.north.push_back(sum.count > 0 ? float(sum.north / sum.count) : kNone);
    }
  });
  if (!done) return std::unexpected(done.error());
  return image;
}

proto::ImagePixels shade_pixels(const GradientImage& image, const Shade& shade) {
  proto::ImagePixels out{.width = image.pixels,
                         .height = image.pixels,
                         .channels = shade.style == ShadeStyle::aspect ? 4 : 2,
                         .samples = {},
                         .texts = texts(image, shade)};
  const auto channels = std::size_t(out.channels);
  out.samples.reserve(image.east.size() * channels);
  for (std::size_t k = 0; k < image.east.size(); ++k)
    if (image.empty(k))
      out.samples.insert(out.samples.end(), channels, 0);
    else
      put_pixel(image.east[k], image.north[k], shade, out.samples);
  return out;
}

}  // namespace tind
