#pragma once
// A geoid made up for a test, as PROJ reads it.

#include <bit>
#include <cstdint>
#include <fstream>
#include <functional>
#include <string>

namespace tind::test {

template <class T>
void put_big(std::string& out, T value) {
  std::uint64_t bits;
  if constexpr (sizeof value == 8)
    bits = std::bit_cast<std::uint64_t>(value);
  else
    bits = std::bit_cast<std::uint32_t>(value);
  for (int shift = int(sizeof value) * 8 - 8; shift >= 0; shift -= 8) out += char(bits >> shift);
}

using GeoidHeights = std::function<double(double lon, double lat)>;

/// A grid as PROJ reads it: nodes every half degree, 45..48 north and four degrees to the east.
inline std::string write_gtx(const std::string& path, const GeoidHeights& n, double west = 6) {
  std::string bytes;
  for (const double number : {45.0, west, 0.5, 0.5}) put_big(bytes, number);
  put_big(bytes, std::int32_t(7)), put_big(bytes, std::int32_t(9));
  for (int r = 0; r < 7; ++r)
    for (int c = 0; c < 9; ++c) put_big(bytes, float(n(west + 0.5 * c, 45 + 0.5 * r)));
  std::ofstream(path, std::ios::binary) << bytes;
  return path;
}

}  // namespace tind::test
