#pragma once
// FlightGear's buckets: which rectangles of the globe its scenery is cut into, and what they are
// called. As SGBucket of SimGear 2020.3 has it.

#include <compare>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "terrain/geo/coordinates.h"

namespace tind::flightgear {

/// Rows of buckets, an eighth of a degree each, from the south pole.
inline constexpr int kRows = 1440;

/// How wide the buckets of a row are, in eighths of a degree: 1 at the equator, 96 at the poles.
/// Borders of a row's buckets are borders of the narrower ones beside it, too.
int width_of_row(int row);

struct BucketId {
  int row = 0;
  int eighths = 0;  // of a degree, of its western border from -180: a multiple of its width
  friend auto operator<=>(const BucketId&, const BucketId&) = default;
};

/// REQUIRES: -180 <= lon < 180, -90 <= lat < 90.
BucketId bucket_at(Geographic);
/// All numbers in it are exact.
GeoRect rect(BucketId);

/// By which files are named.
std::uint32_t index_of(BucketId);
/// The only way from a number that somebody asks for; nothing where no bucket has it.
std::optional<BucketId> bucket_of(std::int64_t index);

/// A folder of the scenery: of a degree by a degree, by its corner in the southwest. A bucket that
/// is wider is in that of its western border.
struct Folder {
  int lon = 0, lat = 0;
  friend auto operator<=>(const Folder&, const Folder&) = default;
};
Folder folder_of(BucketId);
/// From the south, each row from the west.
std::vector<BucketId> buckets_in(Folder);

/// "e000n40/e006n45": that of ten degrees, and its own name.
std::string path_of(Folder);
/// The only way from such names; nothing where there is no such folder.
std::optional<Folder> folder_named(std::string_view of_ten, std::string_view of_one);

}  // namespace tind::flightgear
