#pragma once
// The options of a DEM by name and text: what a command line, a configuration file and a catalog
// say of it are the same words with the same meaning and the same complaints.

#include <span>
#include <string_view>

#include "terrain/base/result.h"
#include "terrain/raster/dem_source.h"

namespace tind {

struct DemOptionText {
  const char* name;  // as in a configuration file, "from_datum"; on a command line "--from-datum"
  const char* help;  // what it says and which values there are, without the name
};

/// Every option that has a text, in the order in which help shows them.
std::span<const DemOptionText> dem_option_texts();

/// Sets the option of that name. invalid_argument says what is wrong with the text, without the
/// name; not_found: there is no such option. What only the file can tell (that it has this band,
/// that PROJ knows this CRS) is said by DemSource::open.
Result<void> set_dem_option(std::string_view name, std::string_view text, DemOptions&);

}  // namespace tind
