// PROJ falls back to "ballpark" ways, which leave heights as they are, where a grid is missing. So
// the ways are listed without them, and one is taken only when all of its grids are there. A way
// starts from a system of places and heights, whose numbers for places it is given: so that system
// has to have degrees from Greenwich, whatever the heights were named with.

#include "terrain/raster/gdal/crs/proj_datum.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <proj.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <string_view>
#include <utility>
#include <vector>

#include "terrain/raster/file_state.h"
#include "terrain/raster/gdal/crs/proj_files.h"
#include "terrain/raster/gdal/crs/proj_operation.h"
#include "terrain/raster/offset_grid.h"

namespace tind::gdal {
namespace {

namespace fs = std::filesystem;

struct Destroy {
  void operator()(PJ* pj) const { proj_destroy(pj); }
  void operator()(PJ_OBJ_LIST* list) const { proj_list_destroy(list); }
  void operator()(PJ_OPERATION_FACTORY_CONTEXT* context) const {
    proj_operation_factory_context_destroy(context);
  }
};
using Pj = std::unique_ptr<PJ, Destroy>;

class ProjSurface final : public DatumSurface {
 public:
  struct Facts {
    std::string way, identity, warning;
    double accuracy_m = -1;
  };
  ProjSurface(std::unique_ptr<Operation> operation, Facts facts)
      : operations_(std::move(operation)) {
    way_ = std::move(facts.way);
    identity_ = std::move(facts.identity);
    warning_ = std::move(facts.warning);
    accuracy_m_ = facts.accuracy_m;
  }

  void undulations(std::span<const Geographic> in, std::span<double> out) const override {
    std::vector<Vec2> points(in.size());
    for (std::size_t i = 0; i < in.size(); ++i) points[i] = {in[i].lon, in[i].lat};
    std::ranges::fill(out, 0.0);
    operations_.run(true, points, out);
  }

 private:
  Operations operations_;
};

/// The vertical CRS in one: itself, or the part of a compound one.
Pj vertical_part(PJ_CONTEXT* context, const PJ* crs) {
  switch (proj_get_type(crs)) {
    case PJ_TYPE_VERTICAL_CRS:
      return Pj(proj_clone(context, crs));
    case PJ_TYPE_COMPOUND_CRS: {
      Pj part(proj_crs_get_sub_crs(context, crs, 1));
      return part && proj_get_type(part.get()) == PJ_TYPE_VERTICAL_CRS ? std::move(part) : nullptr;
    }
    default:
      return nullptr;
  }
}

std::string code_of(const PJ* crs) {
  const char *authority = proj_get_id_auth_name(crs, 0), *code = proj_get_id_code(crs, 0);
  return authority && code ? std::string(authority) + ":" + code : std::string();
}

struct Grid {
  std::string name, url;
  bool there = false;
};

std::vector<Grid> grids_of(PJ_CONTEXT* context, const PJ* way) {
  std::vector<Grid> grids;
  for (int i = 0; i < proj_coordoperation_get_grid_used_count(context, way); ++i) {
    const char *name = nullptr, *full = nullptr, *package = nullptr, *url = nullptr;
    int direct = 0, open = 0, there = 0;
    if (proj_coordoperation_get_grid_used(context, way, i, &name, &full, &package, &url, &direct,
                                          &open, &there))
      grids.push_back({name ? name : "", url ? url : "", there != 0});
  }
  return grids;
}

std::string text_of(const Grid& grid) {
  return grid.url.empty() ? grid.name : grid.name + " (" + grid.url + ")";
}

/// PROJ's ways from places and heights in `from` to WGS84, best first, those without their grids,
/// too.
std::unique_ptr<PJ_OBJ_LIST, Destroy> ways_of(PJ_CONTEXT* context, const PJ* from,
                                              const GeoRect& area) {
  const Pj to(proj_create(context, "EPSG:4979"));
  const std::unique_ptr<PJ_OPERATION_FACTORY_CONTEXT, Destroy> choice(
      proj_create_operation_factory_context(context, nullptr));
  if (!from || !to || !choice) return nullptr;
  proj_operation_factory_context_set_area_of_interest(context, choice.get(), area.west, area.south,
                                                      area.east, area.north);
  proj_operation_factory_context_set_spatial_criterion(context, choice.get(),
                                                       PROJ_SPATIAL_CRITERION_PARTIAL_INTERSECTION);
  proj_operation_factory_context_set_grid_availability_use(context, choice.get(),
                                                           PROJ_GRID_AVAILABILITY_IGNORED);
  proj_operation_factory_context_set_allow_ballpark_transformations(context, choice.get(), 0);
  return std::unique_ptr<PJ_OBJ_LIST, Destroy>(
      proj_create_operations(context, from, to.get(), choice.get()));
}

/// Does it lead to the north or the east, in degrees?
bool is_in_degrees(PJ_CONTEXT* context, const PJ* axes, int axis) {
  const char* to = nullptr;
  double unit_rad = 0;
  if (!proj_cs_get_axis_info(context, axes, axis, nullptr, nullptr, &to, &unit_rad, nullptr,
                             nullptr, nullptr))
    return false;
  const std::string_view way = to ? to : "";
  return std::abs(unit_rad - M_PI / 180) < 1e-12 && (way == "north" || way == "east");
}

/// Are its places longitudes and latitudes in degrees from Greenwich?
bool has_degrees_from_greenwich(PJ_CONTEXT* context, const PJ* crs) {
  if (!crs || proj_get_type(crs) != PJ_TYPE_GEOGRAPHIC_2D_CRS) return false;
  const Pj meridian(proj_get_prime_meridian(context, crs));
  const Pj axes(proj_crs_get_coordinate_system(context, crs));
  double longitude = -1;
  return meridian && axes &&
         proj_prime_meridian_get_parameters(context, meridian.get(), &longitude, nullptr,
                                            nullptr) &&
         longitude == 0 && is_in_degrees(context, axes.get(), 0) &&
         is_in_degrees(context, axes.get(), 1);
}

/// The code of the geographic system that a CRS is based on; empty where its places are others.
std::string base_of(PJ_CONTEXT* context, const PJ* crs) {
  const Pj stated(crs ? proj_crs_get_geodetic_crs(context, crs) : nullptr);
  const std::string code = stated ? code_of(stated.get()) : std::string();
  const Pj base(code.empty() ? nullptr : proj_create(context, code.c_str()));
  return has_degrees_from_greenwich(context, base.get()) ? code : std::string();
}

/// The heights of `named` at places as undulations() gets them. On which system these are based may
/// decide between PROJ's ways: on that of a compound CRS, else on the DEM's. Where neither has such
/// places (grads from Paris), they are what they are: WGS84's.
Pj with_places(PJ_CONTEXT* context, const PJ* named, const std::string& crs_wkt) {
  const bool compound = proj_get_type(named) == PJ_TYPE_COMPOUND_CRS;
  if (const Pj own(compound ? proj_crs_get_sub_crs(context, named, 0) : nullptr);
      has_degrees_from_greenwich(context, own.get()))
    return Pj(proj_clone(context, named));
  const Pj heights = vertical_part(context, named);
  const std::string code = heights ? code_of(heights.get()) : std::string();
  if (code.empty()) return nullptr;
  std::string places = compound ? base_of(context, named) : std::string();
  if (places.empty()) {
    const Pj dem(crs_wkt.empty() ? nullptr : proj_create(context, crs_wkt.c_str()));
    places = base_of(context, dem.get());
    if (!places.starts_with("EPSG:")) places = "EPSG:4326";
  }
  return Pj(proj_create(context, (places + "+" + code).c_str()));
}

Error missing(const VerticalCrs& crs, const std::vector<Grid>& grids) {
  std::vector<std::string> names;
  for (const Grid& grid : grids)
    if (const std::string text = text_of(grid); std::ranges::find(names, text) == names.end())
      names.push_back(text);
  if (names.empty())
    return {Errc::unsupported, fmt::format("PROJ knows no way from {} ({}) to the ellipsoid there",
                                           crs.name, crs.text)};
  const bool one = names.size() == 1;
  return {
      Errc::not_found,
      fmt::format(
          "from {} ({}) to the ellipsoid takes {}, which PROJ does not have: put {} into "
          "{} (projsync fetches it; in Debian some are in proj-data)",
          crs.name, crs.text,
          one ? "the grid " + names[0] : fmt::format("one of the grids {}", fmt::join(names, ", ")),
          one ? "it" : "one", proj_folders())};
}

}  // namespace

std::string proj_folders() {
  const Operation one;
  const char* const user = proj_context_get_user_writable_directory(one.context, 0);
  const PJ_INFO info = proj_info();
  const std::string searched = info.searchpath ? info.searchpath : "";
  std::string first = searched.substr(searched.rfind(':') + 1);
  if (!user) return first;
  return first.empty() || first == user ? user : std::string(user) + " or " + first;
}

bool is_wgs84_or_grs80(double semi_major_m, double inverse_flattening) {
  // (1e-5 of the flattening's inverse is 0.7 mm at the poles.)
  return std::abs(semi_major_m - 6378137) < 5e-4 &&
         (std::abs(inverse_flattening - 298.257223563) < 1e-5 ||
          std::abs(inverse_flattening - 298.257222101) < 1e-5);
}

namespace {

/// Has it heights above its own ellipsoid?
bool is_3d(PJ_CONTEXT* context, const PJ* crs) {
  const PJ_TYPE type = proj_get_type(crs);
  if (type != PJ_TYPE_PROJECTED_CRS) return type == PJ_TYPE_GEOGRAPHIC_3D_CRS;
  const Pj axes(proj_crs_get_coordinate_system(context, crs));
  return axes && proj_cs_get_axis_count(context, axes.get()) == 3;
}

/// Metres per unit of the axis that has the heights. `who`: for messages.
Result<double> unit_upwards(PJ_CONTEXT* context, const PJ* crs, int axis, const std::string& who) {
  double unit_m = 1;
  const char* direction = nullptr;
  const Pj axes(proj_crs_get_coordinate_system(context, crs));
  if (axes)
    proj_cs_get_axis_info(context, axes.get(), axis, nullptr, nullptr, &direction, &unit_m, nullptr,
                          nullptr, nullptr);
  if (direction && std::string(direction) != "up")
    return fail(Errc::invalid_argument,
                who + " counts downwards; say --scale -1 and the height that it belongs to");
  return unit_m;
}

/// That heights of a 3D CRS are what `ellipsoid` says: metres above WGS84's.
Result<void> is_above_wgs84(PJ_CONTEXT* context, const PJ* crs, const std::string& who) {
  double semi_major = 0, inverse_flattening = 0;
  const Pj ellipsoid(proj_get_ellipsoid(context, crs));
  if (ellipsoid)
    proj_ellipsoid_get_parameters(context, ellipsoid.get(), &semi_major, nullptr, nullptr,
                                  &inverse_flattening);
  if (!is_wgs84_or_grs80(semi_major, inverse_flattening))
    return fail(
        Errc::unsupported,
        "heights of " + who + " are above another ellipsoid than WGS84's, and are not converted");
  const auto unit_m = unit_upwards(context, crs, 2, who);
  if (!unit_m) return std::unexpected(unit_m.error());
  if (*unit_m != 1)
    return fail(Errc::unsupported,
                fmt::format("heights of {} are above the ellipsoid in units of {:.10g} m; say "
                            "ellipsoid, and --scale {:.10g} where the DEM does not name its unit",
                            who, *unit_m, *unit_m));
  return {};
}

}  // namespace

Result<VerticalCrs> vertical_crs(const std::string& text) {
  const OperatorNamesGrids operator_names_them;
  const Operation one;
  const Pj crs(proj_create(one.context, text.c_str()));
  if (!crs || !proj_is_crs(crs.get()))
    return fail(Errc::invalid_argument, "PROJ knows no CRS '" + text + "'");
  const auto name_of = [&](const PJ* of, const std::string& none) {
    const char* const name = proj_get_name(of);
    return name ? name : none;
  };
  VerticalCrs found;
  if (is_3d(one.context, crs.get())) {
    found.name = name_of(crs.get(), text);
    if (auto ok = is_above_wgs84(one.context, crs.get(), "'" + text + "' (" + found.name + ")");
        !ok)
      return std::unexpected(ok.error());
    found.ellipsoidal = true;
    return found;
  }
  const Pj vertical = vertical_part(one.context, crs.get());
  if (!vertical)
    return fail(Errc::invalid_argument,
                "'" + text + "' (" + name_of(crs.get(), "unnamed") + ") says nothing of heights");
  found.name = name_of(vertical.get(), text);
  found.text = code_of(crs.get());
  if (found.text.empty()) found.text = text;
  const auto unit_m =
      unit_upwards(one.context, vertical.get(), 0, "'" + text + "' (" + found.name + ")");
  if (!unit_m) return std::unexpected(unit_m.error());
  found.unit_m = *unit_m;
  return found;
}

namespace {

Result<std::shared_ptr<const DatumSurface>> surface_of(const std::string& text, const GeoRect& area,
                                                       const std::string& crs_wkt) {
  const auto crs = vertical_crs(text);
  if (!crs) return std::unexpected(crs.error());
  auto one = std::make_unique<Operation>();
  const Pj named(proj_create(one->context, crs->text.c_str()));
  const Pj from(named ? with_places(one->context, named.get(), crs_wkt) : nullptr);
  const auto ways = ways_of(one->context, from.get(), area);
  std::vector<Grid> lacking;
  for (int i = 0; ways && i < proj_list_get_count(ways.get()); ++i) {
    Pj way(proj_list_get(one->context, ways.get(), i));
    const std::vector<Grid> grids = grids_of(one->context, way.get());
    bool whole = true;
    for (const Grid& grid : grids)
      if (!grid.there) lacking.push_back(grid), whole = false;
    if (!whole || !proj_coordoperation_is_instantiable(one->context, way.get())) continue;
    one->pj = proj_normalize_for_visualization(one->context, way.get());
    if (!one->pj) continue;
    ProjSurface::Facts facts;
    facts.accuracy_m = proj_coordoperation_get_accuracy(one->context, way.get());
    for (const Grid& grid : grids) facts.way += grid.name + ", ";
    facts.way = "PROJ: " + facts.way + "bilinear";
    const char* steps = proj_as_proj_string(one->context, one->pj, PJ_PROJ_5, nullptr);
    facts.identity = std::string(proj_info().release) + " " + (steps ? steps : "");
    if (!lacking.empty())
      facts.warning = fmt::format(
          "heights above {} are converted with {}, since PROJ's first choice, "
          "{}, is not there",
          crs->name, facts.way, text_of(lacking[0]));
    return std::make_shared<const ProjSurface>(std::move(one), std::move(facts));
  }
  return std::unexpected(missing(*crs, lacking));
}

Result<std::shared_ptr<const DatumSurface>> surface_of_grid(const std::string& path) {
  const auto state = file_state(path);
  if (!state) return std::unexpected(state.error());
  const fs::path file = fs::absolute(path);
  const std::string name = file.filename().string();
  if (name.find_first_of(" ,\t\"'@+=") != name.npos)
    return fail(Errc::invalid_argument,
                path + ": PROJ cannot take a grid with such a name; rename it");
  if (auto ok = may_be_geoid(path); !ok) return std::unexpected(ok.error());
  auto one = std::make_unique<Operation>(file.parent_path().string());
  const std::string steps =
      "+proj=pipeline +step +proj=unitconvert +xy_in=deg +xy_out=rad +step +proj=vgridshift "
      "+grids=" +
      name + " +multiplier=1 +step +proj=unitconvert +xy_in=rad +xy_out=deg";
  one->pj = proj_create(one->context, steps.c_str());
  if (!one->pj)
    return fail(Errc::bad_data, path + ": is no grid of a geoid that PROJ reads (.gtx, .tif)");
  return std::make_shared<const ProjSurface>(
      std::move(one),
      ProjSurface::Facts{name + ", bilinear",
                         fmt::format("{} {} {}", name, state->size, state->written_ns), "", -1});
}

}  // namespace

Result<std::shared_ptr<const DatumSurface>> proj_surface(const std::string& text,
                                                         const GeoRect& area,
                                                         const std::string& crs_wkt) {
  return if_all_is_read([&] { return surface_of(text, area, crs_wkt); });
}

Result<std::shared_ptr<const DatumSurface>> grid_surface(const std::string& path) {
  return if_all_is_read([&] { return surface_of_grid(path); });
}

}  // namespace tind::gdal
