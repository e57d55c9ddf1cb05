// PROJ falls back to "ballpark" ways, which leave heights as they are, where a grid is missing. So
// the ways are listed without them, and one is taken only when all of its grids are there.

#include "terrain/raster/gdal/crs/proj_datum.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <proj.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
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

/// PROJ's ways from heights above `crs` to WGS84, best first, those without their grids, too.
std::unique_ptr<PJ_OBJ_LIST, Destroy> ways_of(PJ_CONTEXT* context, const std::string& source,
                                              const GeoRect& area) {
  const Pj from(proj_create(context, source.c_str())), to(proj_create(context, "EPSG:4979"));
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
      proj_create_operations(context, from.get(), to.get(), choice.get()));
}

/// The system that positions are in, with the heights' as its vertical part; "EPSG:4326+5703".
std::string with_positions(const std::string& vertical, const std::string& crs_wkt) {
  const Operation one;
  const Pj crs(proj_create(one.context, crs_wkt.empty() ? "EPSG:4326" : crs_wkt.c_str()));
  const Pj geographic(crs ? proj_crs_get_geodetic_crs(one.context, crs.get()) : nullptr);
  std::string code = geographic ? code_of(geographic.get()) : std::string();
  if (!code.starts_with("EPSG:")) code = "EPSG:4326";
  return code + "+" + vertical.substr(vertical.find(':') + 1);
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

Result<VerticalCrs> vertical_crs(const std::string& text) {
  const OperatorNamesGrids operator_names_them;
  const Operation one;
  const Pj crs(proj_create(one.context, text.c_str()));
  if (!crs || !proj_is_crs(crs.get()))
    return fail(Errc::invalid_argument, "PROJ knows no CRS '" + text + "'");
  VerticalCrs found;
  const char* name = proj_get_name(crs.get());
  if (proj_get_type(crs.get()) == PJ_TYPE_GEOGRAPHIC_3D_CRS) {
    found.name = name ? name : text;
    double semi_major = 0, inverse_flattening = 0;
    const Pj ellipsoid(proj_get_ellipsoid(one.context, crs.get()));
    if (ellipsoid)
      proj_ellipsoid_get_parameters(one.context, ellipsoid.get(), &semi_major, nullptr, nullptr,
                                    &inverse_flattening);
    if (!is_wgs84_or_grs80(semi_major, inverse_flattening))
      return fail(Errc::unsupported, fmt::format("heights of '{}' ({}) are above another ellipsoid "
                                                 "than WGS84's, and are not converted",
                                                 text, found.name));
    found.ellipsoidal = true;
    return found;
  }
  const Pj vertical = vertical_part(one.context, crs.get());
  if (!vertical)
    return fail(Errc::invalid_argument,
                "'" + text + "' (" + (name ? name : "unnamed") + ") says nothing of heights");
  name = proj_get_name(vertical.get());
  found.name = name ? name : text;
  found.text = code_of(crs.get());
  if (found.text.empty()) found.text = text;
  const Pj axes(proj_crs_get_coordinate_system(one.context, vertical.get()));
  const char* direction = nullptr;
  if (axes)
    proj_cs_get_axis_info(one.context, axes.get(), 0, nullptr, nullptr, &direction, &found.unit_m,
                          nullptr, nullptr, nullptr);
  if (direction && std::string(direction) != "up")
    return fail(Errc::invalid_argument,
                "'" + text + "' (" + found.name +
                    ") counts downwards; say --scale -1 and the height that "
                    "it belongs to");
  return found;
}

namespace {

Result<std::shared_ptr<const DatumSurface>> surface_of(const std::string& text, const GeoRect& area,
                                                       const std::string& crs_wkt) {
  const auto crs = vertical_crs(text);
  if (!crs) return std::unexpected(crs.error());
  auto one = std::make_unique<Operation>();
  const Pj named(proj_create(one->context, crs->text.c_str()));
  const bool alone = proj_get_type(named.get()) == PJ_TYPE_VERTICAL_CRS;
  const auto ways =
      ways_of(one->context, alone ? with_positions(crs->text, crs_wkt) : crs->text, area);
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
