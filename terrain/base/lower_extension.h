#pragma once
// What a file's name says of its format.

#include <string>

namespace tind {

/// ".tif" of "a/DEM.TIF"; empty where the name has no ending.
std::string lower_extension(const std::string& path);

}  // namespace tind
