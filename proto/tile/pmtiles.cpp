#include "proto/tile/pmtiles.h"

#include <algorithm>
#include <limits>
#include <string_view>
#include <utility>

#include "terrain/base/bytes.h"
#include "terrain/base/deflate.h"

namespace tind::proto {

namespace {

constexpr std::string_view kMagic = "PMTiles";
constexpr std::uint8_t kVersion = 3;
constexpr std::size_t kFirstLeafEntries = 4096;
constexpr int kLevel = 10;         // of DEFLATE
constexpr int kLongestVarint = 9;  // 63 bits

/// Tiles of all zooms before this one.
std::uint64_t tiles_before(int zoom) { return ((std::uint64_t(1) << (2 * zoom)) - 1) / 3; }

/// The quadrant's own curve in the whole one's coordinates.
void turn(std::uint32_t side, std::uint32_t& x, std::uint32_t& y, bool east, bool south) {
  if (south) return;
  if (east) x = side - 1 - x, y = side - 1 - y;
  std::swap(x, y);
}

std::string packed(const std::string& bytes) {
  return deflate<std::string>(bytes, Wrapping::gzip, kLevel);
}

}  // namespace

std::string encode_pmtiles_header(const PmtilesHeader& h) {
  std::string bytes;
  ByteWriter<std::string> out(bytes);
  out.put_text(kMagic);
  out.put(kVersion);
  for (const PmtilesSection* s : {&h.root, &h.metadata, &h.leaves, &h.tiles})
    out.put(s->at), out.put(s->size);
  out.put(h.addressed), out.put(h.entries), out.put(h.contents);
  out.put(std::uint8_t(h.clustered));
  out.put(std::uint8_t(h.directories_are)), out.put(std::uint8_t(h.tiles_are));
  out.put(h.tile_type), out.put(h.min_zoom), out.put(h.max_zoom);
  out.put(h.west), out.put(h.south), out.put(h.east), out.put(h.north);
  out.put(h.centre_zoom), out.put(h.centre_lon), out.put(h.centre_lat);
  return bytes;
}

Result<PmtilesHeader> decode_pmtiles_header(std::span<const std::uint8_t> bytes) {
  ByteReader in(bytes);
  if (in.get_text(kMagic.size()) != kMagic) return fail(Errc::bad_data, "not a PMTiles archive");
  const auto version = in.get<std::uint8_t>();
  if (in.good() && version != kVersion)
    return fail(Errc::unsupported, "PMTiles of version " + std::to_string(version) + ", not 3");
  PmtilesHeader h;
  for (PmtilesSection* s : {&h.root, &h.metadata, &h.leaves, &h.tiles}) {
    s->at = in.get<std::uint64_t>(), s->size = in.get<std::uint64_t>();
    if (s->size > std::numeric_limits<std::uint64_t>::max() - s->at) in.refuse();
  }
  h.addressed = in.get<std::uint64_t>();
  h.entries = in.get<std::uint64_t>();
  h.contents = in.get<std::uint64_t>();
  const auto clustered = in.get<std::uint8_t>();
  const auto directories_are = in.get<std::uint8_t>(), tiles_are = in.get<std::uint8_t>();
  constexpr auto kLast = std::uint8_t(PmtilesPacking::zstd);
  if (clustered > 1 || directories_are > kLast || tiles_are > kLast) in.refuse();
  h.clustered = clustered == 1;
  h.directories_are = PmtilesPacking(directories_are), h.tiles_are = PmtilesPacking(tiles_are);
  h.tile_type = in.get<std::uint8_t>();
  h.min_zoom = in.get<std::uint8_t>(), h.max_zoom = in.get<std::uint8_t>();
  h.west = in.get<std::int32_t>(), h.south = in.get<std::int32_t>();
  h.east = in.get<std::int32_t>(), h.north = in.get<std::int32_t>();
  h.centre_zoom = in.get<std::uint8_t>();
  h.centre_lon = in.get<std::int32_t>(), h.centre_lat = in.get<std::int32_t>();
  if (!in.good()) return fail(Errc::bad_data, "a damaged header of PMTiles");
  return h;
}

std::uint64_t pmtiles_number(const PmtilesPlace& place) {
  const std::uint32_t side = std::uint32_t(1) << place.zoom;
  std::uint32_t x = place.x, y = place.y;
  std::uint64_t along = 0;
  for (std::uint32_t half = side / 2; half > 0; half /= 2) {
    const bool east = x & half, south = y & half;
    along += std::uint64_t(half) * half * (std::uint64_t(3 * east) ^ std::uint64_t(south));
    turn(side, x, y, east, south);
  }
  return tiles_before(place.zoom) + along;
}

std::optional<PmtilesPlace> pmtiles_place(std::uint64_t number) {
  if (number >= tiles_before(kPmtilesDeepest + 1)) return {};
  PmtilesPlace place;
  while (number >= tiles_before(place.zoom + 1)) ++place.zoom;
  std::uint64_t along = number - tiles_before(place.zoom);
  const std::uint32_t side = std::uint32_t(1) << place.zoom;
  for (std::uint32_t half = 1; half < side; half *= 2, along /= 4) {
    const bool east = along / 2 & 1, south = (along & 1) ^ east;
    turn(half, place.x, place.y, east, south);
    place.x += half * east, place.y += half * south;
  }
  return place;
}

std::string encode_pmtiles_directory(std::span<const PmtilesEntry> entries) {
  std::string bytes;
  ByteWriter<std::string> out(bytes);
  out.put_varint(entries.size());
  std::uint64_t last = 0;
  for (const PmtilesEntry& e : entries) {
    out.put_varint(e.number - last);
    last = e.number;
  }
  for (const PmtilesEntry& e : entries) out.put_varint(e.run);
  for (const PmtilesEntry& e : entries) out.put_varint(e.size);
  const PmtilesEntry* before = nullptr;
  for (const PmtilesEntry& e : entries) {
    const bool follows = before && before->at + before->size == e.at;
    out.put_varint(follows ? 0 : e.at + 1);
    before = &e;
  }
  return bytes;
}

Result<std::vector<PmtilesEntry>> decode_pmtiles_directory(std::span<const std::uint8_t> bytes) {
  const auto damaged = [] { return fail(Errc::bad_data, "a damaged directory of PMTiles"); };
  ByteReader in(bytes);
  const std::uint64_t count = in.get_varint(kLongestVarint);
  if (!in.good() || count > in.left() / 4) return damaged();  // four numbers each
  std::vector<PmtilesEntry> entries(count);
  std::uint64_t number = 0;
  for (PmtilesEntry& e : entries) {
    const std::uint64_t step = in.get_varint(kLongestVarint);
    if (step >= std::uint64_t(1) << 62 || (step == 0 && &e != &entries[0])) in.refuse();
    number += step;
    if (!in.good() || number >= std::uint64_t(1) << 62) return damaged();
    e.number = number;
  }
  for (PmtilesEntry& e : entries) e.run = std::uint32_t(in.get_varint(4));
  for (PmtilesEntry& e : entries) {
    e.size = std::uint32_t(in.get_varint(4));
    if (e.size == 0) in.refuse();
  }
  const PmtilesEntry* before = nullptr;
  for (PmtilesEntry& e : entries) {
    const std::uint64_t at = in.get_varint(kLongestVarint);
    if (at == 0 && !before) in.refuse();
    if (!in.good()) return damaged();
    e.at = at == 0 ? before->at + before->size : at - 1;
    if (e.at >= std::uint64_t(1) << 62) return damaged();
    before = &e;
  }
  if (!in.good() || in.left() > 0) return damaged();
  return entries;
}

PmtilesDirectories pmtiles_directories(std::span<const PmtilesEntry> entries) {
  constexpr std::size_t kRoom = kPmtilesFirstBytes - kPmtilesHeaderBytes;
  PmtilesDirectories d;
  // More than these cannot fit, and packing them would take long.
  if (entries.size() <= 4 * kRoom) d.root = packed(encode_pmtiles_directory(entries));
  if (!d.root.empty() && d.root.size() <= kRoom) return d;
  for (d.leaf_entries = kFirstLeafEntries;; d.leaf_entries *= 2) {
    d.leaves.clear();
    std::vector<PmtilesEntry> root;
    for (std::size_t at = 0; at < entries.size(); at += d.leaf_entries) {
      const auto part = entries.subspan(at, std::min(d.leaf_entries, entries.size() - at));
      const std::string leaf = packed(encode_pmtiles_directory(part));
      root.push_back({part[0].number, d.leaves.size(), std::uint32_t(leaf.size()), 0});
      d.leaves += leaf;
    }
    d.root = packed(encode_pmtiles_directory(root));
    if (d.root.size() <= kRoom) return d;
  }
}

}  // namespace tind::proto
