#include "terrain/base/folder_entries.h"

namespace tind {

namespace fs = std::filesystem;

namespace {

template <class Iterator>
Result<std::vector<fs::directory_entry>> all_of(const std::string& folder) {
  std::vector<fs::directory_entry> entries;
  std::error_code error;
  Iterator at(folder, error);
  for (; !error && at != Iterator(); at.increment(error)) entries.push_back(*at);
  if (error)
    return fail(error == std::errc::no_such_file_or_directory ? Errc::not_found : Errc::io,
                "cannot look into " + folder + ": " + error.message());
  return entries;
}

}  // namespace

Result<std::vector<fs::directory_entry>> entries_of(const std::string& folder) {
  return all_of<fs::directory_iterator>(folder);
}

Result<std::vector<fs::directory_entry>> entries_below(const std::string& folder) {
  return all_of<fs::recursive_directory_iterator>(folder);
}

}  // namespace tind
