#include "server/cli/dem_input.h"

#include <fmt/format.h>

namespace tind::cli {

namespace {

/// A full mesh takes about 200 bytes a post, and its half-edges are numbered with 32 bits.
constexpr std::int64_t kMaxPosts = 400'000'000;

}  // namespace

void add_dem_options(CLI::App& app, DemInput& input) {
  app.add_option(
         "--from-datum", input.from_datum,
         "what the heights are above, where the file does not say: egm96, ellipsoid, unknown")
      ->check(CLI::IsMember({"egm96", "ellipsoid", "unknown"}))
      ->capture_default_str();
  app.add_option("--to-datum", input.to_datum, "convert heights: ellipsoid, or same (not at all)")
      ->check(CLI::IsMember({"ellipsoid", "same"}))
      ->capture_default_str();
  app.add_flag("--allow-vrt", input.allow_vrt, "read VRT files, which may name any other file");
}

DemOptions dem_options(const DemInput& input) {
  DemOptions options;
  if (input.from_datum == "egm96") options.from_datum = VerticalDatum::egm96;
  if (input.from_datum == "ellipsoid") options.from_datum = VerticalDatum::ellipsoid;
  if (input.to_datum == "ellipsoid") options.to_datum = TargetDatum::ellipsoid;
  options.allow_vrt = input.allow_vrt;
  return options;
}

Result<std::shared_ptr<const DemSource>> open_dem(const DemInput& input) {
  return DemSource::open(input.files, dem_options(input));
}

Result<HeightGrid> read_all(const DemSource& dem) {
  const DemInfo& info = dem.info();
  if (info.cols > kMaxPosts / std::max<std::int64_t>(info.rows, 1)) {
    return fail(Errc::out_of_range,
                fmt::format("{} x {} posts are too many for one mesh (at most {} million); "
                            "use 'tind build', which works tile by tile",
                            info.cols, info.rows, kMaxPosts / 1'000'000));
  }
  return dem.read(0, 0, int(info.cols), int(info.rows));
}

}  // namespace tind::cli
