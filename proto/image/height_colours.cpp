#include "proto/image/height_colours.h"

#include <algorithm>
#include <cmath>

namespace tind::proto {
namespace {

double lowest_m(HeightCode code) { return code == HeightCode::mapbox ? -10000 : -32768; }
double lowest_step(HeightCode code) { return code == HeightCode::mapbox ? 1 : 0; }
double steps_per_m(HeightCode code) { return code == HeightCode::mapbox ? 10 : 256; }

}  // namespace

std::optional<HeightCode> height_code_named(std::string_view word) {
  for (const HeightCode code : {HeightCode::mapbox, HeightCode::terrarium})
    if (word == name(code)) return code;
  return {};
}

std::string_view name(HeightCode code) {
  return code == HeightCode::mapbox ? "mapbox" : "terrarium";
}

double height_step_m(HeightCode code) { return 1 / steps_per_m(code); }

std::array<std::uint8_t, 3> height_colour(double metres, HeightCode code) {
  const double steps = std::round((metres - lowest_m(code)) * steps_per_m(code));
  const auto n = std::uint32_t(std::clamp(steps, lowest_step(code), double(0xFFFFFF)));
  return {std::uint8_t(n >> 16), std::uint8_t(n >> 8), std::uint8_t(n)};
}

double height_of(std::array<std::uint8_t, 3> colour, HeightCode code) {
  const int n = colour[0] << 16 | colour[1] << 8 | colour[2];
  return lowest_m(code) + n / steps_per_m(code);
}

double beyond_range_m(std::span<const float> heights, HeightCode code) {
  const double half = height_step_m(code) / 2;
  const double least = height_of(height_colour(-HUGE_VAL, code), code) - half;
  const double most = height_of(height_colour(HUGE_VAL, code), code) + half;
  double beyond = 0;
  for (const float metres : heights)
    beyond = std::max({beyond, least - double(metres), double(metres) - most});
  return beyond;
}

std::vector<std::uint8_t> height_colours(std::span<const float> heights, HeightCode code) {
  std::vector<std::uint8_t> samples;
  samples.reserve(3 * heights.size());
  for (const float metres : heights)
    for (const std::uint8_t channel : height_colour(metres, code)) samples.push_back(channel);
  return samples;
}

}  // namespace tind::proto
