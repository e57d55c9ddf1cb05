#include "server/cli/options/dem_input.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "server/cli/program/exit.h"
#include "terrain/raster/dem_options_text.h"
#include "terrain/raster/nodata.h"

namespace tind::cli {

namespace {

/// A full mesh takes about 200 bytes a post, and its half-edges are numbered with 32 bits.
constexpr std::int64_t kMaxPosts = 400'000'000;

std::string flag_of(std::string name) {
  std::ranges::replace(name, '_', '-');
  return "--" + name;
}

}  // namespace

void add_dem_options(Command app, DemInput& input) {
  input.environment = app.environment();
  for (const DemOptionText& option : dem_option_texts()) {
    const std::string name = option.name, flag = flag_of(name);
    std::string help = option.help;
    if (name == "to_datum")
      help += input.to_datum == "same"
                  ? "; same without it"
                  : "; without it: ellipsoid, where it is known what they are above";
    app.add_function(
        flag,
        [&input, name, flag](const std::string& text) {
          if (const auto ok = set_dem_option(name, text, input.said); !ok)
            refuse_value(flag, ok.error().what);
          input.given.push_back(flag);
          if (name.ends_with("_datum")) input.datums.push_back(text);
          input.to_datum_given = input.to_datum_given || name == "to_datum";
        },
        help);
  }
  app.add_flag("--allow-vrt", input.allow_vrt, "read VRT files, which may name any other file");
}

Result<void> no_dem_options(const DemInput& input, const std::string& mesh) {
  if (input.given.empty()) return {};
  return fail(Errc::invalid_argument,
              fmt::format("{} is said of DEMs, and {} is a mesh", input.given.front(), mesh));
}

DemOptions dem_options(const DemInput& input) {
  DemOptions options = input.said;
  if (!input.to_datum_given && input.to_datum == "ellipsoid")
    options.to_datum = TargetDatum::ellipsoid_if_known;
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
