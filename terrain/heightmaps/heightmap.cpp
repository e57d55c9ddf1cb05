#include "terrain/heightmaps/heightmap.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "proto/image/png.h"
#include "terrain/base/bytes.h"

namespace tind {
namespace {

constexpr double kSteps = 65535;
constexpr double kLeastStepM = 1e-4;  // what is flat has a scale, too
constexpr int kLevel = 6;             // of DEFLATE: 66 million posts must not take minutes

/// Fire spreads from all posts that have a height at once, a post farther each round; within a
/// round in the posts' order, so that the same post wins everywhere.
void give_nearest(int cols, std::vector<float>& heights) {
  const auto wide = std::size_t(cols), count = heights.size();
  std::vector<std::size_t> front, next;
  const auto each_neighbour = [&](std::size_t at, const auto& f) {
    if (at >= wide) f(at - wide);
    if (at % wide > 0) f(at - 1);
    if (at % wide + 1 < wide) f(at + 1);
    if (at + wide < count) f(at + wide);
  };
  for (std::size_t at = 0; at < count; ++at) {
    bool edge = false;
    if (!std::isnan(heights[at]))
      each_neighbour(at, [&](std::size_t n) { edge = edge || std::isnan(heights[n]); });
    if (edge) front.push_back(at);
  }
  for (; !front.empty(); front.swap(next)) {
    next.clear();
    for (const std::size_t at : front)
      each_neighbour(at, [&](std::size_t n) {
        if (std::isnan(heights[n])) heights[n] = heights[at], next.push_back(n);
      });
  }
}

HeightRange range_of(const std::vector<float>& heights) {
  HeightRange r{HUGE_VAL, -HUGE_VAL};
  for (const float h : heights)
    if (!std::isnan(h)) r = {std::min(r.least_m, double(h)), std::max(r.most_m, double(h))};
  return r;
}

/// How far a float may be from the height that it was rounded from, in a range of them.
double float_rounding_m(const HeightRange& r) {
  const auto largest = float(std::max(std::abs(r.least_m), std::abs(r.most_m)));
  return (double(std::nextafter(largest, HUGE_VALF)) - double(largest)) / 2;
}

Result<void> check(const HeightRange& asked, const HeightRange& has) {
  if (asked.least_m <= has.least_m && has.most_m <= asked.most_m) return {};
  return fail(Errc::out_of_range,
              fmt::format("the map has heights from {:.2f} to {:.2f} m, beyond --heights {},{}",
                          has.least_m, has.most_m, asked.least_m, asked.most_m));
}

}  // namespace

Result<Heightmap> make_heightmap(const Surface& surface, MapPlace place,
                                 std::optional<HeightRange> range, int threads,
                                 const Progress& progress) {
  auto made = lattice_heights(surface, place.lattice(), {.threads = threads}, progress);
  if (!made) return std::unexpected(made.error());
  Heightmap map;
  map.heights = range_of(made->heights);
  if (map.heights.least_m > map.heights.most_m)
    return fail(Errc::bad_data, "no height where the map lies");
  if (range)
    if (auto ok = check(*range, map.heights); !ok) return std::unexpected(ok.error());
  const HeightRange scale = range.value_or(map.heights);
  map.place = std::move(place);
  map.zero_m = scale.least_m;
  map.step_m = std::max((scale.most_m - scale.least_m) / kSteps, kLeastStepM);
  map.samples = made->samples, map.max_deviation_m = made->max_deviation_m;
  map.without_height = double(made->without_height) / double(made->heights.size());
  give_nearest(map.place.cols, made->heights);
  map.values.reserve(made->heights.size());
  for (const float h : made->heights) {
    const double v = std::clamp(std::round((h - map.zero_m) / map.step_m), 0., kSteps);
    map.values.push_back(std::uint16_t(v));
    map.max_error_m = std::max(map.max_error_m, std::abs(map.height_m(map.values.back()) - h));
  }
  // Posts were rounded to floats on the way here, and the source's maybe to those of its own.
  map.max_error_m += float_rounding_m(map.heights) + surface.info().rounding_m;
  return map;
}

std::string raw_of(const Heightmap& map, ByteOrder order, FirstRow first) {
  const auto wide = std::size_t(map.place.cols), high = std::size_t(map.place.rows);
  std::string bytes(2 * wide * high, '\0');
  char* out = bytes.data();
  for (std::size_t y = 0; y < high; ++y) {
    const std::size_t row = first == FirstRow::north ? y : high - 1 - y;
    for (const std::uint16_t v : std::span(map.values).subspan(row * wide, wide)) {
      if (order == ByteOrder::little)
        store(v, out);
      else
        store<std::endian::big>(v, out);
      out += sizeof v;
    }
  }
  return bytes;
}

std::string png_of(const Heightmap& map) {
  return proto::encode_grey16_png(
      map.place.cols, map.place.rows, map.values,
      {{"Height of 0 in metres", fmt::format("{}", map.zero_m)},
       {"Step in metres", fmt::format("{}", map.step_m)},
       {"Metres between pixels", fmt::format("{}", map.place.spacing_m)}},
      kLevel);
}

}  // namespace tind
