#include "proto/polyline.h"

#include <cmath>
#include <cstdint>
#include <optional>

namespace tind::proto {
namespace {

constexpr char kFirst = 63;  // '?', the character of 0
constexpr int kBits = 5;
constexpr std::int64_t kMore = 1 << kBits;
constexpr int kMostGroups = 8;  // 40 bits: a thousand degrees with seven digits take 35
constexpr double kMostDegrees = 1000;

/// Signed numbers with the sign as lowest bit, so that small ones are short. Nothing where the text
/// ends early or is none.
std::optional<std::int64_t> take_number(std::string_view& text) {
  std::int64_t bits = 0;
  for (int group = 0; group < kMostGroups && std::size_t(group) < text.size(); ++group) {
    const std::int64_t value = text[std::size_t(group)] - kFirst;
    if (value < 0 || value >= 2 * kMore) return {};
    bits |= (value & (kMore - 1)) << (kBits * group);
    if (value >= kMore) continue;
    text.remove_prefix(std::size_t(group) + 1);
    return bits & 1 ? ~(bits >> 1) : bits >> 1;
  }
  return {};
}

void put_number(std::string& text, std::int64_t number) {
  std::int64_t bits = number < 0 ? ~(number * 2) : number * 2;
  for (; bits >= kMore; bits >>= kBits) text += char((kMore | (bits & (kMore - 1))) + kFirst);
  text += char(bits + kFirst);
}

}  // namespace

Result<std::vector<PolylinePlace>> decode_polyline(std::string_view text, int digits,
                                                   std::size_t most) {
  const double scale = std::pow(10, digits);
  std::vector<PolylinePlace> places;
  std::int64_t lat = 0, lon = 0;
  while (!text.empty()) {
    const auto north = take_number(text);
    const auto east = north ? take_number(text) : std::nullopt;
    if (!east) return fail(Errc::invalid_argument, "is no encoded polyline, or a part of one");
    lat += *north, lon += *east;
    const PolylinePlace place{double(lat) / scale, double(lon) / scale};
    if (std::abs(place.lat) > kMostDegrees || std::abs(place.lon) > kMostDegrees)
      return fail(Errc::invalid_argument, "leaves the earth");
    if (places.size() == most)
      return fail(Errc::invalid_argument, "must have at most " + std::to_string(most) + " places");
    places.push_back(place);
  }
  return places;
}

std::string encode_polyline(std::span<const PolylinePlace> places, int digits) {
  const double scale = std::pow(10, digits);
  std::string text;
  std::int64_t lat = 0, lon = 0;
  for (const PolylinePlace& place : places) {
    const auto north = std::int64_t(std::llround(place.lat * scale));
    const auto east = std::int64_t(std::llround(place.lon * scale));
    put_number(text, north - lat);
    put_number(text, east - lon);
    lat = north, lon = east;
  }
  return text;
}

}  // namespace tind::proto
