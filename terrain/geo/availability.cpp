#include "terrain/geo/availability.h"

#include <algorithm>
#include <cmath>

namespace tind {

namespace {

using Columns = std::vector<std::pair<std::uint32_t, std::uint32_t>>;

/// Runs of columns, touching ones joined.
Columns joined(Columns runs) {
  std::ranges::sort(runs);
  Columns out;
  for (const auto& [west, east] : runs) {
    if (!out.empty() && west <= out.back().second + 1)
      out.back().second = std::max(out.back().second, east);
    else
      out.emplace_back(west, east);
  }
  return out;
}

}  // namespace

TileRange tiles_over(const GeoRect& rect, int level) {
  const double side = tiling::tile_degrees(level);
  const auto index = [&](double degrees, std::uint32_t count, bool upper) {
    const double t = degrees / side;
    // A tile that only touches the rectangle from outside holds nothing but an edge.
    const double i = upper ? std::ceil(t) - 1 : std::floor(t);
    return std::uint32_t(std::clamp(i, 0.0, double(count - 1)));
  };
  const std::uint32_t columns = tiling::columns(level), rows = tiling::rows(level);
  TileRange r{index(rect.west + 180, columns, false), index(rect.south + 90, rows, false),
              index(rect.east + 180, columns, true), index(rect.north + 90, rows, true)};
  r.east = std::max(r.east, r.west);
  r.north = std::max(r.north, r.south);
  return r;
}

TileArea::TileArea(std::vector<TileRange> given) {
  std::ranges::sort(given);
  const auto twice = std::ranges::unique(given);
  given.erase(twice.begin(), twice.end());
  // By their northern ends, so that a sweep to the south takes each in once.
  std::ranges::stable_sort(given, std::greater{}, &TileRange::north);
  std::vector<std::int64_t> cuts;  // rows at whose northern side a band may begin
  for (const TileRange& r : given) {
    cuts.push_back(r.north);
    cuts.push_back(std::int64_t(r.south) - 1);
  }
  std::ranges::sort(cuts, std::greater{});
  const auto same = std::ranges::unique(cuts);
  cuts.erase(same.begin(), same.end());

  std::vector<TileRange> open;
  std::size_t next = 0;
  Columns last;
  std::size_t last_band = 0;  // its first rectangle
  for (std::size_t k = 0; k + 1 < cuts.size(); ++k) {
    const auto north = std::uint32_t(cuts[k]), south = std::uint32_t(cuts[k + 1] + 1);
    while (next < given.size() && given[next].north == north) open.push_back(given[next++]);
    std::erase_if(open, [&](const TileRange& r) { return r.south > north; });
    Columns runs;
    for (const TileRange& r : open) runs.emplace_back(r.west, r.east);
    runs = joined(std::move(runs));
    if (runs == last) {  // the band goes on
      for (std::size_t i = last_band; i < ranges_.size(); ++i) ranges_[i].south = south;
      continue;
    }
    last_band = ranges_.size();
    for (const auto& [west, east] : runs) ranges_.push_back({west, south, east, north});
    last = std::move(runs);
  }
  std::uint64_t count = 0;
  for (const TileRange& r : ranges_) before_.push_back(count += r.size());
}

bool TileArea::contains(std::uint32_t x, std::uint32_t y) const {
  const auto after = std::ranges::partition_point(
      ranges_, [&](const TileRange& r) { return r.south > y || (r.north >= y && r.west <= x); });
  if (after == ranges_.begin()) return false;
  const TileRange& r = *std::prev(after);
  return r.south <= y && r.north >= y && x <= r.east;
}

std::pair<std::uint32_t, std::uint32_t> TileArea::operator[](std::uint64_t i) const {
  const auto k = std::size_t(std::ranges::upper_bound(before_, i) - before_.begin());
  const TileRange& r = ranges_[k];
  if (k > 0) i -= before_[k - 1];
  return {r.west + std::uint32_t(i % r.columns()), r.north - std::uint32_t(i / r.columns())};
}

std::vector<TileRange> TileArea::within(const TileRange& frame) const {
  std::vector<TileRange> parts;
  for (const TileRange& r : ranges_) {
    const TileRange part{std::max(r.west, frame.west), std::max(r.south, frame.south),
                         std::min(r.east, frame.east), std::min(r.north, frame.north)};
    if (part.west <= part.east && part.south <= part.north) parts.push_back(part);
  }
  return parts;
}

}  // namespace tind
