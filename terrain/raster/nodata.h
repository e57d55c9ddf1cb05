#pragma once
// Which values of a raster mean that there is no height.

#include <string>
#include <string_view>

#include "terrain/base/result.h"
#include "terrain/raster/dem_source.h"

namespace tind {

/// What customarily means no data: the ends of 16-bit integers and rows of nines. (NaN, infinite
/// and about as large as 32 or 64 bits hold, +-1e38 to 3.5e38 and beyond 1.7e308, are voids in any
/// case.)
inline constexpr double kCustomaryNodata[] = {-32768,  -32767, -9999, -99999,
                                              -999999, 32767,  65535, 99999};

/// Parses what users type: "-9999", "-9999,-32768", "none" (what the file declares is a height), or
/// both with a comma between. invalid_argument for anything else.
Result<void> set_nodata(std::string_view text, DemOptions&);
/// The same back: what set_nodata() takes; empty where nothing was said.
std::string nodata_text(const DemOptions&);

/// One line that names the values, how many posts have them and what to say, with what was said
/// already; empty where there are
/// none among the posts read so far.
std::string undeclared_nodata_text(const DemSource&);

}  // namespace tind
