#include "server/cli/program/data_dir.h"

#include <cstdlib>
#include <filesystem>

namespace tind::cli {

std::string data_dir() {
  if (const char* const data = std::getenv("TIND_DATA"); data && *data) return data;
  std::error_code error;
  const auto program = std::filesystem::read_symlink("/proc/self/exe", error);
  return (program.parent_path().parent_path() / "share/tind").string();
}

}  // namespace tind::cli
