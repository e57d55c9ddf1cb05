#include "terrain/raster/crs_code.h"

#include <ogr_spatialref.h>

#include <algorithm>
#include <cstdlib>
#include <string_view>

#include "terrain/raster/gdal/crs/gdal_crs.h"
#include "terrain/raster/gdal/gdal_setup.h"

namespace tind {
namespace {

int code_of(const OGRSpatialReference& crs) {
  const char* const name = crs.GetAuthorityName(nullptr);
  const char* const code = crs.GetAuthorityCode(nullptr);
  return name && code && std::string_view(name) == "EPSG" ? std::max(std::atoi(code), 0) : 0;
}

/// The system of the list that is the same.
int known_as(const OGRSpatialReference& crs) {
  int matches = 0;
  int* confidence = nullptr;
  auto* const handle = OGRSpatialReference::ToHandle(const_cast<OGRSpatialReference*>(&crs));
  OGRSpatialReferenceH* const found = OSRFindMatches(handle, nullptr, &matches, &confidence);
  const char* const options[] = {"CRITERION=EQUIVALENT_EXCEPT_AXIS_ORDER_GEOGCRS",
                                 "IGNORE_DATA_AXIS_TO_SRS_AXIS_MAPPING=YES", nullptr};
  int best = 0;
  for (int i = 0; i < matches && best == 0; ++i) {
    const OGRSpatialReference& other = *OGRSpatialReference::FromHandle(found[i]);
    if (confidence[i] >= 90 && crs.IsSame(&other, options)) best = code_of(other);
  }
  OSRFreeSRSArray(found);
  CPLFree(confidence);
  return best;
}

}  // namespace

Result<CrsCode> crs_code(const std::string& text) {
  if (text.empty()) return CrsCode{};
  gdal::set_up();
  const gdal::Complaints quiet;
  const auto crs = gdal::read_crs(text);
  if (!crs && crs.error().code == Errc::io) return std::unexpected(crs.error());
  if (!crs) return CrsCode{};
  CrsCode code{code_of(*crs), crs->IsGeographic() != 0, 1, crs->GetName() ? crs->GetName() : ""};
  if (code.epsg == 0) code.epsg = known_as(*crs);
  if (!code.geographic) code.unit_m = crs->GetLinearUnits();
  code.wkt = gdal::wkt2(*crs);
  return code;
}

}  // namespace tind
