// GeographicLib's grids are looked for first where a model is named, since its files say what they
// are; PROJ is asked where they are missing, and for everything that is a CRS.

#include "terrain/raster/datums.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <functional>
#include <iterator>
#include <list>
#include <mutex>
#include <utility>

#include "terrain/base/lower_case.h"
#include "terrain/geo/geoid_grids.h"
#include "terrain/raster/file_state.h"
#include "terrain/raster/gdal/crs/proj_datum.h"

namespace tind {
namespace {

namespace fs = std::filesystem;
using Surface = std::shared_ptr<const DatumSurface>;

struct Model {
  VerticalDatum::Kind kind;
  const char *name, *crs;
  std::vector<std::string> grids;  // finest first
};

const std::vector<Model>& models() {
  static const std::vector<Model> all = {
      {VerticalDatum::egm84, "egm84", "EPSG:5798", {"egm84-15", "egm84-30"}},
      {VerticalDatum::egm96, "egm96", "EPSG:5773", {"egm96-5", "egm96-15"}},
      {VerticalDatum::egm2008, "egm2008", "EPSG:3855", {"egm2008-1", "egm2008-2_5", "egm2008-5"}}};
  return all;
}

const Model* model_of(const VerticalDatum& datum) {
  const auto found = std::ranges::find(models(), datum.kind(), &Model::kind);
  return found == models().end() ? nullptr : &*found;
}

std::string ending(std::string_view text) {
  return lower_case(text.substr(std::min(text.rfind('.'), text.size())));
}

/// One of GeographicLib's grids, or EGM96 as it comes along.
class GeoidSurface final : public DatumSurface {
 public:
  GeoidSurface(std::shared_ptr<const Geoid> geoid, std::string way, std::string identity)
      : geoid_(std::move(geoid)) {
    way_ = std::move(way);
    identity_ = std::move(identity);
  }
  void undulations(std::span<const Geographic> in, std::span<double> out) const override {
    for (std::size_t i = 0; i < in.size(); ++i)
      out[i] = std::abs(in[i].lat) <= 90 ? geoid_->undulation(in[i]) : std::nan("");
  }

 private:
  std::shared_ptr<const Geoid> geoid_;
};

/// The surfaces that were asked for last, for the whole process: each is read once.
class Kept {
 public:
  Result<Surface> get(const std::string& key, const std::function<Result<Surface>()>& make) {
    if (Surface there = find(key)) return there;
    // Who needs the same waits; who needs another does not.
    const std::lock_guard one_at_a_time(making_[std::hash<std::string>()(key) % making_.size()]);
    if (Surface there = find(key)) return there;
    auto made = make();
    if (!made) return made;
    const std::lock_guard lock(mutex_);
    kept_.emplace_front(key, *made);
    if (kept_.size() > kMost) kept_.pop_back();
    return made;
  }

 private:
  static constexpr std::size_t kMost = 16;

  Surface find(const std::string& key) {
    const std::lock_guard lock(mutex_);
    const auto found = std::ranges::find(kept_, key, &std::pair<std::string, Surface>::first);
    if (found == kept_.end()) return nullptr;
    kept_.splice(kept_.begin(), kept_, found);
    return kept_.front().second;
  }

  std::array<std::mutex, 31> making_;
  std::mutex mutex_;
  std::list<std::pair<std::string, Surface>> kept_;  // used last, first
};

/// Apart, so that many small ones never push out a grid of half a gigabyte.
Kept& kept_grids() {
  static Kept all;
  return all;
}
Kept& kept_ways() {
  static Kept all;
  return all;
}

Result<Surface> pgm_surface(const std::string& folder, const std::string& name) {
  const std::string path = folder + "/" + name + ".pgm";
  const auto state = file_state(path);
  if (!state) return std::unexpected(state.error());
  const std::string identity = fmt::format("{} {} {}", name, state->size, state->written_ns);
  return kept_grids().get(path + " " + identity, [&]() -> Result<Surface> {
    auto geoid = cubic_geoid(folder, name);
    if (!geoid) return std::unexpected(geoid.error());
    return std::make_shared<const GeoidSurface>(*geoid, name + ".pgm, cubic", identity);
  });
}

Result<Surface> file_surface(const std::string& path) {
  if (ending(path) != ".pgm") return gdal::grid_surface(path);
  const fs::path file = fs::absolute(path);
  return pgm_surface(file.parent_path().string(), file.stem().string());
}

/// The EGM96 that comes along: bilinear, as PROJ does; the bytes of tiles go by it.
Result<Surface> bundled_egm96(const Environment& environment) {
  auto geoid = environment.egm96();
  if (!geoid) return std::unexpected(geoid.error());
  return std::make_shared<const GeoidSurface>(*geoid, "egm96-15.pgm, bilinear", "");
}

Result<Surface> model_surface(const Model& model, const std::string& grid, const GeoRect& area,
                              const Environment& environment) {
  if (grid.empty() && model.kind == VerticalDatum::egm96) return bundled_egm96(environment);
  const auto names = grid.empty() ? model.grids : std::vector{grid};
  const auto folders = geoid_folders(environment.data_dir() + "/geoids");
  for (const std::string& name : names) {
    const auto folder = folder_of_geoid(name, folders);
    if (!folder) return std::unexpected(folder.error());
    if (!folder->empty()) return pgm_surface(*folder, name);
  }
  const std::string what = fmt::format(
      "the grid {}.pgm (looked in {}; geographiclib-get-geoids of the Debian package "
      "geographiclib-tools fetches it)",
      fmt::join(names, ".pgm or "), fmt::join(folders, ", "));
  if (!grid.empty()) return fail(Errc::not_found, what + " is missing");
  auto proj = gdal::proj_surface(model.crs, area, "");
  if (proj || proj.error().code != Errc::not_found) return proj;
  return fail(Errc::not_found,
              fmt::format("{} takes {}; or PROJ: {}", model.name, what, proj.error().what));
}

}  // namespace

bool names_geoid_file(std::string_view text) {
  const std::string end = ending(text);
  return end == ".pgm" || end == ".gtx" || end == ".tif" || end == ".tiff";
}

Result<VerticalDatum> datum_named(std::string_view given) {
  if (names_geoid_file(given)) {
    std::error_code error;
    if (!fs::is_regular_file(given, error))
      return fail(Errc::not_found, "there is no geoid file " + std::string(given));
    return VerticalDatum(VerticalDatum::file, std::string(given));
  }
  std::string text = lower_case(given);
  if (text == "unknown") return VerticalDatum(VerticalDatum::unknown);
  if (text == "ellipsoid") return VerticalDatum(VerticalDatum::ellipsoid);
  for (const Model& model : models()) {
    if (text == model.name) return VerticalDatum(model.kind);
    if (std::ranges::find(model.grids, text) != model.grids.end())
      return VerticalDatum(model.kind, text);
  }
  text = given;
  const auto crs = text.empty() || text.size() > 100 ? fail(Errc::invalid_argument, "")
                                                     : gdal::vertical_crs(text);
  if (!crs && !crs.error().what.empty() && text.find(':') != text.npos)
    return std::unexpected(crs.error());
  if (!crs)
    return fail(Errc::invalid_argument,
                "'" + text +
                    "' is no datum: say ellipsoid, egm84, egm96, egm2008, a vertical CRS "
                    "(EPSG:5703) or a geoid file (.pgm, .gtx, .tif)");
  if (crs->ellipsoidal) return VerticalDatum(VerticalDatum::ellipsoid);
  for (const Model& model : models())
    if (crs->text == model.crs) return VerticalDatum(model.kind);
  return VerticalDatum(VerticalDatum::crs, crs->text);
}

double unit_of(const VerticalDatum& datum) {
  if (datum.kind() != VerticalDatum::crs) return 1;
  const auto crs = gdal::vertical_crs(datum.text());
  return crs ? crs->unit_m : 1;
}

Result<Surface> datum_surface(const VerticalDatum& datum, const GeoRect& area,
                              const std::string& crs_wkt, const Environment& environment) {
  if (const Model* model = model_of(datum))
    return model_surface(*model, datum.text(), area, environment);
  switch (datum.kind()) {
    case VerticalDatum::crs:
      return kept_ways().get(fmt::format("{} {} {} {} {} {}", datum.text(), area.west, area.south,
                                         area.east, area.north, crs_wkt),
                             [&] { return gdal::proj_surface(datum.text(), area, crs_wkt); });
    case VerticalDatum::file:
      return file_surface(datum.text());
    default:
      return Surface();
  }
}

}  // namespace tind
