#pragma once
// How much memory this process took.

#include <cstdlib>
#include <fstream>
#include <string>

namespace tind::cli {

/// The system's account of this process's largest memory since the last `forget`, in MB.
class PeakMemory {
 public:
  static void forget() { std::ofstream("/proc/self/clear_refs") << "5"; }
  static double megabytes() {
    std::ifstream status("/proc/self/status");
    for (std::string line; std::getline(status, line);)
      if (line.starts_with("VmHWM:")) return std::strtod(line.c_str() + 6, nullptr) / 1024;
    return 0;
  }
};

}  // namespace tind::cli
