#include "terrain/store/folder/folder_contents.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <chrono>
#include <filesystem>
#include <map>
#include <ranges>
#include <set>

#include "terrain/base/file_io.h"
#include "terrain/base/folder_entries.h"
#include "terrain/base/hash.h"
#include "terrain/store/folder/folder_lock.h"

namespace tind::folder {

namespace fs = std::filesystem;

std::unexpected<Error> in_the_way(const std::string& path, const std::string& what) {
  return fail(Errc::invalid_argument,
              path + " " + what + ", and tind build did not make it: choose another directory");
}

std::unexpected<Error> cannot_look(const std::string& path, const std::error_code& error) {
  return fail(Errc::io, "cannot look into " + path + ": " + error.message());
}

Result<fs::file_type> type_of(const std::string& path) {
  std::error_code error;
  const auto type = fs::symlink_status(path, error).type();
  if (type == fs::file_type::none) return cannot_look(path, error);
  return type;
}

namespace {

constexpr std::size_t kMark = 8;  // as long as any by which our files begin

bool all_of_hex(std::string_view text, std::size_t digits) {
  return text.size() == digits &&
         text.find_first_not_of("0123456789abcdef") == std::string_view::npos;
}

/// As std::to_string writes it.
std::optional<std::int64_t> whole_number(const std::string& text) {
  std::int64_t value = 0;
  const auto [end, code] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (code != std::errc() || end != text.data() + text.size() || std::to_string(value) != text)
    return std::nullopt;
  return value;
}

/// 32 digits; earlier versions had 16.
bool is_partial_name(const fs::path& path) {
  const std::string name = path.filename().string();
  return all_of_hex(name, 32) || all_of_hex(name, 16);
}

/// Differs from that of every other writer, on this host and others.
std::uint64_t writer_number() {
  static std::atomic<std::uint64_t> writers = 0;
  std::array<char, 256> host{};
  if (::gethostname(host.data(), host.size() - 1) != 0) host = {"?"};
  const auto now = std::chrono::system_clock::now().time_since_epoch().count();
  return hash64(fmt::format("{} {} {} {}", host.data(), ::getpid(), now, writers++));
}

/// Our files beside the tiles.
Result<void> check_names(const std::string& folder, bool claimed) {
  const std::map<std::string, std::string> beginnings = {
      {kRecord, ""},
      {kLayer, ""},
      {kLedger, "tindTLG\n"},
      {kResiduals, "tindRIX\n"},
      {std::string(kResiduals) + ".part", "tindRIX\n"}};
  for (const auto& [name, beginning] : beginnings) {
    const std::string path = folder + name;
    const auto type = type_of(path);
    if (!type) return std::unexpected(type.error());
    if (*type == fs::file_type::not_found) continue;
    if (*type != fs::file_type::regular) return in_the_way(path, "is not a file");
    if (claimed) continue;
    const auto begins = read_beginning(path, kMark);
    if (!begins) return std::unexpected(begins.error());
    if (*begins != beginning) return in_the_way(path, "is there");
  }
  for (const char* name : {kPartial, kAside, kReady}) {
    const std::string path = folder + name;
    const auto type = type_of(path);
    if (!type) return std::unexpected(type.error());
    if (*type == fs::file_type::not_found) continue;
    if (*type != fs::file_type::directory) return in_the_way(path, "is not a folder");
    if (!claimed && name != kPartial) return in_the_way(path, "is there");
  }
  return {};
}

}  // namespace

Result<bool> is_unclaimed(const std::string& folder, const std::string& record) {
  const auto entries = entries_of(folder);
  if (!entries) return std::unexpected(entries.error());
  return std::ranges::all_of(*entries, [&](const fs::directory_entry& entry) {
    const std::string name = entry.path().filename().string();
    return name == FolderLock::kName || "/" + finished_name(name) == record;
  });
}

bool is_level(const fs::path& name) {
  const auto level = whole_number(name.string());
  return level && *level >= 0 && *level <= tiling::kMaxLevel;
}

bool is_own_name(const std::string& name, const std::string& digest) {
  static const std::set<std::string> kOwn = {kRecord,  kLedger, kLayer, kResiduals,
                                             kPartial, kAside,  kReady, "/tind-lock"};
  return is_level(name) || kOwn.contains("/" + name) || "/" + name == kBlocks + digest ||
         name == "3dtiles" || name.starts_with("3dtiles-");  // of tiles that lie here
}

Result<bool> is_blocks(const std::string& path) {
  const std::string name = "/" + fs::path(path).filename().string();
  if (!name.starts_with(kBlocks) ||
      !all_of_hex(std::string_view(name).substr(std::string_view(kBlocks).size()), 32))
    return false;
  const auto type = type_of(path);
  if (!type) return std::unexpected(type.error());
  if (*type != fs::file_type::regular) return false;
  const auto begins = read_beginning(path, kMark);
  if (!begins && begins.error().code == Errc::not_found) return false;  // it went away just now
  if (!begins) return std::unexpected(begins.error());
  return begins->starts_with("TNSB");
}

std::string tile_path(const std::string& folder, TileId id) {
  return folder + "/" + id.text() + kTileSuffix;
}

std::optional<TileId> tile_of_path(const fs::path& relative) {
  std::vector<std::string> parts;
  for (const auto& part : relative) parts.push_back(part.string());
  if (parts.size() != 3 || relative.extension() != kTileSuffix) return std::nullopt;
  const auto z = whole_number(parts[0]), x = whole_number(parts[1]);
  const auto y = whole_number(relative.stem().string());
  if (!z || !x || !y) return std::nullopt;
  return tiling::tile(*z, *x, *y);
}

Result<void> check_way(const std::string& folder, const TileOrder& ids, bool claimed,
                       const std::function<bool(TileId)>& own) {
  if (auto ok = check_names(folder, claimed); !ok) return ok;
  std::map<std::string, bool> there;  // folders that were looked at
  const auto folder_there = [&](const std::string& path) -> Result<bool> {
    if (const auto it = there.find(path); it != there.end()) return it->second;
    const auto type = type_of(path);
    if (!type) return std::unexpected(type.error());
    if (*type != fs::file_type::not_found && *type != fs::file_type::directory)
      return in_the_way(path, "is in the place of a folder of tiles");
    return there[path] = *type == fs::file_type::directory;
  };
  for (std::size_t k = 0; k < ids.size(); ++k) {
    const TileId id = ids[k];
    const std::string level = folder + "/" + std::to_string(id.level);
    auto parent = folder_there(level);
    if (parent && *parent) parent = folder_there(level + "/" + std::to_string(id.x));
    if (!parent) return std::unexpected(parent.error());
    if (!*parent) continue;
    const std::string path = tile_path(folder, id);
    const auto type = type_of(path);
    if (!type) return std::unexpected(type.error());
    if (*type == fs::file_type::not_found || (*type == fs::file_type::regular && own(id))) continue;
    return in_the_way(path, "is in the place of a tile");
  }
  return {};
}

Result<void> check_blocks(const std::string& folder, const std::string& digest, bool named) {
  const std::string path = folder + kBlocks + digest;
  const auto type = type_of(path);
  if (!type) return std::unexpected(type.error());
  if (*type == fs::file_type::not_found) return {};
  if (*type != fs::file_type::regular) return in_the_way(path, "is not a file");
  if (named) return {};
  const auto blocks = is_blocks(path);
  if (!blocks) return std::unexpected(blocks.error());
  if (!*blocks) return in_the_way(path, "is there");
  return {};
}

Result<void> check_partial(const std::string& folder, bool began) {
  const std::string partial = folder + kPartial;
  const auto there = type_of(partial);
  if (!there) return std::unexpected(there.error());
  if (*there != fs::file_type::directory) return {};
  const auto entries = entries_of(partial);
  if (!entries) return std::unexpected(entries.error());
  for (const fs::directory_entry& entry : *entries) {
    if (!is_partial_name(entry.path())) continue;
    const std::string path = entry.path().string();
    const auto type = type_of(path);
    if (!type) return std::unexpected(type.error());
    if (!began || *type != fs::file_type::regular) return in_the_way(path, "is there");
  }
  return {};
}

Result<void> check_places(const std::string& folder, const std::vector<std::string>& files) {
  std::set<std::string> folders;
  for (const std::string& file : files) {
    for (auto end = file.find('/', 1); end != file.npos; end = file.find('/', end + 1))
      folders.insert(folder + file.substr(0, end));
    const auto type = type_of(folder + file);
    if (!type) return std::unexpected(type.error());
    if (*type == fs::file_type::not_found) continue;
    if (*type != fs::file_type::regular) return in_the_way(folder + file, "is not a file");
    if (!file.starts_with(kBlocks)) continue;
    const auto blocks = is_blocks(folder + file);
    if (!blocks) return std::unexpected(blocks.error());
    if (!*blocks) return in_the_way(folder + file, "is there");
  }
  for (const std::string& path : folders) {
    const auto type = type_of(path);
    if (!type) return std::unexpected(type.error());
    if (*type != fs::file_type::not_found && *type != fs::file_type::directory)
      return in_the_way(path, "is in the place of a folder of tiles");
  }
  return {};
}

void remove_empty_folders(const std::string& folder, const std::vector<std::string>& files) {
  const std::string below = folder.ends_with('/') ? folder : folder + "/";
  std::set<std::string> seen;
  for (const std::string& file : files)
    for (fs::path at = fs::path(file).parent_path();
         at.string().starts_with(below) && seen.insert(at.string()).second; at = at.parent_path()) {
    }
  for (const std::string& path : seen | std::views::reverse)
    ::rmdir(path.c_str());  // deepest first
}

Result<void> remove_tiles(FolderFiles& files, const std::string& folder, const TileLedger& ledger,
                          const std::function<bool(TileId)>& gone) {
  const auto remove_if_empty = [&](const std::string& path) -> Result<void> {
    std::error_code error;  // then it stays, which harms nobody
    const auto type = type_of(path);
    if (!type) return std::unexpected(type.error());
    if (*type != fs::file_type::directory || !fs::is_empty(path, error) || error) return {};
    return files.remove(path);
  };
  for (std::size_t z = 0; z < ledger.levels().size(); ++z) {
    const std::string level = folder + "/" + std::to_string(z);
    const auto level_type = type_of(level);
    if (!level_type) return std::unexpected(level_type.error());
    if (*level_type != fs::file_type::directory) continue;
    for (const proto::TileRange& r : ledger.levels()[z])
      for (std::uint64_t x = r.start_x; x <= r.end_x; ++x) {
        const std::string column = level + "/" + std::to_string(x);
        const auto column_type = type_of(column);
        if (!column_type) return std::unexpected(column_type.error());
        if (*column_type != fs::file_type::directory) continue;
        for (std::uint64_t y = r.start_y; y <= r.end_y; ++y) {
          const TileId id{int(z), std::uint32_t(x), std::uint32_t(y)};
          if (!gone(id)) continue;
          const std::string tile = tile_path(folder, id);
          const auto type = type_of(tile);
          if (!type) return std::unexpected(type.error());
          if (*type != fs::file_type::regular) continue;
          if (auto done = files.remove(tile); !done) return done;
        }
        if (auto done = remove_if_empty(column); !done) return done;
      }
    if (auto done = remove_if_empty(level); !done) return done;
  }
  return {};
}

Result<void> remove_other_blocks(FolderFiles& files, const std::string& folder,
                                 const std::string& digest) {
  const auto entries = entries_of(folder);
  if (!entries) return std::unexpected(entries.error());
  for (const fs::directory_entry& entry : *entries) {
    const std::string path = entry.path().string();
    if (path == folder + kBlocks + digest) continue;
    const auto others = is_blocks(path);
    if (!others) return std::unexpected(others.error());
    if (!*others) continue;
    if (auto done = files.remove(path); !done) return done;
  }
  return {};
}

PartialPaths::PartialPaths(const std::string& folder)
    : begin_(folder + kPartial + fmt::format("/{:016x}", writer_number())) {}

std::string PartialPaths::next() { return begin_ + fmt::format("{:016x}", count_++); }

Result<void> remove_partial_files(FolderFiles& files, const std::string& folder) {
  const std::string partial = folder + kPartial;
  const auto there = type_of(partial);
  if (!there) return std::unexpected(there.error());
  if (*there != fs::file_type::directory) return {};
  const auto entries = entries_of(partial);
  if (!entries) return std::unexpected(entries.error());
  for (const fs::directory_entry& entry : *entries) {
    const std::string path = entry.path().string();
    if (!is_partial_name(entry.path())) continue;
    const auto type = type_of(path);
    if (!type) return std::unexpected(type.error());
    if (*type != fs::file_type::regular) continue;
    if (auto done = files.remove(path); !done) return done;
  }
  std::error_code error;
  if (!fs::is_empty(partial, error) || error) return {};
  return files.remove(partial);
}

}  // namespace tind::folder
