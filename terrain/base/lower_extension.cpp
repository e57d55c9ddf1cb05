#include "terrain/base/lower_extension.h"

#include <filesystem>

#include "terrain/base/lower_case.h"

namespace tind {

std::string lower_extension(const std::string& path) {
  return lower_case(std::filesystem::path(path).extension().string());
}

}  // namespace tind
