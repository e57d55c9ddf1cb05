#include "terrain/base/existing_file.h"

#include "terrain/base/file_there.h"

namespace tind {

Result<void> check_exists(const std::string& path) {
  const auto there = is_there(path);
  if (!there) return std::unexpected(there.error());
  if (*there) return {};
  return fail(Errc::not_found, path + ": no such file");
}

Result<void> check_is_file(const std::string& path) {
  using Type = std::filesystem::file_type;
  const auto type = file_type_of(path);
  if (!type) return std::unexpected(type.error());
  if (*type == Type::not_found) return fail(Errc::not_found, path + ": no such file");
  if (*type == Type::regular || *type == Type::directory) return {};
  return fail(Errc::bad_data, path + ": is a device or a pipe; it is read from a file");
}

}  // namespace tind
