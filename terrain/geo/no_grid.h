#pragma once
// Why GeographicLib did not read the grid of a geoid.

#include <fcntl.h>

#include <cerrno>
#include <string>

#include "terrain/base/descriptor.h"
#include "terrain/base/errno_text.h"
#include "terrain/base/result.h"
#include "terrain/base/whole_io.h"

namespace tind {

/// io, where the file cannot be read; else bad_data, with `otherwise`.
inline std::unexpected<Error> no_grid(const std::string& path, const std::string& otherwise) {
  const Descriptor file(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK));
  const int code = file.get() < 0 ? errno : read_to_end(file.get());
  if (code == 0) return fail(Errc::bad_data, otherwise);
  return fail(Errc::io, "cannot read the geoid grid " + path + ": " + errno_text(code));
}

}  // namespace tind
