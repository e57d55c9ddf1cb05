#pragma once
// A raster of the globe, of areas of ten degrees: bytes of one value.

#include <fstream>
#include <string>

#include "tests/support/support.h"

namespace tind::test {

inline std::string globe_raster(const TempDir& folder, char value) {
  std::ofstream(folder.file("globe.prj"))
      << R"(GEOGCS["WGS 84",DATUM["WGS_1984",SPHEROID["WGS 84",6378137,298.257223563]],)"
         R"(PRIMEM["Greenwich",0],UNIT["degree",0.0174532925199433]])";
  std::ofstream(folder.file("globe.hdr"))
      << "BYTEORDER I\nLAYOUT BIL\nNROWS 18\nNCOLS 36\nNBANDS 1\nNBITS 8\n"
         "ULXMAP -175\nULYMAP 85\nXDIM 10\nYDIM 10\n";
  std::ofstream(folder.file("globe.bil"), std::ios::binary) << std::string(18 * 36, value);
  return folder.file("globe.bil");
}

/// One of bytes in longitudes and latitudes, ten columns and rows: one value.
inline std::string place_raster(const TempDir& folder, const std::string& name, double west,
                                double north, double step, char value) {
  std::ofstream(folder.file(name + ".prj"))
      << R"(GEOGCS["WGS 84",DATUM["WGS_1984",SPHEROID["WGS 84",6378137,298.257223563]],)"
         R"(PRIMEM["Greenwich",0],UNIT["degree",0.0174532925199433]])";
  std::ofstream(folder.file(name + ".hdr"))
      << "BYTEORDER I\nLAYOUT BIL\nNROWS 10\nNCOLS 10\nNBANDS 1\nNBITS 8\nULXMAP "
      << west + step / 2 << "\nULYMAP " << north - step / 2 << "\nXDIM " << step << "\nYDIM "
      << step << '\n';
  std::ofstream(folder.file(name + ".bil"), std::ios::binary) << std::string(100, value);
  return folder.file(name + ".bil");
}

/// Longitudes around its first column, which is of -180 to -170, and elsewhere.
inline constexpr double kAroundTheGlobe[] = {-180, -179.9, -175.1, -174.9, 0, 175, 179.9, 180};

}  // namespace tind::test
