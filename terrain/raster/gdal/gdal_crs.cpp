// What a CRS says is asked of OGR; points are transformed by PROJ itself, because OGR chooses
// among candidate operations by the mean of each batch: the same point would move with the tile
// that asks. Here the operation is fixed once per DEM.

#include "terrain/raster/gdal/gdal_crs.h"

#include <ogr_spatialref.h>
#include <proj.h>

#include <cmath>
#include <limits>
#include <mutex>
#include <vector>

#include "terrain/raster/gdal/gdal_setup.h"

namespace tind::gdal {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

std::string wkt2(const OGRSpatialReference& crs) {
  char* text = nullptr;
  const char* options[] = {"FORMAT=WKT2_2019", nullptr};
  crs.exportToWkt(&text, options);
  std::string wkt = text ? text : "";
  CPLFree(text);
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

VerticalDatum vertical_datum(const OGRSpatialReference& crs) {
  if (crs.IsGeographic() && !crs.IsCompound())
    return crs.GetAxesCount() == 3 ? VerticalDatum::ellipsoid : VerticalDatum::unknown;
  const char* datum = crs.GetAttrValue("VERT_CS|VERT_DATUM");
  const char* type = crs.GetAttrValue("VERT_CS|VERT_DATUM", 1);
  const std::string text = std::string(datum ? datum : "") + " " +
                           (crs.GetAttrValue("VERT_CS") ? crs.GetAttrValue("VERT_CS") : "");
  if (mentions(text, "EGM96") || mentions(text, "EGM_96")) return VerticalDatum::egm96;
  if ((type && std::string(type) == "2002") || mentions(text, "llipsoid"))
    return VerticalDatum::ellipsoid;
  return VerticalDatum::unknown;
}

/// A PROJ context and an operation in it: what one thread needs.
struct Operation {
  PJ_CONTEXT* context = proj_context_create();
  PJ* pj = nullptr;
  Operation() {
    proj_context_set_enable_network(context, 0);
    proj_log_level(context, PJ_LOG_NONE);
  }
  ~Operation() {
    proj_destroy(pj);
    proj_context_destroy(context);
  }
  Operation(const Operation&) = delete;
  Operation& operator=(const Operation&) = delete;
};

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

}  // namespace

Result<CrsFacts> describe(const OGRSpatialReference* given) {
  CrsFacts facts;
  if (!given || given->IsEmpty() || given->IsLocal()) return facts;
  if (!given->IsGeographic() && !given->IsProjected())
    return fail(Errc::unsupported,
                "its CRS is neither geographic nor projected; reproject it with "
                "gdalwarp -t_srs EPSG:4326");
  const char* name = given->GetName();
  facts.name = name ? name : "unnamed";
  facts.kind = given->IsProjected() ? CrsKind::projected : CrsKind::geographic;
  facts.datum = vertical_datum(*given);
  if (given->GetAttrNode("VERT_CS")) {
    facts.vertical_unit_m = given->GetTargetLinearUnits("VERT_CS");
    const char* vertical = given->GetAttrValue("VERT_CS");
    facts.vertical = vertical ? vertical : "unnamed";
  }
  OGRSpatialReference flat(*given);
  flat.StripVertical();
  flat.DemoteTo2D(nullptr);
  if (facts.kind == CrsKind::projected)
    facts.unit_m = flat.GetLinearUnits();
  else
    facts.turn = 360 * (M_PI / 180) / flat.GetAngularUnits();
  if (std::abs(facts.turn - 360) < 1e-9) facts.turn = 360;
  facts.plain_wgs84 = is_plain_wgs84(flat);
  facts.wkt = wkt2(flat);
  return facts;
}

Result<CrsFacts> crs_named(const std::string& text) {
  set_up();
  const Complaints complaints;
  OGRSpatialReference crs;
  const char* options[] = {"ALLOW_NETWORK_ACCESS=NO", "ALLOW_FILE_ACCESS=NO", nullptr};
  if (crs.SetFromUserInput(text.c_str(), options) != OGRERR_NONE)
    return fail(Errc::invalid_argument, "PROJ knows no CRS '" + text + "' (" +
                                            complaints.text("say EPSG:25832, or WKT") + ")");
  auto facts = describe(&crs);
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

struct ToGeographic::Pool {
  std::mutex mutex;
  std::unique_ptr<Operation> original;  // only ever cloned, under the mutex
  std::vector<std::unique_ptr<Operation>> idle;
  /// A datum shift moves heights too, which are dropped: there and back is then a millimetre off.
  bool drifts = false;

  std::unique_ptr<Operation> take() {
    const std::lock_guard lock(mutex);
    if (!idle.empty()) {
      auto one = std::move(idle.back());
      idle.pop_back();
      return one;
    }
    auto one = std::make_unique<Operation>();
    one->pj = proj_clone(one->context, original->pj);
    return one;
  }
  void give(std::unique_ptr<Operation> one) {
    const std::lock_guard lock(mutex);
    idle.push_back(std::move(one));
  }
  void run(PJ_DIRECTION direction, std::span<Vec2> points) {
    if (points.empty()) return;
    auto one = take();
    proj_errno_reset(one->pj);
    proj_trans_generic(one->pj, direction, &points[0].x, sizeof(Vec2), points.size(), &points[0].y,
                       sizeof(Vec2), points.size(), nullptr, 0, 0, nullptr, 0, 0);
    give(std::move(one));
    for (Vec2& p : points)
      if (!std::isfinite(p.x) || !std::isfinite(p.y)) p = {kNaN, kNaN};
  }
};

ToGeographic::ToGeographic(std::unique_ptr<Pool> pool) : pool_(std::move(pool)) {}
ToGeographic::~ToGeographic() = default;

Result<std::unique_ptr<ToGeographic>> ToGeographic::make(const std::string& wkt, Vec2 where) {
  auto pool = std::make_unique<Pool>();
  pool->original = operation_at(wkt, where);
  if (!pool->original)
    return fail(Errc::unsupported,
                "PROJ knows no way from its CRS to WGS84; assign another with "
                "gdal_translate -a_srs");
  Vec2 back = where;
  pool->run(PJ_FWD, {&back, 1});
  pool->run(PJ_INV, {&back, 1});
  pool->drifts = !(std::hypot(back.x - where.x, back.y - where.y) < 1e-7);
  return std::unique_ptr<ToGeographic>(new ToGeographic(std::move(pool)));
}

void ToGeographic::to_geographic(std::span<Vec2> points) const { pool_->run(PJ_FWD, points); }

void ToGeographic::to_crs(std::span<Vec2> points) const {
  if (!pool_->drifts) return pool_->run(PJ_INV, points);
  // One step of fixed-point iteration; the drift changes by 1e-7 of itself over itself.
  std::vector<Vec2> returned(points.begin(), points.end());
  pool_->run(PJ_INV, returned);
  pool_->run(PJ_FWD, returned);
  for (std::size_t i = 0; i < points.size(); ++i) {
    points[i].x += points[i].x - returned[i].x;
    points[i].y += points[i].y - returned[i].y;
  }
  pool_->run(PJ_INV, points);
}

}  // namespace tind::gdal
