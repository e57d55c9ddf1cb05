#pragma once
// What lies under a name. Who takes what cannot be told for nothing writes over somebody's file.

#include <filesystem>
#include <string>
#include <system_error>

#include "terrain/base/result.h"

namespace tind {

/// Links are followed; not_found where there is nothing. Fails (io) where it cannot be told.
inline Result<std::filesystem::file_type> file_type_of(const std::string& path) {
  std::error_code error;
  const auto type = std::filesystem::status(path, error).type();
  if (type != std::filesystem::file_type::none) return type;
  if (error == std::errc::filename_too_long) return std::filesystem::file_type::not_found;
  return fail(Errc::io, "cannot look into " + path + ": " + error.message());
}

/// Is there anything? Fails (io) where it cannot be told.
inline Result<bool> is_there(const std::string& path) {
  const auto type = file_type_of(path);
  if (!type) return std::unexpected(type.error());
  return *type != std::filesystem::file_type::not_found;
}

}  // namespace tind
