#include "terrain/base/temporary_folder.h"

#include <cerrno>
#include <cstdlib>
#include <filesystem>
#include <utility>

#include "terrain/base/errno_text.h"

namespace tind {

namespace fs = std::filesystem;

Result<TemporaryFolder> TemporaryFolder::make(const std::string& purpose) {
  std::error_code error;
  const fs::path above = fs::temp_directory_path(error);
  std::string path =
      ((error ? fs::path("/tmp") : above) / ("tind-" + purpose + "-XXXXXX")).string();
  if (!::mkdtemp(path.data()))
    return fail(Errc::io, "cannot make a folder " + path + ": " + errno_text(errno));
  return TemporaryFolder(std::move(path));
}

TemporaryFolder::TemporaryFolder(TemporaryFolder&& other) noexcept
    : path_(std::exchange(other.path_, {})) {}

TemporaryFolder::~TemporaryFolder() {
  std::error_code ignored;
  if (!path_.empty()) fs::remove_all(path_, ignored);
}

}  // namespace tind
