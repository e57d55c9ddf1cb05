#include "terrain/raster/dem_options_text.h"

#include <array>
#include <iterator>
#include <string>

#include "terrain/raster/nodata.h"

namespace tind {
namespace {

std::unexpected<Error> none_of(std::string_view text, const char* values) {
  return fail(Errc::invalid_argument, "'" + std::string(text) + "' is not one of " + values);
}

Result<void> set_from_datum(std::string_view text, DemOptions& options) {
  for (const VerticalDatum datum :
       {VerticalDatum::unknown, VerticalDatum::egm96, VerticalDatum::ellipsoid})
    if (text == name(datum)) {
      options.from_datum = datum;
      return {};
    }
  return none_of(text, "egm96, ellipsoid, unknown");
}

Result<void> set_to_datum(std::string_view text, DemOptions& options) {
  if (text != "ellipsoid" && text != "same") return none_of(text, "ellipsoid, same");
  options.to_datum = text == "same" ? TargetDatum::same : TargetDatum::ellipsoid;
  return {};
}

struct Row {
  DemOptionText text;
  Result<void> (*set)(std::string_view, DemOptions&);
};

constexpr Row kRows[] = {
    {{"from_datum",
      "what the heights are above, where the file does not say: egm96, ellipsoid, unknown"},
     set_from_datum},
    {{"to_datum", "convert heights: ellipsoid, or same (not at all)"}, set_to_datum},
    {{"nodata",
      "values that mean no data, beside the one that the file declares: -9999 or -9999,-32768; "
      "none: the declared one is a height"},
     set_nodata},
};

}  // namespace

std::span<const DemOptionText> dem_option_texts() {
  static const auto texts = [] {
    std::array<DemOptionText, std::size(kRows)> all{};
    for (std::size_t i = 0; i < all.size(); ++i) all[i] = kRows[i].text;
    return all;
  }();
  return texts;
}

Result<void> set_dem_option(std::string_view name, std::string_view text, DemOptions& options) {
  for (const Row& row : kRows)
    if (name == row.text.name) return row.set(text, options);
  return fail(Errc::not_found, "a DEM has no option '" + std::string(name) + "'");
}

}  // namespace tind
