#include "terrain/raster/dem_options_text.h"

#include <array>
#include <cctype>
#include <charconv>
#include <cmath>
#include <iterator>
#include <string>
#include <system_error>
#include <utility>

#include "terrain/base/lower_case.h"
#include "terrain/raster/datums.h"
#include "terrain/raster/nodata.h"

namespace tind {
namespace {

Result<void> set_from_datum(std::string_view text, DemOptions& options) {
  auto datum = datum_named(text);
  if (!datum) return std::unexpected(datum.error());
  options.from_datum = std::move(*datum);
  return {};
}

Result<void> set_to_datum(std::string_view text, DemOptions& options) {
  if (lower_case(text) == "same") {
    options.to_datum = TargetDatum::same;
    return {};
  }
  auto datum = datum_named(text);
  if (!datum) return std::unexpected(datum.error());
  if (*datum == VerticalDatum::unknown)
    return fail(Errc::invalid_argument, "heights cannot be brought to what nobody knows; say same");
  options.to_datum = *datum == VerticalDatum::ellipsoid ? TargetDatum(TargetDatum::ellipsoid)
                                                        : TargetDatum(std::move(*datum));
  return {};
}

Result<void> set_crs(std::string_view text, DemOptions& options) {
  if (text.find_first_not_of(" \t") == text.npos)
    return fail(Errc::invalid_argument, "names no CRS; say EPSG:25832, or WKT");
  options.crs = text;
  return {};
}

Result<void> set_band(std::string_view text, DemOptions& options) {
  int band = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), band);
  if (error != std::errc() || end != text.data() + text.size() || band < 1)
    return fail(Errc::invalid_argument,
                "'" + std::string(text) + "' is no band; they count from 1");
  options.band = band;
  return {};
}

Result<void> set_encoding(std::string_view text, DemOptions& options) {
  auto encoding = parse_enum<HeightEncoding>(lower_case(text));
  if (!encoding) return std::unexpected(encoding.error());
  options.encoding = *encoding;
  return {};
}

Result<double> finite(std::string_view text) {
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size() || !std::isfinite(value))
    return fail(Errc::invalid_argument, "'" + std::string(text) + "' is not a number");
  return value;
}

Result<void> set_scale(std::string_view text, DemOptions& options) {
  const auto value = finite(text);
  if (!value) return std::unexpected(value.error());
  if (*value == 0) return fail(Errc::invalid_argument, "0 would make every height the same");
  options.scale = *value;
  return {};
}

Result<void> set_offset(std::string_view text, DemOptions& options) {
  const auto value = finite(text);
  if (!value) return std::unexpected(value.error());
  options.offset = *value;
  return {};
}

Result<void> set_accuracy(std::string_view text, DemOptions& options) {
  const std::size_t equals = text.find('=');
  VerticalAccuracy accuracy;
  if (equals != text.npos) {
    const auto kind = enum_named<AccuracyKind>(lower_case(text.substr(0, equals)));
    if (!kind || *kind == AccuracyKind::unspecified)
      return fail(Errc::invalid_argument,
                  "'" + std::string(text) + "' is no accuracy; say 4, le90=4, le95=5 or rmse=2.5");
    accuracy.kind = *kind;
    text.remove_prefix(equals + 1);
  }
  const auto metres = finite(text);
  if (!metres) return std::unexpected(metres.error());
  if (*metres < 0) return fail(Errc::invalid_argument, "an accuracy is not below 0");
  accuracy.metres = *metres;
  options.accuracy = accuracy;
  return {};
}

struct Row {
  DemOptionText text;
  Result<void> (*set)(std::string_view, DemOptions&);
};

constexpr Row kRows[] = {
    {{"from_datum",
      "what the heights are above, where the file does not say: ellipsoid, egm84, egm96, egm2008, "
      "a "
      "vertical CRS (EPSG:5703), a geoid file (.pgm, .gtx, .tif), unknown"},
     set_from_datum},
    {{"to_datum", "convert heights: to ellipsoid, or any other of these; same: not at all"},
     set_to_datum},
    {{"nodata",
      "values that mean no data, beside the one that the file declares: -9999 or -9999,-32768; "
      "none: the declared one is a height"},
     set_nodata},
    {{"crs",
      "what the coordinates are, whatever the file says: EPSG:25832, WKT or a PROJ string; what "
      "the file says of its heights stays, unless this names a vertical CRS, too"},
     set_crs},
    {{"band", "which band has the heights, from 1; with colours, the first of the three"},
     set_band},
    {{"encoding",
      "heights are colours (terrain-RGB): mapbox or terrarium; number: they are not. Black and "
      "what is transparent mean no data"},
     set_encoding},
    {{"scale", "height = number * scale + offset, instead of the file's scale"}, set_scale},
    {{"offset", "height = number * scale + offset, instead of the file's offset"}, set_offset},
    {{"accuracy",
      "how good its maker says that the heights are, metres: 4, le90=4, le95=5 or rmse=2.5; every "
      "answer with a height repeats it"},
     set_accuracy},
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
