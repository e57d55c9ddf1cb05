// A file says whose buckets lie here. It is there before the first of them. A bucket is whole when
// its .stg, written last, has the SHA-1 of the other file.

#include "terrain/flightgear/scenery_folder.h"

#include <algorithm>
#include <atomic>
#include <filesystem>
#include <functional>
#include <map>
#include <mutex>
#include <optional>
#include <set>
#include <span>
#include <sstream>
#include <string_view>
#include <system_error>

#include "terrain/base/file_io.h"
#include "terrain/base/folder_entries.h"
#include "terrain/base/parallel.h"
#include "terrain/base/sha1.h"
#include "terrain/flightgear/bucket.h"
#include "terrain/flightgear/cover_materials.h"
#include "terrain/store/folder/folder_contents.h"
#include "terrain/store/folder/folder_files.h"
#include "terrain/store/folder/folder_lock.h"
#include "terrain/store/folder/product_records.h"

namespace tind::flightgear {
namespace {

namespace fs = std::filesystem;

constexpr const char* kIndex = ".dirindex";
constexpr const char* kPartial = ".part";
constexpr const char* kTerrain = "Terrain";
constexpr int kTen = 10;  // degrees
/// Folders that TerraSync looks for; there is nothing of ours in them.
constexpr const char* kOthers[] = {"Airports", "Models", "Objects"};

std::string_view text_of(const std::vector<std::uint8_t>& bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

std::string record_of(const BucketPlan& plan, const LandCover* cover) {
  return "scenery made by tind build --format flightgear, of " + plan.digest() +
         (cover ? " " + digest_of(*cover) : "") + "\n";
}

/// Whose buckets lie here; nothing in a folder that is empty. not_found where there is none.
Result<std::optional<std::string>> record_in(const std::string& folder) {
  const auto fresh = folder::is_unclaimed(folder, kSceneryRecord);
  if (!fresh) return std::unexpected(fresh.error());
  if (*fresh) return std::nullopt;
  auto text = read_regular_file(folder + kSceneryRecord);
  // What cannot be read may be ours: only what is not there says that nothing is.
  if (!text && text.error().code != Errc::not_found) return std::unexpected(text.error());
  if (!text || !text->starts_with("scenery made by tind"))
    return fail(Errc::invalid_argument,
                folder +
                    " holds files that tind build --format flightgear did not make: move them, or "
                    "choose another directory");
  return std::optional(std::move(*text));
}

/// What an index says of the two files of a bucket.
using Entries = std::vector<proto::DirEntry>;

proto::DirEntry entry_of(std::string name, std::string_view bytes) {
  return {proto::DirEntry::file, std::move(name), sha1(bytes), bytes.size()};
}

// ---- what of a folder is ours ----

/// Fails where something else is there, a link included, or it cannot be told: who follows a link
/// takes for ours what lies behind it, and who does not leaves buckets of before there.
Result<bool> is_there(const std::string& path, fs::file_type wanted) {
  std::error_code error;
  const auto type = fs::symlink_status(path, error).type();
  if (type == fs::file_type::not_found) return false;
  if (type == fs::file_type::none) return folder::cannot_look(path, error);
  if (type == wanted) return true;
  return folder::in_the_way(path, wanted == fs::file_type::directory
                                      ? "is in the place of a folder of scenery"
                                      : "is in the place of a file of scenery");
}

/// "w130n40", in which there are folders of a degree.
bool is_of_ten(const std::string& name) {
  for (int lon = -180; lon < 180; lon += kTen)
    for (int lat = -90; lat < 90; lat += kTen)
      if (path_of(Folder{lon, lat}).starts_with(name + "/")) return true;
  return false;
}

using IsOurs = std::function<bool(const std::string& name)>;

/// Has it what an index of that folder begins with, and only such names? `torn`: its last line may
/// be cut off. There is nothing to lose of an empty one.
bool is_our_index(std::string text, const std::string& path, const IsOurs& is_ours, bool torn) {
  if (torn) text.resize(text.rfind('\n') + 1);  // npos + 1 is 0
  if (text.empty()) return true;
  const std::string head = proto::encode_dirindex(path, {});
  if (!text.starts_with(head)) return false;
  std::istringstream lines(text.substr(head.size()));
  for (std::string line; std::getline(lines, line);) {
    const std::size_t end = line.find(':', 2);
    if (end == line.npos || !is_ours(line.substr(2, end - 2))) return false;
  }
  return true;
}

/// Paths of what has one of our names in a folder that is there. By the listing: a look that fails
/// for a moment does not make a file one that is gone.
Result<std::vector<std::string>> ours_in(const std::string& folder, fs::file_type wanted,
                                         const IsOurs& is_ours) {
  const auto entries = entries_of(folder);
  if (!entries) return std::unexpected(entries.error());
  std::vector<std::string> paths;
  for (const fs::directory_entry& entry : *entries) {
    if (!is_ours(entry.path().filename().string())) continue;
    const std::string path = entry.path().string();
    const auto there = is_there(path, wanted);
    if (!there) return std::unexpected(there.error());
    if (!*there) return fail(Errc::io, "cannot look into " + path + ": it was listed and is gone");
    paths.push_back(path);
  }
  return paths;
}

Result<void> add_indices(const std::string& folder, const std::string& path, const IsOurs& is_ours,
                         std::vector<std::string>& ours) {
  const std::string partial = std::string(kIndex) + kPartial;
  const auto found = ours_in(folder, fs::file_type::regular, [&](const std::string& name) {
    return name == kIndex || name == partial;
  });
  if (!found) return std::unexpected(found.error());
  for (const std::string& file : *found) {
    const auto text = read_regular_file(file);
    if (!text) return std::unexpected(text.error());
    if (is_our_index(*text, path, is_ours, file.ends_with(partial))) ours.push_back(file);
  }
  return {};
}

/// Of a folder of one degree. Others name their buckets alike; their .stg tell.
Result<void> add_buckets(const std::string& at, Folder folder, std::vector<std::string>& ours) {
  std::set<std::string> names, files;
  for (const BucketId id : buckets_in(folder)) {
    const auto stg = read_regular_file(at + "/" + stg_name(id));
    if (!stg && stg.error().code != Errc::not_found) return std::unexpected(stg.error());
    if (stg && is_anothers_stg(*stg)) continue;
    for (const std::string& name : {btg_name(id), stg_name(id)})
      names.insert(name), files.insert({name, name + kPartial});
  }
  const auto found = ours_in(at, fs::file_type::regular,
                             [&](const std::string& name) { return files.contains(name); });
  if (!found) return std::unexpected(found.error());
  ours.insert(ours.end(), found->begin(), found->end());
  return add_indices(
      at, std::string(kTerrain) + "/" + path_of(folder),
      [&](const std::string& name) { return names.contains(name); }, ours);
}

/// Of a folder of ten degrees.
Result<void> add_degrees(const std::string& at, std::vector<std::string>& ours) {
  const std::string ten = fs::path(at).filename().string();
  const IsOurs is_of_one = [&](const std::string& name) {
    return folder_named(ten, name).has_value();
  };
  if (auto done = add_indices(at, kTerrain + ("/" + ten), is_of_one, ours); !done) return done;
  const auto ones = ours_in(at, fs::file_type::directory, is_of_one);
  if (!ones) return std::unexpected(ones.error());
  for (const std::string& one : *ones)
    if (auto done = add_buckets(one, *folder_named(ten, fs::path(one).filename().string()), ours);
        !done)
      return done;
  return {};
}

/// Buckets of before, and indices that name nothing else.
Result<std::vector<std::string>> old_files(const std::string& folder) {
  std::vector<std::string> ours;
  const auto terrains = ours_in(folder, fs::file_type::directory,
                                [](const std::string& name) { return name == kTerrain; });
  if (!terrains) return std::unexpected(terrains.error());
  for (const std::string& terrain : *terrains) {
    if (auto done = add_indices(terrain, kTerrain, is_of_ten, ours); !done)
      return std::unexpected(done.error());
    const auto tens = ours_in(terrain, fs::file_type::directory, is_of_ten);
    if (!tens) return std::unexpected(tens.error());
    for (const std::string& ten : *tens)
      if (auto done = add_degrees(ten, ours); !done) return std::unexpected(done.error());
  }
  return ours;
}

/// Fails where something else is in the place of a bucket or of a folder on the way to one.
Result<void> check_buckets_way(const std::string& folder, std::span<const BucketId> ids) {
  std::map<std::string, bool> seen;
  const auto folder_there = [&](const std::string& path) -> Result<bool> {
    if (const auto it = seen.find(path); it != seen.end()) return it->second;
    const auto there = is_there(path, fs::file_type::directory);
    if (there) seen[path] = *there;
    return there;
  };
  const std::string terrain = folder + "/" + kTerrain;
  for (const BucketId id : ids) {
    const std::string at = terrain + "/" + path_of(folder_of(id));
    auto way = folder_there(terrain);
    if (way && *way) way = folder_there(fs::path(at).parent_path().string());
    if (way && *way) way = folder_there(at);
    if (!way) return std::unexpected(way.error());
    if (!*way) continue;
    for (const std::string& name : {btg_name(id), stg_name(id)})
      if (const auto file = is_there(at + "/" + name, fs::file_type::regular); !file)
        return std::unexpected(file.error());
  }
  return {};
}

// ---- the making ----

class SceneryMaker {
 public:
  SceneryMaker(const BucketPlan& plan, const std::string& folder, const SceneryOptions& options,
               const Progress& progress)
      : plan_(plan), options_(options), folder_(folder), progress_(progress) {}

  Result<SceneryReport> make();

 private:
  const BucketPlan& plan_;
  const SceneryOptions& options_;
  const std::string folder_;
  const Progress& progress_;
  FolderFiles files_;
  SceneryReport report_;
  std::map<Folder, Entries> entries_;
  std::mutex mutex_;  // of the two above

  Result<void> begin(bool others);
  Result<void> put(const std::string& path, std::string_view bytes);
  bool keep(BucketId);
  Result<void> make_one(BucketId);
  Result<void> make_all(const std::vector<BucketId>&);
  void count(BucketId, const SaidInStg&, Entries);
  Result<proto::DirEntry> put_index(const std::string& path, Entries);
  Result<proto::DirEntry> index_of_others(const std::string& path);
  Result<std::string> put_indices();
};

/// From here on nobody takes what lies here for whole. What others have put beside buckets of
/// before stays.
Result<void> SceneryMaker::begin(bool others) {
  const auto old = others ? old_files(folder_) : std::vector<std::string>();
  if (!old) return std::unexpected(old.error());
  if (auto done = files_.remove(folder_ + "/" + kIndex); !done) return done;
  for (const std::string& path : *old)
    if (auto done = files_.remove(path); !done) return done;
  folder::remove_empty_folders(folder_, *old);
  for (const std::string name : {kSceneryRecord + 1, kIndex})
    if (auto done = remove_partials_of(folder_ + "/" + name); !done) return done;
  // None may come back under the new record: buckets do not say of which plan they are.
  if (auto done = others ? files_.sync_all(folder_) : files_.sync_folder(folder_); !done)
    return done;
  return write_whole_file(folder_ + kSceneryRecord, record_of(plan_, options_.cover));
}

Result<void> SceneryMaker::put(const std::string& path, std::string_view bytes) {
  const std::string whole = folder_ + "/" + path, partial = whole + kPartial;
  if (auto done = files_.make_folder(fs::path(whole).parent_path().string()); !done) return done;
  if (auto done = files_.write(partial, bytes); !done) return done;
  return files_.rename(partial, whole);
}

void SceneryMaker::count(BucketId id, const SaidInStg& said, Entries two) {
  const std::lock_guard lock(mutex_);
  ++report_.buckets;
  report_.worst_error_m = std::max(report_.worst_error_m, said.max_error_m);
  report_.partly_void += said.void_share > 0;
  report_.void_share += said.void_share;  // of one; divided by their number at last
  report_.over_budget += said.max_error_m > plan_.budget_m(rect(id));
  Entries& all = entries_[folder_of(id)];
  for (proto::DirEntry& entry : two) {
    report_.bytes += entry.bytes;
    all.push_back(std::move(entry));
  }
}

/// One that an earlier run finished.
bool SceneryMaker::keep(BucketId id) {
  const std::string at = folder_ + "/" + kTerrain + "/" + path_of(folder_of(id)) + "/";
  const auto stg = read_regular_file(at + stg_name(id));
  const auto said = stg ? read_stg(*stg) : std::nullopt;
  if (!said) return false;
  const auto btg = read_regular_file(at + btg_name(id));
  if (!btg || sha1(*btg) != said->sha1) return false;
  count(id, *said, {entry_of(btg_name(id), *btg), entry_of(stg_name(id), *stg)});
  const std::lock_guard lock(mutex_);
  ++report_.kept;
  return true;
}

Result<void> SceneryMaker::make_one(BucketId id) {
  const auto made = make_bucket(plan_, id, progress_.stop, options_.cover);
  if (!made) return std::unexpected(made.error());
  if (!*made) {
    const std::lock_guard lock(mutex_);
    ++report_.empty;
    return {};
  }
  const Bucket& bucket = **made;
  const std::string at = std::string(kTerrain) + "/" + path_of(folder_of(id)) + "/";
  if (auto done = put(at + btg_name(id), text_of(bucket.btg_gz)); !done) return done;
  if (auto done = put(at + stg_name(id), bucket.stg); !done) return done;
  count(id, *read_stg(bucket.stg),
        {entry_of(btg_name(id), text_of(bucket.btg_gz)), entry_of(stg_name(id), bucket.stg)});
  return {};
}

Result<void> SceneryMaker::make_all(const std::vector<BucketId>& ids) {
  std::optional<Error> first_error;
  std::atomic<bool> give_up = false;
  std::atomic<std::size_t> done = 0;
  parallel_for(ids.size(), options_.threads, [&](std::size_t i) {
    if (give_up || progress_.stopped()) return;
    if (!keep(ids[i]))
      if (auto made = make_one(ids[i]); !made) {
        const std::lock_guard lock(mutex_);
        if (!first_error) first_error = made.error();
        give_up = true;
      }
    if (const std::size_t n = ++done; n % (ids.size() / 200 + 1) == 0)
      progress_.at(double(n) / double(ids.size()));
  });
  if (progress_.stopped()) return fail(Errc::cancelled, "stopped before all buckets were written");
  if (first_error) return std::unexpected(*first_error);
  return {};
}

/// The entry of that folder in the one above. An index that is as it should be stays.
Result<proto::DirEntry> SceneryMaker::put_index(const std::string& path, Entries entries) {
  const std::string text = proto::encode_dirindex(path, std::move(entries));
  if (const auto kept = read_regular_file(folder_ + "/" + path + "/" + kIndex);
      !kept || *kept != text) {
    report_.there = false;
    if (auto done = put(path + "/" + kIndex, text); !done) return std::unexpected(done.error());
  }
  return proto::DirEntry{proto::DirEntry::folder, fs::path(path).filename().string(), sha1(text)};
}

/// Models and airports that somebody put there stay, and are led to.
Result<proto::DirEntry> SceneryMaker::index_of_others(const std::string& path) {
  const std::string file = folder_ + "/" + path + "/" + kIndex;
  const auto text = read_regular_file(file);
  if (!text && text.error().code != Errc::not_found) return std::unexpected(text.error());
  if (text && text->starts_with(proto::encode_dirindex(path, {})))
    return proto::DirEntry{proto::DirEntry::folder, path, sha1(*text)};
  return put_index(path, {});
}

/// From the deepest folders up; that of the root, which is not written yet.
Result<std::string> SceneryMaker::put_indices() {
  std::map<std::string, Entries> of_ten;
  for (auto& [one, files] : entries_) {
    const std::string path = path_of(one);
    auto entry = put_index(std::string(kTerrain) + "/" + path, std::move(files));
    if (!entry) return std::unexpected(entry.error());
    of_ten[path.substr(0, path.find('/'))].push_back(std::move(*entry));
  }
  Entries terrain, root;
  for (auto& [ten, folders] : of_ten) {
    auto entry = put_index(std::string(kTerrain) + "/" + ten, std::move(folders));
    if (!entry) return std::unexpected(entry.error());
    terrain.push_back(std::move(*entry));
  }
  for (const std::string path : kOthers) {
    auto entry = index_of_others(path);
    if (!entry) return std::unexpected(entry.error());
    root.push_back(std::move(*entry));
  }
  auto entry = put_index(kTerrain, std::move(terrain));
  if (!entry) return std::unexpected(entry.error());
  root.push_back(std::move(*entry));
  return proto::encode_dirindex({}, std::move(root));
}

Result<SceneryReport> SceneryMaker::make() {
  // Before a lock's file comes to lie in somebody else's folder.
  if (const auto ok = record_in(folder_); !ok && ok.error().code != Errc::not_found)
    return std::unexpected(ok.error());
  if (auto done = files_.make_folder(folder_); !done) return std::unexpected(done.error());
  const auto lock = FolderLock::take(folder_);
  if (!lock) return std::unexpected(lock.error());
  const auto before = record_in(folder_);
  if (!before) return std::unexpected(before.error());
  const bool same = *before && **before == record_of(plan_, options_.cover);
  if (*before && !same && !options_.force)
    return fail(Errc::invalid_argument,
                folder_ +
                    " holds scenery of another DEM, of one that has changed, or of other "
                    "options: choose another directory, or --force to replace it");
  const std::vector<BucketId> ids = plan_.buckets();
  if (auto ok = check_buckets_way(folder_, ids); !ok) return std::unexpected(ok.error());
  report_.there = same && read_regular_file(folder_ + "/" + kIndex);
  if (!report_.there)
    if (auto done = begin(*before && !same); !done) return std::unexpected(done.error());
  report_.budget_m = HUGE_VAL;
  for (const BucketId id : ids)
    report_.budget_m = std::min(report_.budget_m, plan_.budget_m(rect(id)));
  if (auto done = make_all(ids); !done) return std::unexpected(done.error());
  if (report_.buckets > 0) report_.void_share /= double(report_.buckets);
  if (report_.kept < report_.buckets) report_.there = false;
  const auto index = put_indices();
  if (!index) return std::unexpected(index.error());
  const auto kept = read_regular_file(folder_ + "/" + kIndex);
  if (report_.there && kept && *kept == *index) return report_;
  report_.there = false;
  if (auto synced = files_.sync_all(folder_); !synced) return std::unexpected(synced.error());
  if (auto put = write_whole_file(folder_ + "/" + kIndex, *index); !put)
    return std::unexpected(put.error());
  return report_;
}

}  // namespace

Result<SceneryReport> write_scenery(const BucketPlan& plan, const std::string& folder,
                                    const SceneryOptions& options, const Progress& progress) {
  return SceneryMaker(plan, folder, options, progress).make();
}

std::string folder_index(Folder folder, std::span<const SceneryFile> files) {
  Entries entries;
  for (const auto& [name, bytes] : files) entries.push_back(entry_of(name, bytes));
  return proto::encode_dirindex(std::string(kTerrain) + "/" + path_of(folder), std::move(entries));
}

}  // namespace tind::flightgear
