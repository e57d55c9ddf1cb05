#pragma once
// Where PROJ looks for its database and grids.

#include <string>
#include <vector>

namespace tind::gdal {

std::vector<std::string> places_of_proj();

}  // namespace tind::gdal
