#pragma once
// Where the program's data are: the geoid grid and the viewer.

#include <string>

namespace tind::cli {

/// $TIND_DATA; without it share/tind beside the folder of the program, as it is installed and in
/// the build tree.
std::string data_dir();

}  // namespace tind::cli
