// PROJ's grids (proj.org/specifications/geodetictiffgrids.html) have an item TYPE in their
// metadata.

#include "terrain/raster/offset_grid.h"

#include <fmt/format.h>
#include <gdal_priv.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <mutex>
#include <optional>
#include <string_view>
#include <vector>

#include "terrain/base/existing_file.h"
#include "terrain/raster/gdal/gdal_setup.h"

namespace tind {
namespace {

constexpr std::string_view kGeoid = "VERTICAL_OFFSET_GEOGRAPHIC_TO_VERTICAL";
/// PROJ takes what is beyond in a .gtx for nodata, since some have no other mark.
constexpr double kMostOfGtx = 1000;
constexpr std::array<std::string_view, 6> kKinds = {
    "HORIZONTAL_OFFSET", "VERTICAL_OFFSET",           "GEOCENTRIC_TRANSLATION",
    "VELOCITY",          "ELLIPSOIDAL_HEIGHT_OFFSET", "DEFORMATION_MODEL"};

std::unique_ptr<GDALDataset> open_grid(const std::string& path, const char* const* drivers) {
  if (!check_is_file(path)) return nullptr;
  return std::unique_ptr<GDALDataset>(GDALDataset::Open(
      path.c_str(), GDAL_OF_RASTER | GDAL_OF_READONLY, drivers, nullptr, nullptr));
}

/// What a grid says that it is, where that is one of PROJ's kinds; else nothing.
std::string stated_kind(GDALDataset& set) {
  const char* const type = set.GetMetadataItem("TYPE");
  const bool known = type && std::ranges::any_of(kKinds, [type](std::string_view kind) {
                       return std::string_view(type).starts_with(kind);
                     });
  return known ? type : "";
}

/// The band that PROJ takes.
GDALRasterBand* undulations_of(GDALDataset& set) {
  for (int b = 1; b <= set.GetRasterCount(); ++b)
    if (std::string_view(set.GetRasterBand(b)->GetDescription()) == "geoid_undulation")
      return set.GetRasterBand(b);
  return set.GetRasterCount() > 0 ? set.GetRasterBand(1) : nullptr;
}

/// The value that is farthest from 0, but not beyond `most`, among some of a band; nothing where
/// there is none, or where they cannot be read.
std::optional<double> farthest(GDALRasterBand& band, double most) {
  constexpr int kMostSide = 32;
  const int across = std::min(band.GetXSize(), kMostSide);
  const int down = std::min(band.GetYSize(), kMostSide);
  std::vector<double> values(std::size_t(across) * std::size_t(down));
  if (band.RasterIO(GF_Read, 0, 0, band.GetXSize(), band.GetYSize(), values.data(), across, down,
                    GDT_Float64, 0, 0, nullptr) != CE_None)
    return {};
  int has = 0;
  const double nodata = band.GetNoDataValue(&has), scale = band.GetScale();
  const double offset = band.GetOffset();
  std::optional<double> found;
  for (const double raw : values) {
    if (!std::isfinite(raw) || (has && (raw == nodata || float(raw) == float(nodata)))) continue;
    const double value = raw * scale + offset;
    if (std::abs(value) > most) continue;
    if (!found || std::abs(value) > std::abs(*found)) found = value;
  }
  return found;
}

}  // namespace

bool is_offset_grid(const std::string& path) {
  gdal::set_up();
  const gdal::Complaints quiet;
  const char* const drivers[] = {"GTiff", nullptr};
  const auto set = open_grid(path, drivers);
  return set && !stated_kind(*set).empty();
}

Result<void> may_be_geoid(const std::string& path) {
  gdal::set_up();
  const gdal::Complaints quiet;
  static std::once_flag once;
  std::call_once(once, [] { GDALRegister_GTX(); });  // DEMs are opened by a list without it
  const char* const drivers[] = {"GTiff", "GTX", nullptr};
  const auto set = open_grid(path, drivers);
  if (!set) return {};
  if (const std::string kind = stated_kind(*set); kind == kGeoid) {
    return {};
  } else if (!kind.empty()) {
    return fail(Errc::bad_data, fmt::format("{}: says that it is {}, which is no geoid; a geoid "
                                            "is {}",
                                            path, kind, kGeoid));
  }
  GDALRasterBand* const band = undulations_of(*set);
  const bool gtx = std::string_view(set->GetDriver()->GetDescription()) == "GTX";
  const auto value = band ? farthest(*band, gtx ? kMostOfGtx : HUGE_VAL) : std::nullopt;
  if (!value || std::abs(*value) <= kMostUndulation_m) return {};
  return fail(Errc::bad_data,
              fmt::format("{}: is no geoid: it holds {:.6g}, and no geoid is more than {:g} m "
                          "from the ellipsoid; say with --from-datum or --to-datum which one the "
                          "heights are above",
                          path, *value, kMostUndulation_m));
}

}  // namespace tind
