#pragma once
// An output that goes to standard output, for pipes: `tind simplify dem.tif -o - --format ply`.

#include <vector>

namespace tind::cli {

/// The line with /dev/stdout for each "-" that -o, --output or --report has. Where an output is
/// standard output, it has it alone: what the program prints goes to stderr from here on.
std::vector<const char*> give_standard_output(int argc, const char* const* argv);

}  // namespace tind::cli
