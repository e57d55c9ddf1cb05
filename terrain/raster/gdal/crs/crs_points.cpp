#include "terrain/raster/crs_points.h"

#include <fmt/format.h>
#include <ogr_spatialref.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <utility>
#include <vector>

#include "terrain/raster/gdal/crs/gdal_crs.h"
#include "terrain/raster/gdal/gdal_setup.h"

namespace tind {
namespace {

/// No coordinate of a place is larger, in feet or millimetres of a projection's false origin.
constexpr double kFarthest = 1e10;

const char* direction(OGRAxisOrientation to) {
  switch (to) {
    case OAO_North:
      return "north";
    case OAO_South:
      return "south";
    case OAO_East:
      return "east";
    case OAO_West:
      return "west";
    default:
      return "other";
  }
}

class AxisOrderPoints : public CrsPoints {
 public:
  AxisOrderPoints(const OGRSpatialReference& crs, std::unique_ptr<gdal::ToGeographic> way,
                  std::string text, const gdal::CrsFacts& facts)
      : way_(std::move(way)) {
    text_ = std::move(text);
    wkt_ = facts.wkt;
    geographic_ = facts.kind == CrsKind::geographic;
    for (int k = 0; k < 2; ++k) {
      OGRAxisOrientation to = OAO_Other;
      const char* const name = crs.GetAxis(nullptr, k, &to);
      axes_[std::size_t(k)] = std::string(name ? name : "axis") + " (" + direction(to) + ")";
    }
    const std::vector<int>& mapping = crs.GetDataAxisToSRSAxisMapping();
    east_first_ = mapping.size() < 2 || mapping[0] == 1;
  }

  void to_geographic(std::span<const Vec2> points, std::span<Geographic> out) const override {
    std::vector<Vec2> at(points.begin(), points.end());
    if (!east_first_)
      for (Vec2& p : at) std::swap(p.x, p.y);
    // PROJ takes such a number for turns around the globe, or for a longitude.
    for (Vec2& p : at)
      if (!(std::abs(p.x) <= kFarthest && std::abs(p.y) <= kFarthest))
        p.x = p.y = std::numeric_limits<double>::quiet_NaN();
    way_->to_geographic(at);
    for (std::size_t i = 0; i < at.size(); ++i) out[i] = {at[i].x, at[i].y};
  }

  void from_geographic(std::span<const Geographic> places, std::span<Vec2> out) const override {
    for (std::size_t i = 0; i < places.size(); ++i) out[i] = {places[i].lon, places[i].lat};
    way_->to_crs(out);
    if (!east_first_)
      for (Vec2& p : out) std::swap(p.x, p.y);
  }

 private:
  std::unique_ptr<gdal::ToGeographic> way_;
};

}  // namespace

bool is_epsg_code(std::string_view text) {
  constexpr std::string_view kAuthority = "EPSG:";
  const auto same = [](char upper, char given) {
    return upper == (given >= 'a' && given <= 'z' ? char(given - 32) : given);
  };
  if (text.size() < kAuthority.size() ||
      !std::ranges::equal(kAuthority, text.substr(0, kAuthority.size()), same))
    return false;
  text.remove_prefix(kAuthority.size());
  return !text.empty() && text.size() <= 6 &&
         text.find_first_not_of("0123456789") == std::string_view::npos;
}

bool is_geographic(const std::string& crs) {
  if (crs.empty() || crs == "CRS84") return true;
  const auto known = CrsPoints::make(crs, {0, 0});
  return known && (*known)->geographic();
}

Result<std::unique_ptr<CrsPoints>> CrsPoints::make(const std::string& code, Geographic near) {
  const auto refused = [&](const std::string& why) {
    return fail(Errc::invalid_argument, code + " " + why);
  };
  gdal::set_up();
  const gdal::Complaints quiet;
  OGRSpatialReference crs;
  if (!is_epsg_code(code) || crs.importFromEPSG(std::atoi(code.c_str() + 5)) != OGRERR_NONE)
    return refused("is not a system that PROJ knows");
  const auto facts = gdal::describe(&crs);
  if (!facts || facts->kind == CrsKind::none)
    return refused("is neither geographic nor projected: it has no places of two coordinates");

  // As traditional GIS has it, to see which way round the authority does.
  OGRSpatialReference easting_first(crs);
  easting_first.SetAxisMappingStrategy(OAMS_TRADITIONAL_GIS_ORDER);
  const auto anywhere = gdal::ToGeographic::make(facts->wkt, {});
  if (!anywhere) return refused("has no way to WGS84 that PROJ knows");
  Vec2 middle{near.lon, near.lat};
  (*anywhere)->to_crs({&middle, 1});
  if (!std::isfinite(middle.x) || !std::isfinite(middle.y))
    return refused("has no places where this dataset lies");
  auto way = gdal::ToGeographic::make(facts->wkt, middle);
  if (!way) return refused("has no way to WGS84 that PROJ knows");
  return std::make_unique<AxisOrderPoints>(easting_first, std::move(*way), code, *facts);
}

Result<std::unique_ptr<CrsPoints>> CrsPoints::local(Geographic middle) {
  gdal::set_up();
  const gdal::Complaints quiet;
  const std::string text =
      fmt::format("+proj=tmerc +lat_0={} +lon_0={} +k=1 +x_0=0 +y_0=0 +datum=WGS84 +units=m",
                  middle.lat, middle.lon);
  OGRSpatialReference crs;
  crs.SetAxisMappingStrategy(OAMS_TRADITIONAL_GIS_ORDER);
  if (crs.SetFromUserInput(text.c_str()) != OGRERR_NONE)
    return fail(Errc::internal, "PROJ refuses " + text);
  const auto facts = gdal::describe(&crs);
  if (!facts) return std::unexpected(facts.error());
  auto way = gdal::ToGeographic::make(facts->wkt, {});
  if (!way) return std::unexpected(way.error());
  return std::make_unique<AxisOrderPoints>(crs, std::move(*way), text, *facts);
}

}  // namespace tind
