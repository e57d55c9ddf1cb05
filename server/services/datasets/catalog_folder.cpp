#include "server/services/datasets/catalog_folder.h"

#include <fmt/format.h>
#include <sys/stat.h>

#include <algorithm>
#include <cerrno>
#include <filesystem>
#include <set>
#include <thread>

#include "server/services/datasets/dataset_file.h"
#include "server/services/datasets/dataset_settings.h"
#include "terrain/base/caught.h"
#include "terrain/base/errno_text.h"
#include "terrain/base/file_there.h"
#include "terrain/base/folder_entries.h"
#include "terrain/base/lower_extension.h"
#include "terrain/dataset/dataset.h"
#include "terrain/raster/dem_files.h"
#include "terrain/raster/file_state.h"
#include "terrain/surface/surface.h"

namespace tind::services {
namespace {

namespace fs = std::filesystem;

/// Of files that say something about another one of the same name.
const std::set<std::string, std::less<>> kBesideOthers = {".prj",         ".qpj",
                                                          ".hdr",         ".tfw",
                                                          ".pgw",         ".wld",
                                                          ".blw",         ".clr",
                                                          ".stx",         ".ovr",
                                                          ".msk",         ".xml",
                                                          ".rrd",         ".ige",
                                                          ".cpg",         ".txt",
                                                          ".md",          ".json",
                                                          ".lock",        ".pgm",
                                                          ".gtx",  // geoids
                                                          ".tind-part",   ".mbtiles-journal",
                                                          ".mbtiles-wal", ".mbtiles-shm"};

bool is_passed_over(const fs::path& path) {
  const std::string name = path.filename().string();
  const std::string extension = lower_extension(path.string());
  if (name.starts_with('.') || name.ends_with('~')) return true;
  std::error_code error;
  return kBesideOthers.contains(extension) && !fs::is_directory(path, error);
}

/// What lies in a folder, by name.
Result<std::vector<fs::path>> paths_by_name(const std::string& folder) {
  const auto entries = entries_of(folder);
  if (!entries) return std::unexpected(entries.error());
  std::vector<fs::path> paths;
  for (const fs::directory_entry& entry : *entries) paths.push_back(entry.path());
  std::ranges::sort(paths);
  return paths;
}

std::string state_of(const std::string& path, const FileState& state) {
  // With the inode's own time: who gives the right to read a file has it tried again.
  return fmt::format("{} {} {} {} {} {}\n", path, state.device, state.inode, state.size,
                     state.written_ns, state.changed_ns);
}

/// Gathers the states of an entry's files, and whether all were last written to a while ago.
struct States {
  std::string text;
  std::size_t of_table = 0;  // bytes at its beginning
  std::int64_t last_written_ns = 0;

  void add(const std::string& path) {
    const auto state = file_state(path);
    if (!state) {
      text += path + " is not there\n";
      return;
    }
    text += state_of(path, *state);
    last_written_ns = std::max(last_written_ns, state->written_ns);
  }
};

/// Any file passes for raw numbers. One that somebody else put a link to may be one that he cannot
/// read himself, as heights for everybody.
Result<bool> is_raw_link_out(const fs::path& path, const fs::path& catalog) {
  if (!is_raw_raster(path.string())) return false;
  std::error_code error;
  const fs::path target = fs::canonical(path, error);
  if (error == std::errc::no_such_file_or_directory) return true;  // a link to nothing
  const fs::path folder = error ? fs::path() : fs::canonical(catalog, error);
  if (error) return fail(Errc::io, "cannot look into " + path.string() + ": " + error.message());
  return *target.lexically_relative(folder).begin() == "..";
}

constexpr const char* kRawLink =
    ": a link to raw numbers elsewhere; name them in a table, or put the file itself here";

void leave(FolderEntry& entry, const Error& why) {
  entry.wrong = why.what;
  entry.unread = may_pass(why);
}

void refuse_raw_link(FolderEntry& entry, const std::string& path, const fs::path& catalog) {
  const auto leads_out = is_raw_link_out(path, catalog);
  if (!leads_out) return leave(entry, leads_out.error());
  if (*leads_out) entry.wrong = path + kRawLink;
}

/// A folder of tiles, or of rasters, which are one dataset.
void look_into_folder(FolderEntry& entry, States& states, const fs::path& catalog) {
  std::error_code error;
  const auto tiles = is_there(entry.path + "/layer.json");
  if (!tiles) return leave(entry, tiles.error());
  if (*tiles) {
    states.add(entry.path + "/layer.json");
    entry.spec.files = {entry.path};
    return;
  }
  const auto inside = paths_by_name(entry.path);
  if (!inside) return leave(entry, inside.error());
  for (const fs::path& path : *inside)
    if (fs::is_regular_file(path, error) && !path.filename().string().starts_with('.'))
      states.add(path.string());
  entry.spec.files = {entry.path};
  const auto rasters = dem_files(std::vector{entry.path}, {.allow_vrt = true});
  if (!rasters) return leave(entry, rasters.error());
  for (const std::string& path : rasters->files) refuse_raw_link(entry, path, catalog);
}

void look_into_table(FolderEntry& entry, States& states, CatalogTables& tables) {
  states.add(entry.path);
  states.of_table = states.text.size();
  const Result<DatasetSpec>& spec = tables.read(entry.path, entry.spec.name);
  const auto files = spec ? files_of(*spec) : std::unexpected(spec.error());
  if (!files) {
    entry.wrong = files.error().what;
    return;
  }
  entry.spec = *spec;
  std::error_code error;
  for (const std::string& file : *files)
    if (fs::is_regular_file(file, error) || !fs::exists(file, error)) states.add(file);
  for (const std::string& file : named_files({}, entry.spec.own)) states.add(file);
}

/// Those beside a raster that say more of it. One that comes later makes it another raster; it may
/// be one then that could not be opened before.
void add_beside(const fs::path& raster, States& states) {
  std::error_code error;
  for (const char* const end : {".prj", ".qpj", ".hdr", ".tfw", ".pgw", ".blw", ".wld", ".msk"}) {
    const std::string whole = raster.string() + end;
    const std::string instead = fs::path(raster).replace_extension(end).string();
    for (const std::string& beside : {whole, instead})
      if (beside != raster.string() && fs::is_regular_file(beside, error)) states.add(beside);
  }
}

/// What it is, as far as the file system tells.
FolderEntry entry_at(const fs::path& path, States& states, CatalogTables& tables) {
  const fs::path catalog = path.parent_path();
  FolderEntry entry{
      .path = path.string(), .spec = {}, .state = {}, .content = {}, .rests = false, .wrong = {}};
  const auto type = file_type_of(entry.path);
  const bool is_folder = type && *type == fs::file_type::directory;
  entry.spec.name = safe_name(is_folder ? path.filename().string() : name_of_file(path.string()));
  if (!type) {
    leave(entry, type.error());
  } else if (is_folder) {
    look_into_folder(entry, states, catalog);
  } else if (*type != fs::file_type::regular) {
    entry.wrong = entry.path + ": is neither a file nor a folder";
  } else if (path.extension() == ".toml") {
    entry.is_table = true;
    look_into_table(entry, states, tables);
  } else {
    states.add(entry.path);
    add_beside(path, states);
    entry.spec.files = {entry.path};
    refuse_raw_link(entry, entry.path, catalog);
  }
  return entry;
}

/// By the system's clock; a time in the future (another machine's clock) is not long ago.
bool written_long_ago(std::int64_t written_ns) {
  using namespace std::chrono;
  const auto now = system_clock::now().time_since_epoch();
  return nanoseconds(written_ns) + CatalogFolder::kRest <= now;
}

}  // namespace

const Result<DatasetSpec>& CatalogTables::read(const std::string& file, const std::string& name) {
  const auto now = file_state(file);
  const std::string state = now ? state_of(file, *now) : std::string();
  auto found = read_.find(file);
  // What was wrong may have been a file that it names and that is there by now.
  if (found != read_.end() && !state.empty() && found->second.state == state && found->second.spec)
    return found->second.spec;
  return read_.insert_or_assign(file, Read{state, read_dataset_file(file, name)})
      .first->second.spec;
}

Result<CatalogFolder::Place> CatalogFolder::place() const {
  struct stat is {};
  if (::stat(folder_.c_str(), &is) == 0) return Place{is.st_dev, is.st_ino};
  return fail(errno == ENOENT ? Errc::not_found : Errc::io,
              "cannot look into " + folder_ + ": " + errno_text(errno));
}

Result<std::vector<FolderEntry>> CatalogFolder::look(bool tables_rest, Clock::time_point now) {
  const auto begun = place();
  if (!begun) return std::unexpected(begun.error());
  const auto paths = paths_by_name(folder_);
  if (!paths) return std::unexpected(paths.error());
  std::vector<FolderEntry> entries;
  std::map<std::string, Seen> seen;
  for (const fs::path& path : *paths) {
    if (is_passed_over(path)) continue;
    States states;
    FolderEntry entry = entry_at(path, states, tables_);
    entry.content = states.text.substr(states.of_table);
    entry.state = std::move(states.text);
    const auto before = seen_.find(entry.path);
    const bool same = before != seen_.end() && before->second.state == entry.state;
    const auto since = same ? before->second.since
                       : before == seen_.end() && written_long_ago(states.last_written_ns)
                           ? now - kRest
                           : now;
    entry.rests = now - since >= kRest || (tables_rest && entry.is_table);
    seen[entry.path] = {entry.state, since};
    entries.push_back(std::move(entry));
  }
  // A folder that went away meanwhile makes all that was in it look lost.
  if (auto there = paths_by_name(folder_); !there) return std::unexpected(there.error());
  // So does the empty one below a disk that is not mounted any more.
  const auto ended = place();
  if (!ended) return std::unexpected(ended.error());
  if (*begun != *ended)
    return fail(Errc::io, folder_ + ": became another folder while it was looked into");
  if (entries.empty() && place_ && *place_ != *ended)
    return fail(Errc::io, folder_ +
                              ": is another folder than before, and empty: is its disk not "
                              "mounted? What is served stays; a restart takes it as it is");
  if (!entries.empty()) place_ = *ended;
  seen_ = std::move(seen);
  return entries;
}

Result<void> stays_in_catalog(const Dataset& dataset, const std::string& catalog) {
  if (!dataset.source) return {};
  for (const std::string& file : dataset.source->info().files) {
    const auto leads_out = is_raw_link_out(file, catalog);
    if (!leads_out) return std::unexpected(leads_out.error());
    if (*leads_out) return fail(Errc::bad_data, file + kRawLink);
  }
  return dataset.unchanged ? dataset.unchanged() : Result<void>();
}

void wait_for_rest(const std::string& folder, std::chrono::milliseconds most) {
  const auto end = std::chrono::steady_clock::now() + most;
  CatalogTables tables;
  const auto rests = [&] {
    const auto paths = paths_by_name(folder);
    return !paths || std::ranges::all_of(*paths, [&](const fs::path& path) {
      States states;
      if (!is_passed_over(path)) entry_at(path, states, tables);
      return written_long_ago(states.last_written_ns);
    });
  };
  while (!rests() && std::chrono::steady_clock::now() < end)
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
}

}  // namespace tind::services
