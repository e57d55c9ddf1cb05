#include "server/services/jobs/job_folders.h"

#include <spdlog/spdlog.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <ctime>
#include <filesystem>

#include "server/log/printable.h"
#include "terrain/base/errno_text.h"
#include "terrain/base/folder_entries.h"
#include "terrain/store/folder/folder_files.h"

namespace tind::services {
namespace {

namespace fs = std::filesystem;

constexpr const char* kTemporary = "tind-jobs-";

void remove_leftovers(const fs::path& among) {
  std::error_code error;
  for (fs::directory_iterator entry(among, error), last; !error && entry != last;
       entry.increment(error)) {
    const std::string folder = entry->path().string(), list = list_in(folder);
    struct stat facts {};
    if (!entry->path().filename().string().starts_with(kTemporary) ||
        ::lstat(folder.c_str(), &facts) != 0 || !S_ISDIR(facts.st_mode) ||
        facts.st_uid != ::geteuid() || ::lstat(list.c_str(), &facts) != 0 ||
        !S_ISREG(facts.st_mode) || ::time(nullptr) - facts.st_mtime < 60)
      continue;
    if (!JobStore::open(list)) continue;  // somebody has it
    std::error_code ignored;
    fs::remove_all(folder, ignored);
  }
}

}  // namespace

std::string list_in(const std::string& folder) { return folder + "/jobs.sqlite"; }

Result<std::string> make_jobs_folder(const std::string& folder) {
  std::error_code error;
  if (fs::create_directories(folder, error))
    fs::permissions(folder, fs::perms::owner_all, fs::perm_options::replace, error);
  if (error) return fail(Errc::io, folder + ": " + error.message());
  if (::access(folder.c_str(), R_OK | W_OK | X_OK) != 0)
    return fail(Errc::io, folder + ": " + errno_text(errno));
  return fs::absolute(folder).string();
}

Result<std::string> make_temporary_jobs_folder() {
  std::error_code error;
  const fs::path temporary = fs::temp_directory_path(error);
  std::string pattern = (temporary / (kTemporary + std::string("XXXXXX"))).string();
  remove_leftovers(temporary);
  const auto cannot = [](const std::string& why) {
    return fail(Errc::io, "no folder for jobs can be made among the temporary ones: " + why +
                              "; name one (jobs-dir)");
  };
  if (error) return cannot(error.message());
  if (!::mkdtemp(pattern.data())) return cannot(temporary.string() + ": " + errno_text(errno));
  return pattern;
}

void remove_unknown_jobs(const std::string& folder, const JobStore& list) {
  std::error_code error, ignored;
  for (fs::directory_iterator entry(folder, error), last; !error && entry != last;
       entry.increment(error)) {
    const std::string name = entry->path().filename().string();
    const bool is_id = name.size() == 32 && name.find_first_not_of("0123456789abcdef") == name.npos;
    if (!is_id || !fs::is_directory(entry->symlink_status(ignored))) continue;
    const auto known = list.find(name);
    if (!known || *known) continue;
    const std::string path = logging::printable(entry->path().string());
    if (list.is_new()) {
      spdlog::warn("{}: the list of jobs is new and does not know it; it stays", path);
      continue;
    }
    fs::remove_all(entry->path(), ignored);
    spdlog::info("{}: of a job that is on the list no more; removed", path);
  }
}

Result<void> sync_results(const std::string& folder) {
  FolderFiles files;
  const auto entries = entries_below(folder);
  if (!entries) return std::unexpected(entries.error());
  std::error_code error;
  for (const fs::directory_entry& entry : *entries) {
    const std::string path = entry.path().string();
    if (entry.is_symlink(error)) continue;
    if (entry.is_directory(error)) {
      if (auto done = files.sync_folder(path); !done) return done;
    } else if (entry.is_regular_file(error)) {
      if (auto done = files.sync_file(path); !done) return done;
    }
  }
  if (error) return fail(Errc::io, folder + ": " + error.message());
  if (auto done = files.sync_folder(folder); !done) return done;
  return files.sync_folder(fs::path(folder).parent_path().string());
}

Result<std::uint64_t> bytes_in(const std::string& folder) {
  const auto entries = entries_of(folder);
  if (!entries) return std::unexpected(entries.error());
  std::uint64_t sum = 0;
  std::error_code error;
  for (const fs::directory_entry& file : *entries) {
    if (file.is_regular_file(error)) sum += file.file_size(error);
    if (error) return fail(Errc::io, file.path().string() + ": " + error.message());
  }
  return sum;
}

}  // namespace tind::services
