#include "terrain/base/same_file.h"

#include <sys/stat.h>

#include <cerrno>

#include "terrain/base/errno_text.h"

namespace tind {

Result<bool> is_still_at(int file, const std::string& path) {
  struct stat open {
  }, named{};
  const bool known = ::fstat(file, &open) == 0;
  const bool there = known && ::lstat(path.c_str(), &named) == 0;
  if (!known || (!there && errno != ENOENT))
    return fail(Errc::io, "cannot look at " + path + ": " + errno_text(errno));
  return there && open.st_dev == named.st_dev && open.st_ino == named.st_ino;
}

}  // namespace tind
