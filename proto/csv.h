#pragma once
// Lines of CSV [RFC4180] that say where something is.

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "terrain/base/result.h"

namespace tind::csv {

/// The fields of a line; of quoted ones what stands between the quotes. 32 bytes a field and more,
/// so that a stranger's line of commas takes as many times its own size.
std::vector<std::string> fields_of(std::string_view line);

/// Does a quote of the line not end on it? Fields with line breaks are not read.
bool has_open_quote(std::string_view line);
inline constexpr const char* kOpenQuote =
    "has a quote that does not end: fields with line breaks are not read";
/// As a field: in quotes where it has to be.
std::string field(std::string_view text);

/// A finite number, with blanks around it; nothing: it is none.
std::optional<double> number(std::string_view field);

/// What a line has of a place; nothing where that is no number, or not there.
struct PlaceFields {
  std::optional<double> x, y;
  std::size_t count = 0;  // of all fields of the line
};

/// In which columns x and y are: lon and lat, longitude and latitude, x and y, easting and
/// northing, in any case.
struct PlaceColumns {
  std::size_t x = 0, y = 0;
  std::size_t count = 0;  // of all columns

  /// By a head line. Where it names several pairs, lon and lat count with `degrees`; without, x and
  /// y, else easting and northing, else e and n. Fails (bad_data, in words to go on after "the
  /// first line") where it names no pair, where it names one of that pair's again ("lon,lat,lon"),
  /// and where it has half of another pair ("x,y,lon"): who wrote it meant one of them. An e or an
  /// n that is not needed may be anything.
  static Result<PlaceColumns> in(std::string_view head, bool degrees);

  /// Keeps no fields: a line takes no more memory than it is long.
  PlaceFields of(std::string_view line) const;
};
inline constexpr const char* kPlaceColumns = "lon and lat (or x and y, easting and northing)";

/// A line is made as wide as its head line, so that what is put behind it comes into its own
/// column: fields that it lacks are empty. Not one that has more.
inline constexpr const char* kTooWide = "has more fields than the first line";

/// Why columns of these names ("height_m,coverage") cannot be put beside those of a head line;
/// empty: they can. A reader by name would take one of two for the other.
std::string why_no_columns(std::string_view head, std::string_view names);

}  // namespace tind::csv
