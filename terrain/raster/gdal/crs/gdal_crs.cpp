// What a CRS says is asked of OGR; points are transformed by PROJ itself, because OGR chooses
// among candidate operations by the mean of each batch: the same point would move with the tile
// that asks. Here the operation is fixed once per DEM.

#include "terrain/raster/gdal/crs/gdal_crs.h"

#include <fmt/format.h>
#include <ogr_spatialref.h>
#include <proj.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <map>
#include <mutex>
#include <utility>
#include <vector>

#include "terrain/raster/datums.h"
#include "terrain/raster/gdal/crs/proj_datum.h"
#include "terrain/raster/gdal/crs/proj_files.h"
#include "terrain/raster/gdal/crs/proj_operation.h"
#include "terrain/raster/gdal/gdal_setup.h"

namespace tind::gdal {
namespace {

constexpr int kMostWays = 3;  // that are named where their grids are missing
/// Ways that PROJ states to be better than this are not asked for better ones, metres.
constexpr double kCloseEnough = 1;

/// Behind the node of WKT that is open at `at`: its name and '['. Quotes may hold brackets.
std::size_t end_of_node(const std::string& wkt, std::size_t at) {
  bool quoted = false;
  int depth = 0;
  for (; at < wkt.size(); ++at) {
    if (wkt[at] == '"') quoted = !quoted;
    if (quoted) continue;
    if (wkt[at] == '[') ++depth;
    if (wkt[at] == ']' && --depth == 0) return at + 1;
  }
  return wkt.size();
}

/// Datum ensembles as the datum that they are of. Which of both GDAL says of the same projected
/// file depends on which other CRSs the process has seen; what tiles are of may not.
std::string without_ensembles(std::string wkt) {
  constexpr std::string_view kEnsemble = "ENSEMBLE[\"", kMany = " ensemble\"";
  for (std::size_t at; (at = wkt.find(kEnsemble)) != wkt.npos;) {
    wkt.replace(at, kEnsemble.size(), "DATUM[\"");
    if (const std::size_t name = wkt.find('"', at + kEnsemble.size());
        name != wkt.npos && name > kMany.size() &&
        wkt.compare(name + 1 - kMany.size(), kMany.size(), kMany) == 0)
      wkt.erase(name + 1 - kMany.size(), kMany.size() - 1);
    for (const std::string_view part : {",MEMBER[", ",ENSEMBLEACCURACY["})
      for (std::size_t from; (from = wkt.find(part, at)) < end_of_node(wkt, at);)
        wkt.erase(from, end_of_node(wkt, from + 1) - from);
  }
  return wkt;
}

bool is_plain_wgs84(const OGRSpatialReference& crs) {
  if (!crs.IsGeographic() || std::abs(crs.GetAngularUnits() - M_PI / 180) > 1e-12) return false;
  OGRSpatialReference wgs84;
  wgs84.importFromEPSG(4326);
  const char* options[] = {"IGNORE_DATA_AXIS_TO_SRS_AXIS_MAPPING=YES",
                           "CRITERION=EQUIVALENT_EXCEPT_AXIS_ORDER_GEOGCRS", nullptr};
  return crs.IsSame(&wgs84, options);
}

bool mentions(const std::string& text, const char* word) {
  return text.find(word) != std::string::npos;
}

/// Heights above the system's own ellipsoid are those above WGS84's where that has its size and
/// shape (GRS80's differs by a tenth of a millimetre). Above another they are metres off: WGS 72's
/// equator lies 2 m lower.
VerticalDatum above_own_ellipsoid(const OGRSpatialReference& crs) {
  return is_wgs84_or_grs80(crs.GetSemiMajor(), crs.GetInvFlattening()) ? VerticalDatum::ellipsoid
                                                                       : VerticalDatum::unknown;
}

/// By its code where it has one that PROJ knows, else by its name.
VerticalDatum vertical_datum(const OGRSpatialReference& crs) {
  if (!crs.IsCompound())
    return crs.GetAxesCount() == 3 ? above_own_ellipsoid(crs) : VerticalDatum::unknown;
  const char* datum = crs.GetAttrValue("VERT_CS|VERT_DATUM");
  const char* type = crs.GetAttrValue("VERT_CS|VERT_DATUM", 1);
  const std::string text = std::string(datum ? datum : "") + " " +
                           (crs.GetAttrValue("VERT_CS") ? crs.GetAttrValue("VERT_CS") : "");
  if (mentions(text, "EGM96") || mentions(text, "EGM_96")) return VerticalDatum::egm96;
  if (mentions(text, "EGM2008") || mentions(text, "EGM_2008")) return VerticalDatum::egm2008;
  if (mentions(text, "EGM84") || mentions(text, "EGM_84")) return VerticalDatum::egm84;
  if ((type && std::string(type) == "2002") || mentions(text, "llipsoid"))
    return above_own_ellipsoid(crs);
  const char *authority = crs.GetAuthorityName("VERT_CS"), *code = crs.GetAuthorityCode("VERT_CS");
  if (!authority || !code) return VerticalDatum::unknown;
  auto named = datum_named(std::string(authority) + ":" + code);
  return named ? std::move(*named) : VerticalDatum(VerticalDatum::unknown);
}

/// What a vertical part says of heights, or the third axis of a 3D system. In metres such an axis
/// says nothing: so are heights of which nobody says more.
void learn_heights(const OGRSpatialReference& crs, CrsFacts& facts) {
  const bool apart = crs.GetAttrNode("VERT_CS");
  if (!apart && crs.GetAxesCount() != 3) return;
  OGRAxisOrientation up = OAO_Up;
  double unit_m = 1;
  const char* name = crs.GetAxis(nullptr, 2, &up, &unit_m);
  facts.downwards = up == OAO_Down;
  if (apart) {
    name = crs.GetAttrValue("VERT_CS");
    facts.vertical_unit_m = crs.GetTargetLinearUnits("VERT_CS");
  } else if (unit_m != 1) {
    facts.vertical_unit_m = unit_m;
  }
  if (apart || facts.downwards) facts.vertical = name ? name : "unnamed";
}

/// The best operation from `wkt` to WGS84 at `where`, longitude and easting first on both sides.
std::unique_ptr<Operation> operation_at(const std::string& wkt, Vec2 where) {
  auto made = std::make_unique<Operation>();
  PJ* any = proj_create_crs_to_crs(made->context, wkt.c_str(), "EPSG:4326", nullptr);
  if (!any) return nullptr;
  PJ* all = proj_normalize_for_visualization(made->context, any);
  proj_destroy(any);
  if (!all) return nullptr;
  proj_trans(all, PJ_FWD, proj_coord(where.x, where.y, 0, HUGE_VAL));
  made->pj = proj_trans_get_last_used_operation(all);
  if (made->pj)
    proj_destroy(all);
  else
    made->pj = all;
  return made;
}

/// The grids that PROJ would rather take there than what it has; empty where there are none.
std::string missing_grid(pj_ctx* context, const std::string& wkt, Vec2 lon_lat) {
  PJ* const from = proj_create(context, wkt.c_str());
  PJ* const to = proj_create(context, "EPSG:4326");
  PJ_OPERATION_FACTORY_CONTEXT* const choice =
      proj_create_operation_factory_context(context, nullptr);
  std::string missing;
  if (from && to && choice) {
    constexpr double kAround = 0.01;  // degrees: PROJ passes over an area without width
    proj_operation_factory_context_set_area_of_interest(context, choice, lon_lat.x - kAround,
                                                        lon_lat.y - kAround, lon_lat.x + kAround,
                                                        lon_lat.y + kAround);
    proj_operation_factory_context_set_spatial_criterion(context, choice,
                                                         PROJ_SPATIAL_CRITERION_STRICT_CONTAINMENT);
    proj_operation_factory_context_set_grid_availability_use(context, choice,
                                                             PROJ_GRID_AVAILABILITY_IGNORED);
    PJ_OBJ_LIST* const ways = proj_create_operations(context, from, to, choice);
    bool whole = false;
    for (int i = 0; ways && !whole && i < std::min(proj_list_get_count(ways), kMostWays); ++i) {
      PJ* const way = proj_list_get(context, ways, i);
      whole = true;
      for (int k = 0; k < proj_coordoperation_get_grid_used_count(context, way); ++k) {
        const char *name = nullptr, *url = nullptr;
        int there = 1;
        if (!proj_coordoperation_get_grid_used(context, way, k, &name, nullptr, nullptr, &url,
                                               nullptr, nullptr, &there) ||
            there)
          continue;
        whole = false;
        if (missing.find(name) == missing.npos)
          missing += std::string(missing.empty() ? "" : " or ") + name +
                     (url && *url ? std::string(" (") + url + ")" : "");
      }
      proj_destroy(way);
    }
    proj_list_destroy(ways);
  }
  proj_operation_factory_context_destroy(choice);
  proj_destroy(to);
  proj_destroy(from);
  return missing;
}

/// The same, kept by degree: PROJ takes a tenth of a second to say it, and DEMs come in hundreds.
/// Whoever asks for another one meanwhile does not wait for that.
std::string known_missing(pj_ctx* context, const std::string& wkt, Vec2 lon_lat) {
  constexpr std::size_t kMost = 1000;
  static std::mutex mutex;
  static std::map<std::string, std::string> known;
  const std::string key = fmt::format("{:.0f} {:.0f} {}", lon_lat.x, lon_lat.y, wkt);
  {
    const std::lock_guard lock(mutex);
    if (const auto found = known.find(key); found != known.end()) return found->second;
  }
  std::string missing = missing_grid(context, wkt, lon_lat);
  const std::lock_guard lock(mutex);
  if (known.size() >= kMost) known.clear();
  return known[key] = std::move(missing);
}

CrsWay way_of(const Operation& one, const std::string& wkt, Vec2 where) {
  CrsWay way;
  const char* const name = proj_get_name(one.pj);
  way.name = name ? name : "";
  const double accuracy = proj_coordoperation_get_accuracy(one.context, one.pj);
  const bool ballpark = proj_coordoperation_has_ballpark_transformation(one.context, one.pj);
  if (accuracy >= 0 && !ballpark) way.accuracy_m = accuracy;
  if (way.accuracy_m && *way.accuracy_m < kCloseEnough) return way;
  const PJ_COORD at = proj_trans(one.pj, PJ_FWD, proj_coord(where.x, where.y, 0, HUGE_VAL));
  const std::string grid = std::isfinite(at.xy.x) && std::isfinite(at.xy.y)
                               ? known_missing(one.context, wkt, {at.xy.x, at.xy.y})
                               : std::string();
  const std::string exact =
      way.accuracy_m ? fmt::format("exact to {:.3g} m, as PROJ states", *way.accuracy_m)
                     : std::string("a guess of PROJ's (\"ballpark\"), off by up to some 100 m");
  if (!grid.empty())
    way.warning = "its places on WGS84 are " + exact + ": PROJ misses the grid " + grid;
  else if (!way.accuracy_m)
    way.warning = "its places on WGS84 are " + exact;
  return way;
}

}  // namespace

namespace {

bool is_path(std::string_view grids) { return grids.find_first_of("/\\") != grids.npos; }

/// What stands behind `before` up to one of `end`, wherever `before` is found, is a path.
bool has_path(const std::string& text, std::string_view before, std::string_view end) {
  for (auto at = text.find(before); at != text.npos; at = text.find(before, at + 1)) {
    const auto from = at + before.size();
    if (is_path(std::string_view(text).substr(from, text.find_first_of(end, from) - from)))
      return true;
  }
  return false;
}

}  // namespace

/// A CRS may name grids (of a datum, of a geoid), and PROJ opens them: in its own folders those of
/// plain names, and any file of the machine behind a path. `wkt`: WKT 2, where they stand in
/// PARAMETERFILE, or in a PROJ string as key=value.
bool names_a_file(const std::string& wkt) {
  return has_path(wkt, "PARAMETERFILE[", "]") ||
         (wkt.find("proj=") != wkt.npos && has_path(wkt, "=", " \"\t\r\n"));
}

namespace {

Result<CrsFacts> facts_of(const OGRSpatialReference* given) {
  CrsFacts facts;
  if (!given || given->IsEmpty()) return facts;
  if (given->IsLocal()) {  // nobody knows where it is, but how long its lengths are
    const double unit_m = given->GetLinearUnits();
    if (std::isfinite(unit_m) && unit_m > 0) facts.unit_m = unit_m;
    return facts;
  }
  if (!given->IsGeographic() && !given->IsProjected())
    return fail(Errc::unsupported,
                "its CRS is neither geographic nor projected; reproject it with "
                "gdalwarp -t_srs EPSG:4326");
  const char* name = given->GetName();
  facts.name = name ? name : "unnamed";
  facts.kind = given->IsProjected() ? CrsKind::projected : CrsKind::geographic;
  facts.datum = vertical_datum(*given);
  learn_heights(*given, facts);
  OGRSpatialReference flat(*given);
  flat.StripVertical();
  flat.DemoteTo2D(nullptr);
  if (facts.kind == CrsKind::projected)
    facts.unit_m = flat.GetLinearUnits();
  else
    facts.turn = 360 * (M_PI / 180) / flat.GetAngularUnits();
  if (std::abs(facts.turn - 360) < 1e-9) facts.turn = 360;
  facts.plain_wgs84 = is_plain_wgs84(flat);
  facts.wkt = given->IsProjected() ? without_ensembles(wkt2(flat)) : wkt2(flat);
  return facts;
}

}  // namespace

std::string wkt2(const OGRSpatialReference& crs) {
  char* text = nullptr;
  const char* options[] = {"FORMAT=WKT2_2019", nullptr};
  crs.exportToWkt(&text, options);
  std::string wkt = text ? text : "";
  CPLFree(text);
  return wkt;
}

Result<void> crs_database() {
  thread_local bool there = false;  // as GDAL keeps it open
  if (there) return {};
  set_up();
  const Complaints complaints;
  OGRSpatialReference any;
  there = any.importFromEPSG(4326) == OGRERR_NONE;
  if (there) return {};
  return fail(Errc::io,
              "PROJ's database of coordinate systems cannot be read; where proj.db is not "
              "where PROJ was installed, name its folder in PROJ_DATA (" +
                  complaints.text("no reason given") + ")");
}

Result<OGRSpatialReference> read_crs(const std::string& text) {
  if (auto there = crs_database(); !there) return std::unexpected(there.error());
  const Complaints complaints;
  std::array<OGRSpatialReference, 2> read;
  for (OGRSpatialReference& crs : read) {
    crs.SetAxisMappingStrategy(OAMS_TRADITIONAL_GIS_ORDER);
    const auto known = text.starts_with("EPSG:") ? crs.importFromEPSG(std::atoi(text.c_str() + 5))
                                                 : crs.importFromWkt(text.c_str());
    if (known == OGRERR_NONE) continue;
    const std::string why = complaints.text("it is neither WKT nor of EPSG's list");
    return fail(why.contains("SQLite error") ? Errc::io : Errc::bad_data, why);
  }
  if (wkt2(read[0]) == wkt2(read[1])) return std::move(read[0]);
  return fail(Errc::io, "PROJ's database of coordinate systems cannot be read");
}

Result<OGRSpatialReference> crs_of_layer(const std::string& wkt) {
  if (!wkt.empty()) return read_crs(wkt);
  OGRSpatialReference none;
  none.SetLocalCS(kLengthsWithoutPlace);
  return none;
}

Result<CrsFacts> describe(const OGRSpatialReference* given) {
  if (given && names_a_file(wkt2(*given)))
    return fail(Errc::unsupported,
                "its CRS names a grid by its path, and a file of heights may not say which files "
                "are opened; say --crs, or put the grid into a folder of PROJ's");
  return facts_of(given);
}

Result<CrsFacts> crs_named(const std::string& text) {
  if (auto there = crs_database(); !there) return std::unexpected(there.error());
  const Complaints complaints;
  const OperatorNamesGrids operator_names_them;
  OGRSpatialReference crs;
  const char* options[] = {"ALLOW_NETWORK_ACCESS=NO", "ALLOW_FILE_ACCESS=NO", nullptr};
  if (crs.SetFromUserInput(text.c_str(), options) != OGRERR_NONE)
    return fail(Errc::invalid_argument, "PROJ knows no CRS '" + text + "' (" +
                                            complaints.text("say EPSG:25832, or WKT") + ")");
  auto facts = facts_of(&crs);
  if (!facts)
    return fail(Errc::invalid_argument, "'" + text + "' is neither geographic nor projected");
  if (facts->kind == CrsKind::none)
    return fail(Errc::invalid_argument, "'" + text + "' has no place on the globe");
  return facts;
}

bool same_crs(const std::string& wkt_a, const std::string& wkt_b) {
  if (wkt_a == wkt_b) return true;
  OGRSpatialReference a, b;
  if (wkt_a.empty() || wkt_b.empty() || a.importFromWkt(wkt_a.c_str()) != OGRERR_NONE ||
      b.importFromWkt(wkt_b.c_str()) != OGRERR_NONE)
    return false;
  // Coordinates are longitude first here, whichever order the system has.
  const char* options[] = {"IGNORE_DATA_AXIS_TO_SRS_AXIS_MAPPING=YES",
                           "CRITERION=EQUIVALENT_EXCEPT_AXIS_ORDER_GEOGCRS", nullptr};
  return a.IsSame(&b, options);
}

ToGeographic::ToGeographic(std::unique_ptr<Operations> operations, CrsWay way)
    : operations_(std::move(operations)), way_(std::move(way)) {}
ToGeographic::~ToGeographic() = default;

Result<std::unique_ptr<ToGeographic>> ToGeographic::make(const std::string& wkt, Vec2 where) {
  auto original = if_all_is_read(
      [&]() -> Result<std::unique_ptr<Operation>> { return operation_at(wkt, where); });
  if (!original) return std::unexpected(original.error());
  if (!*original) {
    if (auto there = crs_database(); !there) return std::unexpected(there.error());
    return fail(Errc::unsupported,
                "PROJ knows no way from its CRS to WGS84; assign another with "
                "gdal_translate -a_srs");
  }
  CrsWay way = way_of(**original, wkt, where);
  std::unique_ptr<ToGeographic> made(
      new ToGeographic(std::make_unique<Operations>(std::move(*original)), std::move(way)));
  Vec2 back = where;
  made->operations_->run(true, {&back, 1});
  made->operations_->run(false, {&back, 1});
  made->drifts_ = !(std::hypot(back.x - where.x, back.y - where.y) < 1e-7);
  return made;
}

void ToGeographic::to_geographic(std::span<Vec2> points) const { operations_->run(true, points); }

void ToGeographic::to_crs(std::span<Vec2> points) const {
  if (!drifts_) return operations_->run(false, points);
  // One step of fixed-point iteration; the drift changes by 1e-7 of itself over itself.
  std::vector<Vec2> returned(points.begin(), points.end());
  operations_->run(false, returned);
  operations_->run(true, returned);
  for (std::size_t i = 0; i < points.size(); ++i) {
    points[i].x += points[i].x - returned[i].x;
    points[i].y += points[i].y - returned[i].y;
  }
  operations_->run(false, points);
}

}  // namespace tind::gdal
