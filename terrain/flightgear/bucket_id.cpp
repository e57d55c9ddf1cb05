#include "terrain/flightgear/bucket_id.h"

#include <cassert>
#include <cmath>
#include <cstdio>
#include <cstdlib>

namespace tind::flightgear {
namespace {

constexpr int kDegree = 8;  // in eighths

int floor_to(int value, int step) {
  return value >= 0 ? value / step * step : -((-value + step - 1) / step * step);
}

/// "e006n45".
std::string name_of(int lon, int lat) {
  char text[32];
  std::snprintf(text, sizeof text, "%c%03d%c%02d", lon < 0 ? 'w' : 'e', std::abs(lon),
                lat < 0 ? 's' : 'n', std::abs(lat));
  return text;
}

}  // namespace

int width_of_row(int row) {
  // By the parallel in its south, of which the northern hemisphere counts itself and the southern
  // one what lies beyond.
  const double south = -90 + row / 8.0;
  const struct {
    double beyond;
    int eighths;
  } kBands[] = {{89, 96}, {86, 32}, {83, 16}, {76, 8}, {62, 4}, {22, 2}};
  for (const auto& [beyond, eighths] : kBands)
    if (south >= beyond || south < -beyond) return eighths;
  return 1;
}

BucketId bucket_at(Geographic p) {
  assert(p.lon >= -180 && p.lon < 180 && p.lat >= -90 && p.lat < 90);
  const int row = int(std::floor((p.lat + 90) * 8));
  return {row, floor_to(int(std::floor((p.lon + 180) * 8)), width_of_row(row))};
}

GeoRect rect(BucketId id) {
  const double west = -180 + id.eighths / 8.0, south = -90 + id.row / 8.0;
  return {west, south, west + width_of_row(id.row) / 8.0, south + 1 / 8.0};
}

std::uint32_t index_of(BucketId id) {
  const int x = id.eighths % kDegree / width_of_row(id.row);
  return std::uint32_t(id.eighths / kDegree) << 14 | std::uint32_t(id.row / kDegree) << 6 |
         std::uint32_t(id.row % kDegree) << 3 | std::uint32_t(x);
}

std::optional<BucketId> bucket_of(std::int64_t index) {
  if (index < 0 || index >= std::int64_t(360) << 14) return {};
  const int lon = int(index >> 14), lat = int(index >> 6 & 255);
  const int row = lat * kDegree + int(index >> 3 & 7);
  if (row >= kRows) return {};
  const int width = width_of_row(row), offset = int(index & 7) * width;
  const BucketId id{row, lon * kDegree + offset};
  if (offset >= kDegree || id.eighths % width != 0) return {};
  return id;
}

Folder folder_of(BucketId id) { return {id.eighths / kDegree - 180, id.row / kDegree - 90}; }

std::vector<BucketId> buckets_in(Folder f) {
  std::vector<BucketId> all;
  const int west = (f.lon + 180) * kDegree, south = (f.lat + 90) * kDegree;
  for (int row = south; row < south + kDegree; ++row)
    for (int x = west; x < west + kDegree; x += width_of_row(row))
      if (x % width_of_row(row) == 0) all.push_back({row, x});
  return all;
}

std::string path_of(Folder f) {
  return name_of(floor_to(f.lon, 10), floor_to(f.lat, 10)) + "/" + name_of(f.lon, f.lat);
}

std::optional<Folder> folder_named(std::string_view of_ten, std::string_view of_one) {
  const auto digits = [&](std::size_t from, std::size_t count) -> std::optional<int> {
    int value = 0;
    for (std::size_t i = from; i < from + count; ++i) {
      if (of_one[i] < '0' || of_one[i] > '9') return {};
      value = 10 * value + (of_one[i] - '0');
    }
    return value;
  };
  if (of_one.size() != 7) return {};
  const auto lon = digits(1, 3), lat = digits(5, 2);
  if (!lon || !lat) return {};
  const Folder f{of_one[0] == 'w' ? -*lon : *lon, of_one[4] == 's' ? -*lat : *lat};
  if (f.lon < -180 || f.lon >= 180 || f.lat < -90 || f.lat >= 90) return {};
  if (path_of(f) != std::string(of_ten) + "/" + std::string(of_one)) return {};
  return f;
}

}  // namespace tind::flightgear
