#include "terrain/base/existing_file.h"

#include <filesystem>

namespace tind {

Result<void> check_exists(const std::string& path) {
  std::error_code error;
  if (std::filesystem::exists(path, error)) return {};
  return fail(Errc::not_found, path + ": " + (error ? error.message() : "no such file"));
}

}  // namespace tind
