// GDAL opens whatever its drivers recognise: a ".tif" that is really a VRT or an MRF can read and
// write files and URLs of its author's choosing. So only the drivers of a short list are ever
// registered (an unregistered driver cannot be reached, not even by a nested open), sidecar
// metadata and the network are off, and options are pinned because their defaults change by
// version. An option that is set by call wins over the environment, but not over ~/.gdal/gdalrc and
// the like, which GDAL reads when its first driver is registered: none is read.

#include "terrain/raster/gdal/gdal_setup.h"

#include <cpl_conv.h>
#include <cpl_error.h>
#include <gdal.h>
#include <gdal_frmts.h>
#include <ogrsf_frmts.h>

#include <algorithm>
#include <mutex>
#include <string_view>
#include <utility>

#include "terrain/base/errno_text.h"
#include "terrain/base/system_failure.h"
#include "terrain/raster/dem_files.h"

namespace tind::gdal {
namespace {

constexpr std::pair<const char*, const char*> kOptions[] = {
    {"GDAL_CONFIG_FILE", ""},                    // no gdalrc: it would win over all that follows
    {"GDAL_DRIVER_PATH", "disable"},             // no plugins
    {"GDAL_PAM_ENABLED", "NO"},                  // no .aux.xml that changes what a file says
    {"GDAL_DISABLE_READDIR_ON_OPEN", "TRUE"},    // world files are found, folders are not listed
    {"GDAL_VRT_ENABLE_PYTHON", "NO"},            //
    {"CPL_VSIL_CURL_ALLOWED_FILENAME", "none"},  // no remote file; see refuse_fetches()
    {"GDAL_HTTP_MAX_RETRY", "0"},                //
    {"GDAL_HTTP_TIMEOUT", "1"},                  //
    {"GDAL_NUM_THREADS", "1"},                   // threads are ours to make
    {"GDAL_MAX_DATASET_POOL_SIZE", "64"},        //
    {"GDAL_MAX_BAND_COUNT", "64"},               //
    {"VSI_CACHE", "NO"},                         //
    {"GTIFF_IGNORE_READ_ERRORS", "NO"},          // an unreadable block is an error, never zeros
    {"GTIFF_VIRTUAL_MEM_IO", "NO"},              // a truncated file must not become SIGBUS
    {"GTIFF_USE_MMAP", "NO"},                    //
    {"GTIFF_DIRECT_IO", "NO"},                   //
    {"TIFF_READ_STREAMING", "NO"},               //
    {"GTIFF_LINEAR_UNITS", "DEFAULT"},           //
    {"GTIFF_HONOUR_NEGATIVE_SCALEY", "NO"},      //
    {"VRT_ALLOW_MEM_DRIVER", "NO"},              // the same in vrt_nesting.cpp, for older GDALs
    {"GTIFF_REPORT_COMPD_CS", "YES"},            // the vertical datum, where a file states it
    {"REPORT_COMPD_CS", "YES"},                  // the same for DTED and SRTM
    {"GTIFF_POINT_GEO_IGNORE", "NO"},            //
    {"DTED_VERIFY_CHECKSUM", "YES"},             // the one uncompressed format that has any
};

// Shared by all handles of the process; one decoded block is at most 64 MiB (see
// gdal_file.cpp). GDAL_CACHEMAX in the environment says otherwise: a daemon wants less, a batch
// of wide strips more.
constexpr GIntBig kCacheBytes = 128 << 20;

void CPL_STDCALL keep(CPLErr level, CPLErrorNum, const char* message) {
  if (level < CE_Failure) return;
  static_cast<Complaints*>(CPLGetErrorHandlerUserData())->add(message);
}

}  // namespace

void set_up() {
  static std::once_flag once;
  std::call_once(once, [] {
    for (const auto& [name, value] : kOptions) CPLSetConfigOption(name, value);
    refuse_fetches();
    CPLSetErrorHandler(CPLQuietErrorHandler);  // what nobody collects is not printed either
    GDALRegister_GTiff();                      // also reads COG
    GDALRegister_SRTMHGT();
    GDALRegister_DTED();
    GDALRegister_USGSDEM();
    GDALRegister_AAIGrid();
    GDALRegister_HFA();
    GDALRegister_PNG();
    GDALRegister_EHdr();  // BIL, BIP, BSQ, FLT; last: takes whatever has a .hdr beside it
    GDALRegister_MEM();
    if (!CPLGetConfigOption("GDAL_CACHEMAX", nullptr)) GDALSetCacheMax64(kCacheBytes);
  });
}

void register_vrt() {
  set_up();
  static std::once_flag once;
  std::call_once(once, [] { GDALRegister_VRT(); });
}

void register_vectors() {
  set_up();
  static std::once_flag once;
  std::call_once(once, [] {
    CPLSetConfigOption("GML_SKIP_RESOLVE_ELEMS", "ALL");  // no other file, no URL
    RegisterOGRShape();
    RegisterOGRGeoJSON();
    RegisterOGRGeoJSONSeq();
    RegisterOGRGeoPackage();
    RegisterOGRSQLite();
    RegisterOGRFlatGeobuf();
    RegisterOGRKML();
    RegisterOGRGML();
    RegisterOGRGPX();
    RegisterOGRDXF();
    RegisterOGRTAB();
    RegisterOGRCSV();
  });
}

const char* const* vector_drivers() {
  static constexpr const char* kNames[] = {"ESRI Shapefile",
                                           "GeoJSON",
                                           "GeoJSONSeq",
                                           "GPKG",
                                           "SQLite",
                                           "FlatGeobuf",
                                           "KML",
                                           "GML",
                                           "GPX",
                                           "DXF",
                                           "CSV",
                                           "MapInfo File",
                                           nullptr};
  return kNames;
}

const char* const* raster_drivers(bool with_vrt, std::string_view path) {
  static constexpr const char* kWithVrt[] = {"VRT",     "GTiff", "SRTMHGT", "DTED", "USGSDEM",
                                             "AAIGrid", "HFA",   "PNG",     nullptr};
  static constexpr const char* kRawWithVrt[] = {"VRT",     "GTiff", "SRTMHGT", "DTED", "USGSDEM",
                                                "AAIGrid", "HFA",   "PNG",     "EHdr", nullptr};
  // EHdr takes for raw numbers whatever has a .hdr beside it, a text or a NetCDF file, too.
  return (is_raw_raster(path) ? kRawWithVrt : kWithVrt) + (with_vrt ? 0 : 1);
}

Complaints::Complaints() { CPLPushErrorHandlerEx(keep, this); }
Complaints::~Complaints() { CPLPopErrorHandler(); }

void Complaints::add(std::string message) {
  if (std::exchange(failed_, true)) return;
  std::replace(message.begin(), message.end(), '\n', ' ');
  first_ = std::move(message);
}

Errc Complaints::code() const {
  for (const int code : kSystemFailures)
    if (first_.contains(errno_text(code))) return Errc::io;
  for (const char* const of_sqlite : {"SQLite error", "disk I/O error"})
    if (first_.contains(of_sqlite)) return Errc::io;
  return Errc::bad_data;
}

std::string Complaints::text(const std::string& otherwise) const {
  return first_.empty() ? otherwise : first_;
}

std::unexpected<Error> Complaints::no_pixels() const {
  return fail(Errc::io, "its pixels cannot be read, it may be cut off: " + text("unreadable"));
}

}  // namespace tind::gdal
