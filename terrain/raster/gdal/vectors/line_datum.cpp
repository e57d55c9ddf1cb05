// A vertical CRS is a datum and a unit. The unit of lines is converted where they are read, so only
// the datum has to be that of the DEM: NAVD88 in feet goes with NAVD88 in metres.

#include "terrain/raster/gdal/vectors/line_datum.h"

#include <fmt/format.h>
#include <ogr_spatialref.h>

#include "terrain/raster/gdal/crs/gdal_crs.h"
#include "terrain/raster/gdal/gdal_setup.h"

namespace tind {
namespace {

std::string zero_of(const OGRSpatialReference& crs) {
  const char* const datum = crs.GetAttrValue("VERT_CS|VERT_DATUM");
  return datum ? datum : "";
}

/// The same of what a person or a DEM names: "EPSG:5703", "EPSG:4269+5703".
std::string zero_named(const std::string& text) {
  gdal::set_up();
  const gdal::Complaints quiet;
  OGRSpatialReference crs;
  const char* const options[] = {"ALLOW_NETWORK_ACCESS=NO", "ALLOW_FILE_ACCESS=NO", nullptr};
  return crs.SetFromUserInput(text.c_str(), options) == OGRERR_NONE ? zero_of(crs) : "";
}

bool is_of_dem(const StatedDatum& lines, const DemInfo& dem) {
  if (lines.datum != VerticalDatum::unknown && lines.datum == dem.datum) return true;
  if (dem.datum.kind() == VerticalDatum::crs && !lines.zero.empty() &&
      lines.zero == zero_named(dem.datum.text()))
    return true;
  // What PROJ does not know is the same where both files call it the same.
  return lines.datum == VerticalDatum::unknown && dem.datum == dem.source_datum &&
         lines.vertical == dem.vertical_crs;
}

/// "'EGM2008 height'", as warnings of DEMs have it.
std::string stated_text(const StatedDatum& lines) {
  return lines.vertical.empty() ? name(lines.datum) : "'" + lines.vertical + "'";
}

Error counts_depths(const std::string& path, const StatedDatum& lines) {
  return {Errc::invalid_argument,
          fmt::format("{}: its vertical CRS '{}' counts downwards, and lines have heights: store "
                      "those, or take the DEM's for all (--line-heights dem)",
                      path, lines.vertical)};
}

Error above_another(const std::string& path, const StatedDatum& lines, const DemInfo& dem) {
  const std::string converted = dem.datum == dem.source_datum ? "" : ", once converted,";
  return {Errc::invalid_argument,
          fmt::format("{}: says that its heights are above {}, and those of the DEM{} are above "
                      "{}: bring both to one (the DEM with --to-datum {}, lines with ogr2ogr "
                      "-t_srs, or -a_srs where their file says it wrongly), or take the DEM's for "
                      "all (--line-heights dem)",
                      path, stated_text(lines), converted, name(dem.datum), name(lines.datum))};
}

/// Where nobody can say whether they are the same.
std::string doubt(const std::string& path, const StatedDatum& lines, const DemInfo& dem) {
  std::string text = "heights of " + path + " are above " + stated_text(lines);
  if (lines.datum == VerticalDatum::unknown) text += ", which PROJ does not know";
  if (lines.perhaps_unsaid) text += " by EPSG:4979, which ogr2ogr makes of any GeoJSON";
  text += ", and of " + dem.files[0];
  if (dem.datum == VerticalDatum::unknown)
    return text +
           " nobody says above what: they are taken as above the same; if they are not, say it "
           "with --from-datum, or take the DEM's for all (--line-heights dem)";
  return text + " above " + name(dem.datum) +
         ": they are taken as above the same; if they are not, take the DEM's for all "
         "(--line-heights dem)";
}

}  // namespace

Result<std::optional<StatedDatum>> stated_datum(const OGRSpatialReference* crs, bool json) {
  if (!crs) return std::nullopt;
  if (auto there = gdal::crs_database(); !there) return std::unexpected(there.error());
  const gdal::Complaints quiet;
  const auto facts = gdal::describe(crs);
  if (!facts) return std::nullopt;  // whoever needs its places says what is wrong with it
  if (!facts->vertical.empty())
    return StatedDatum{facts->datum, facts->vertical, zero_of(*crs), facts->downwards};
  if (crs->GetAxesCount() != 3 || json) return std::nullopt;
  const bool another = facts->datum == VerticalDatum::unknown;
  return StatedDatum{facts->datum, another ? "the ellipsoid of " + facts->name : std::string(), "",
                     facts->downwards, facts->plain_wgs84};
}

Result<std::vector<std::string>> compare_datums(const std::string& path,
                                                const std::vector<StatedDatum>& stated,
                                                const DemInfo& dem) {
  std::vector<std::string> doubts;
  for (const StatedDatum& lines : stated) {
    if (lines.downwards) return std::unexpected(counts_depths(path, lines));
    if (is_of_dem(lines, dem)) continue;
    // Of a geoid's file nobody says which datum it is of.
    const bool known = lines.datum != VerticalDatum::unknown &&
                       dem.datum != VerticalDatum::unknown &&
                       dem.datum.kind() != VerticalDatum::file;
    if (known && !lines.perhaps_unsaid) return std::unexpected(above_another(path, lines, dem));
    doubts.push_back(doubt(path, lines, dem));
  }
  return doubts;
}

}  // namespace tind
