#pragma once
// Whether a file is there, and why not.

#include <string>

#include "terrain/base/result.h"

namespace tind {

/// Fails (not_found) with "PATH: no such file", or with why that cannot be known: a folder on the
/// way that may not be entered, links that go round in a circle, a name that is too long.
Result<void> check_exists(const std::string& path);

/// As check_exists(); fails (bad_data) for a device, a pipe or a socket, too, at which whoever
/// opens it may wait for ever.
Result<void> check_is_file(const std::string& path);

}  // namespace tind
