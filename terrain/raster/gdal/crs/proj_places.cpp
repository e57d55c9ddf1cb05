#include "terrain/raster/gdal/crs/proj_places.h"

#include <proj.h>

#include <sstream>

namespace tind::gdal {

std::vector<std::string> places_of_proj() {
  std::vector<std::string> folders;
  const char* const searched = proj_info().searchpath;
  std::istringstream all(searched ? searched : "");
  for (std::string one; std::getline(all, one, ':');)
    if (!one.empty()) folders.push_back(one);
  return folders;
}

}  // namespace tind::gdal
