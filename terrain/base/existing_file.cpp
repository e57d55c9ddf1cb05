#include "terrain/base/existing_file.h"

#include "terrain/base/file_there.h"

namespace tind {

Result<void> check_exists(const std::string& path) {
  const auto there = is_there(path);
  if (!there) return std::unexpected(there.error());
  if (*there) return {};
  return fail(Errc::not_found, path + ": no such file");
}

}  // namespace tind
