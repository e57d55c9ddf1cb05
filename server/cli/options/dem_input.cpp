#include "server/cli/options/dem_input.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "server/cli/program/exit.h"
#include "terrain/raster/nodata.h"

namespace tind::cli {

namespace {

/// A full mesh takes about 200 bytes a post, and its half-edges are numbered with 32 bits.
constexpr std::int64_t kMaxPosts = 400'000'000;

}  // namespace

void add_dem_options(Command app, DemInput& input) {
  input.environment = app.environment();
  app.add_option(
         "--from-datum", input.from_datum,
         "what the heights are above, where the file does not say: egm96, ellipsoid, unknown")
      .one_of({"egm96", "ellipsoid", "unknown"})
      .shown();
  const auto to_datum = [&input](const std::string& value) {
    input.to_datum = value;
    input.to_datum_given = true;
  };
  app.add_function(
         "--to-datum", to_datum,
         "convert heights: ellipsoid, or same (not at all)" +
             std::string(input.to_datum == "same"
                             ? "; same without it"
                             : "; without it: ellipsoid, where it is known what they are above"))
      .one_of({"ellipsoid", "same"});
  app.add_option("--nodata", input.nodata,
                 "values that mean no data, beside the one that the file declares: -9999 or "
                 "-9999,-32768; none: the declared one is a height")
      .expected(1)
      .check([](const std::string& value) {
        DemOptions options;
        const auto ok = set_nodata(value, options);
        return ok ? std::string() : ok.error().what;
      });
  app.add_flag("--allow-vrt", input.allow_vrt, "read VRT files, which may name any other file");
}

DemOptions dem_options(const DemInput& input) {
  DemOptions options;
  if (input.from_datum == "egm96") options.from_datum = VerticalDatum::egm96;
  if (input.from_datum == "ellipsoid") options.from_datum = VerticalDatum::ellipsoid;
  if (input.to_datum == "ellipsoid")
    options.to_datum =
        input.to_datum_given ? TargetDatum::ellipsoid : TargetDatum::ellipsoid_if_known;
  // Checked when it was parsed.
  if (!input.nodata.empty())
    (void)set_nodata(fmt::format("{}", fmt::join(input.nodata, ",")), options);
  options.allow_vrt = input.allow_vrt;
  options.environment = input.environment;
  return options;
}

Result<std::shared_ptr<const DemSource>> open_dem(const DemInput& input) {
  auto dem = DemSource::open(input.files, dem_options(input));
  if (dem) warn_of((*dem)->info());
  return dem;
}

int complain_of(const DemInput& input, const Error& error) {
  if (error.code != Errc::bad_data) return complain(error);
  return complain({error.code, fmt::format("{}: {}", fmt::join(input.files, ", "), error.what)});
}

void warn_of(const DemInfo& info) {
  for (const std::string& line : info.warnings) warn(line);
}

void warn_of_nodata(const DemSource& dem) {
  if (const std::string line = undeclared_nodata_text(dem); !line.empty()) warn(line);
}

Result<Terrain> read_all(const DemSource& dem) {
  const DemInfo& info = dem.info();
  if (info.cols > kMaxPosts / std::max<std::int64_t>(info.rows, 1)) {
    return fail(Errc::out_of_range,
                fmt::format("{} x {} posts are too many for one mesh (at most {} million); "
                            "use 'tind build', which works tile by tile",
                            info.cols, info.rows, kMaxPosts / 1'000'000));
  }
  auto all = dem.read(0, 0, int(info.cols), int(info.rows));
  if (!all) return std::unexpected(all.error());
  warn_of_nodata(dem);
  return terrain_of(std::move(*all), info);
}

}  // namespace tind::cli
