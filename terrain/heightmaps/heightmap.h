#pragma once
// A map of heights as engines import it: 16 bits a post, and what a number means.

#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "terrain/base/enum_names.h"
#include "terrain/base/progress.h"
#include "terrain/base/result.h"
#include "terrain/heightmaps/map_place.h"
#include "terrain/surface/surface.h"

namespace tind {

struct HeightRange {
  double least_m = 0, most_m = 0;
};

struct Heightmap {
  MapPlace place;
  std::vector<std::uint16_t> values;  // rows from the north
  double zero_m = 0;                  // the height of 0
  double step_m = 1;                  // between two values
  HeightRange heights;                // of the posts, before they became values
  /// No value is farther from its post's height: half a step at most, and the rounding of heights
  /// to floats on the way.
  double max_error_m = 0;
  int samples = 1;  // as LatticeHeights has them
  double max_deviation_m = 0;
  double without_height = 0;  // share of posts that had none: they have the nearest post's

  double height_m(std::uint16_t value) const { return zero_m + value * step_m; }
};

/// 0 is the lowest post and 65535 the highest, or as `range` says: out_of_range where a post lies
/// beyond it. A step is at least 0.1 mm. A post without a height has that of the nearest that has
/// one, counted along rows and columns. bad_data where there is no height at all; else as
/// lattice_heights().
Result<Heightmap> make_heightmap(const Surface&, MapPlace, std::optional<HeightRange> range = {},
                                 int threads = 0, const Progress& = {});

enum class ByteOrder { little, big };
enum class FirstRow { north, south };
template <>
struct EnumNames<ByteOrder> {
  static constexpr const char* kWhat = "byte order";
  static constexpr std::pair<ByteOrder, const char*> kAll[] = {{ByteOrder::little, "little"},
                                                               {ByteOrder::big, "big"}};
};
template <>
struct EnumNames<FirstRow> {
  static constexpr const char* kWhat = "first row";
  static constexpr std::pair<FirstRow, const char*> kAll[] = {{FirstRow::north, "north"},
                                                              {FirstRow::south, "south"}};
};

/// Nothing but the numbers, row by row from the west.
std::string raw_of(const Heightmap&, ByteOrder, FirstRow);
/// Grey of 16 bits, the first row in the north, with zero and step as texts.
std::string png_of(const Heightmap&);

}  // namespace tind
