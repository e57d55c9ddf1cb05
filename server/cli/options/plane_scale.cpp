#include "server/cli/options/plane_scale.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "server/cli/program/exit.h"

namespace tind::cli {

namespace {

constexpr double kOff = 0.01;

bool is_off(double least, double greatest) { return greatest > 1 + kOff || least < 1 - kOff; }

/// "1.44", "1.41 to 1.44"
std::string range_text(double least, double greatest) {
  const std::string low = fmt::format("{:.3g}", least), high = fmt::format("{:.3g}", greatest);
  return low == high ? low : low + " to " + high;
}

}  // namespace

void warn_of_areas(const AreaScale& scale, const DemInfo& info) {
  if (!is_off(scale.least, scale.greatest)) return;
  warn(fmt::format(
      "areas and volumes are those in the plane of {}, {} times those on the ground; for these "
      "bring the DEM to its UTM zone, to degrees or to an equal-area projection (gdalwarp -t_srs)",
      info.crs_name, range_text(scale.least, scale.greatest)));
}

void warn_of_lengths(const LengthScale& scale, const DemInfo& info, const std::string& what) {
  if (!is_off(scale.least, scale.greatest)) return;
  warn(fmt::format(
      "{} those in the plane of {}, where lengths are {} times those on the ground; for those on "
      "the ground bring the DEM to its UTM zone or to degrees (gdalwarp -t_srs)",
      what, info.crs_name, range_text(scale.least, scale.greatest)));
}

void warn_of_directions(const LengthScale& scale, const DemInfo& info) {
  if (scale.uneven <= 1 + kOff) return;
  warn(fmt::format(
      "directions are those in the plane of {}, where lengths are up to {:.3g} times as long in "
      "one direction as in another; for those on the ground bring the DEM to its UTM zone or to "
      "degrees (gdalwarp -t_srs)",
      info.crs_name, scale.uneven));
}

nlohmann::ordered_json area_scale_json(const AreaScale& scale) {
  return {{"least", scale.least}, {"greatest", scale.greatest}};
}

nlohmann::ordered_json length_scale_json(const LengthScale& scale) {
  return {{"least", scale.least}, {"greatest", scale.greatest}, {"uneven", scale.uneven}};
}

}  // namespace tind::cli
