#include "terrain/store/folder/folder_within.h"

#include <algorithm>
#include <filesystem>
#include <system_error>

#include "terrain/base/file_there.h"
#include "terrain/store/folder/folder_contents.h"

namespace tind::folder {

namespace fs = std::filesystem;

namespace {

/// One spelling for all names of it. Of one that is not there, too: where nothing of a name is, it
/// would else stay relative.
Result<fs::path> real_path(const std::string& path) {
  std::error_code error;
  const fs::path whole = fs::absolute(path, error);
  if (error) return cannot_look(path, error);
  fs::path real = fs::weakly_canonical(whole, error);
  if (error) return cannot_look(path, error);
  return real;
}

}  // namespace

Result<bool> lies_within(const std::string& path, const std::string& folder) {
  const auto type = file_type_of(folder);
  if (!type) return std::unexpected(type.error());
  if (*type != fs::file_type::directory) return false;
  const auto outer = real_path(folder), inner = real_path(path);
  for (const auto* const one : {&outer, &inner})
    if (!*one) return std::unexpected(one->error());
  return std::ranges::mismatch(*inner, *outer).in2 == outer->end();
}

Result<void> lies_in_no_level(const std::string& folder) {
  const auto real = real_path(folder);
  if (!real) return std::unexpected(real.error());
  for (fs::path below = *real, above; below.has_relative_path(); below = above) {
    above = below.parent_path();
    if (!is_level(below.filename())) continue;
    const auto ledger = is_there(above.string() + kLedger);
    if (!ledger) return std::unexpected(ledger.error());
    if (*ledger)
      return fail(Errc::invalid_argument,
                  folder + " is, or lies in, a level of " + above.string() +
                      ", the folder of a tile set (it has a ledger, tind-tiles.ledger), which "
                      "would not be whole with files of another's: choose another directory");
  }
  return {};
}

}  // namespace tind::folder
