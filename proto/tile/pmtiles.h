#pragma once
// PMTiles 3 (github.com/protomaps/PMTiles, spec/v3): an archive of tiles in one file, to be read by
// ranges. A header of 127 bytes, directories (a root, and leaves that it names), metadata, tiles.
// Tiles are numbered zoom by zoom along a Hilbert curve.

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "terrain/base/result.h"

namespace tind::proto {

inline constexpr std::size_t kPmtilesHeaderBytes = 127;
inline constexpr std::size_t kPmtilesFirstBytes = 16384;  // header and root lie in them
inline constexpr int kPmtilesDeepest = 28;                // zoom; the format would allow more

enum class PmtilesPacking : std::uint8_t { unknown = 0, none = 1, gzip = 2, brotli = 3, zstd = 4 };

struct PmtilesSection {
  std::uint64_t at = 0, size = 0;  // from the beginning of the file
  std::uint64_t end() const { return at + size; }
  friend bool operator==(const PmtilesSection&, const PmtilesSection&) = default;
};

struct PmtilesHeader {
  PmtilesSection root, metadata, leaves, tiles;
  std::uint64_t addressed = 0, entries = 0, contents = 0;  // 0: not known
  bool clustered = false;                                  // tiles lie in the order of numbers
  PmtilesPacking directories_are = PmtilesPacking::gzip, tiles_are = PmtilesPacking::gzip;
  std::uint8_t tile_type = 0;  // 0: none of those that the format knows
  std::uint8_t min_zoom = 0, max_zoom = 0, centre_zoom = 0;
  // Degrees times 10^7.
  std::int32_t west = 0, south = 0, east = 0, north = 0, centre_lon = 0, centre_lat = 0;
  friend bool operator==(const PmtilesHeader&, const PmtilesHeader&) = default;
};

std::string encode_pmtiles_header(const PmtilesHeader&);
/// bad_data, or unsupported for another version. GUARANTEES: sections end without overflow.
Result<PmtilesHeader> decode_pmtiles_header(std::span<const std::uint8_t>);

/// Rows from the north.
struct PmtilesPlace {
  int zoom = 0;
  std::uint32_t x = 0, y = 0;
  friend bool operator==(const PmtilesPlace&, const PmtilesPlace&) = default;
};
/// REQUIRES: 0 <= zoom <= kPmtilesDeepest, x and y below 2^zoom.
std::uint64_t pmtiles_number(const PmtilesPlace&);
/// Nothing for numbers deeper than kPmtilesDeepest.
std::optional<PmtilesPlace> pmtiles_place(std::uint64_t number);

/// A tile; or, where run is 0, a leaf, whose first tile has this number.
struct PmtilesEntry {
  std::uint64_t number = 0;
  std::uint64_t at = 0;  // in the section of tiles, or of leaves
  std::uint32_t size = 0, run = 1;
  friend bool operator==(const PmtilesEntry&, const PmtilesEntry&) = default;
};

/// Not packed.
std::string encode_pmtiles_directory(std::span<const PmtilesEntry>);
/// bad_data unless numbers ascend and every entry has bytes.
Result<std::vector<PmtilesEntry>> decode_pmtiles_directory(std::span<const std::uint8_t>);

/// Both packed with gzip.
struct PmtilesDirectories {
  std::string root, leaves;
  std::size_t leaf_entries = 0;  // of each leaf but the last; 0: the root names the tiles itself
};
/// Of tiles in ascending order: a root that fits behind the header; else leaves of 4096 entries,
/// or that doubled, as often as the root needs it.
PmtilesDirectories pmtiles_directories(std::span<const PmtilesEntry>);

}  // namespace tind::proto
