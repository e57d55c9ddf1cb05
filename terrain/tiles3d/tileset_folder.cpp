// A copy of layer.json stands for which tiles the files are of, and for that they are ours. It is
// there before the first of them and as long as one is. Subtrees are made in the order of
// each_tile(), which the tiles alone decide, so a number says which ones are done. Before any is
// kept, its files are looked at: folders are copied by hand, and copies break off.

#include "terrain/tiles3d/tileset_folder.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <charconv>
#include <filesystem>
#include <fstream>
#include <mutex>
#include <optional>
#include <span>
#include <string_view>
#include <system_error>
#include <vector>

#include "proto/tile/layer_json.h"
#include "terrain/base/bytes.h"
#include "terrain/base/file_io.h"
#include "terrain/base/folder_entries.h"
#include "terrain/base/parallel.h"
#include "terrain/encode/quantized_mesh_tile.h"
#include "terrain/store/folder/folder_files.h"
#include "terrain/store/folder/folder_lock.h"
#include "terrain/tiles3d/tileset.h"

namespace tind::tiles3d {
namespace {

namespace fs = std::filesystem;

constexpr const char* kTileset = "/tileset.json";
constexpr const char* kDone = "/tind-3dtiles-done";  // how many subtrees
constexpr const char* kPartial = ".part";
constexpr const char* kStopped = "stopped before all 3D Tiles were written; run it again to go on";

/// "/tind-3dtiles.json", "/tind-3dtiles-meshopt.json".
std::string record_name(GlbCompression compression) {
  return "/tind-3dtiles" + (compression == GlbCompression::none ? "" : "-" + name_of(compression)) +
         ".json";
}

/// Is there nothing but what a run puts there before the record?
Result<bool> is_new(const std::string& folder, const std::string& record) {
  const auto entries = entries_of(folder);
  if (!entries) return std::unexpected(entries.error());
  return std::ranges::all_of(*entries, [&](const fs::directory_entry& entry) {
    const std::string name = entry.path().filename().string();
    return name == FolderLock::kName || "/" + name == record + kPartial;
  });
}

/// What was written here before; nothing in a folder that is new or empty.
Result<std::optional<proto::LayerJson>> record_in(const std::string& folder,
                                                  const std::string& record) {
  const auto fresh = is_new(folder, record);
  if (!fresh) return std::unexpected(fresh.error());
  if (*fresh) return std::nullopt;
  const auto text = read_regular_file(folder + record);
  // What cannot be read may be ours: only what is not there says that nothing is.
  if (!text && text.error().code != Errc::not_found) return std::unexpected(text.error());
  auto layer = text ? proto::decode_layer_json(*text) : fail(Errc::io, "");
  if (!layer)
    return fail(Errc::invalid_argument,
                folder +
                    " holds files that tind build did not make: move them, or choose another "
                    "directory");
  return std::optional(std::move(*layer));
}

/// The first bytes of a file and its length; nothing where there is none, or not so many.
struct Head {
  std::array<char, 24> bytes{};
  std::uint64_t size = 0;
};
std::optional<Head> head_of(const std::string& path) {
  std::error_code error;
  Head head;
  if (!fs::is_regular_file(path, error)) return {};
  head.size = fs::file_size(path, error);
  std::ifstream in(path, std::ios::binary);
  if (error || !in.read(head.bytes.data(), head.bytes.size())) return {};
  return head;
}

/// Is the file as long as its header says?
bool is_whole_glb(const std::string& path) {
  const auto head = head_of(path);
  return head && std::string_view(head->bytes.data(), 4) == "glTF" &&
         load<std::uint32_t>(&head->bytes[8]) == head->size;
}
bool is_whole_subtree(const std::string& path) {
  const auto head = head_of(path);
  if (!head || std::string_view(head->bytes.data(), 4) != "subt") return false;
  const std::uint64_t rest = head->size - head->bytes.size();
  const auto json = load<std::uint64_t>(&head->bytes[8]);
  return json <= rest && load<std::uint64_t>(&head->bytes[16]) == rest - json;
}

std::string_view text_of(const std::vector<std::uint8_t>& bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

class FolderMaker {
 public:
  FolderMaker(const TileSet& set, const std::string& folder, const FolderOptions& options,
              const Progress& progress)
      : set_(set), folder_(folder), options_(options), progress_(progress) {}

  Result<FolderReport> make();

 private:
  const TileSet& set_;
  const std::string folder_;
  const FolderOptions options_;
  const Progress& progress_;
  const std::string record_ = record_name(options_.compression);
  FolderFiles files_;
  FolderReport report_;
  std::mutex mutex_;  // of the report

  Source source() const {
    return {set_,
            [this](TileId id) -> Result<TileModel> {
              const auto tile = set_.tile(id, progress_.stop);
              if (!tile) return std::unexpected(tile.error());
              return decode_tile(id, tile->bytes);
            },
            options_.compression, options_.draped};
  }
  /// (A version says what tiles are like, not which there are.)
  bool is_of_these(const proto::LayerJson& record) const {
    return record.version == source().version() && record.available == set_.layer().available;
  }
  Result<void> end_before();
  Result<void> begin();
  Result<void> put_safely(const std::string& path, std::string_view bytes);
  Result<void> put(const std::string& path, std::string_view bytes, std::uint64_t FolderReport::*);
  Result<void> put_subtree(TileId root);
  Result<bool> remove_other(TileId);
  Result<void> remove_if_empty(fs::path below);
  Result<void> remove_others(const proto::LayerJson& before);
  std::vector<TileId> roots() const;
  std::size_t done_before(std::size_t all) const;
  bool is_whole(TileId root) const;
  Result<std::vector<TileId>> torn_of(std::span<const TileId> done) const;
  Result<void> put_subtrees(std::span<const TileId> roots);
  Result<void> put_batch(std::span<const TileId> roots, std::size_t before, std::size_t all);
  Result<void> put_tileset();
};

/// From here on nobody takes what lies here for whole. The record stays: it names what is to go.
Result<void> FolderMaker::end_before() {
  for (const char* name : {kTileset, kDone})
    if (auto done = files_.remove(folder_ + name); !done) return done;
  return files_.sync_folder(folder_);
}

/// From here on what lies here is of these tiles.
Result<void> FolderMaker::begin() {
  proto::LayerJson layer = set_.layer();
  layer.version = source().version();
  return put_safely(folder_ + record_, proto::encode_layer_json(layer));
}

/// Whole or not at all, also if the power is cut.
Result<void> FolderMaker::put_safely(const std::string& path, std::string_view bytes) {
  const std::string partial = path + kPartial;
  if (auto done = files_.write(partial, bytes); !done) return done;
  if (auto done = files_.sync_file(partial); !done) return done;
  if (auto done = files_.rename(partial, path); !done) return done;
  return files_.sync_folder(folder_);
}

Result<void> FolderMaker::put(const std::string& path, std::string_view bytes,
                              std::uint64_t FolderReport::*kind) {
  const std::string whole = folder_ + "/" + path, partial = whole + kPartial;
  if (auto done = files_.make_folder(fs::path(whole).parent_path().string()); !done) return done;
  if (auto done = files_.write(partial, bytes); !done) return done;
  if (auto done = files_.rename(partial, whole); !done) return done;
  const std::lock_guard lock(mutex_);
  ++(report_.*kind), report_.bytes += bytes.size();
  return {};
}

Result<void> FolderMaker::put_subtree(TileId root) {
  const auto made = subtree(source(), root, [&](TileId id, const std::vector<std::uint8_t>& bytes) {
    return put(path_of(id) + ".glb", text_of(bytes), &FolderReport::contents);
  });
  if (!made) return std::unexpected(made.error());
  return put(path_of(root) + ".subtree", text_of(*made), &FolderReport::subtrees);
}

/// Files of a tile that is no more; false where it still is.
Result<bool> FolderMaker::remove_other(TileId id) {
  if (set_.available(id)) return false;
  for (const char* suffix : {".glb", ".subtree", ".glb.part", ".subtree.part"})
    if (auto done = files_.remove(folder_ + "/" + path_of(id) + suffix); !done)
      return std::unexpected(done.error());
  return true;
}

/// And those above it that hold nothing else then.
Result<void> FolderMaker::remove_if_empty(fs::path below) {
  for (; !below.empty(); below = below.parent_path()) {
    const std::string path = folder_ + "/" + below.string();
    std::error_code error;  // there is no harm in an empty folder that stays
    const auto type = fs::symlink_status(path, error).type();
    if (type == fs::file_type::not_found) continue;  // removed by a run before
    if (type != fs::file_type::directory || !fs::is_empty(path, error) || error) return {};
    if (auto done = files_.remove(path); !done) return done;
  }
  return {};
}

/// Files of tiles that are no more, and the folders that this leaves empty.
Result<void> FolderMaker::remove_others(const proto::LayerJson& before) {
  for (std::size_t z = 0; z < before.available.size(); ++z)
    for (const proto::TileRange& r : before.available[z])
      for (std::uint64_t x = r.start_x; x <= r.end_x; ++x) {
        std::optional<TileId> gone;
        for (std::uint64_t y = r.start_y; y <= r.end_y; ++y) {
          const auto id = tiling::tile(std::int64_t(z), std::int64_t(x), std::int64_t(y));
          const auto removed = id ? remove_other(*id) : false;
          if (!removed) return std::unexpected(removed.error());
          if (*removed) gone = id;
        }
        if (!gone) continue;
        if (auto done = remove_if_empty(fs::path(path_of(*gone)).parent_path()); !done) return done;
      }
  return files_.sync_all(folder_);  // none may come back under the new record
}

/// Subtrees that an earlier run has put beyond power cuts.
std::size_t FolderMaker::done_before(std::size_t all) const {
  const auto text = read_regular_file(folder_ + kDone);
  std::size_t done = 0;
  if (!text) return 0;
  const auto [end, error] = std::from_chars(text->data(), text->data() + text->size(), done);
  return error == std::errc() && std::string_view(end, text->data() + text->size()) == "\n"
             ? std::min(done, all)
             : 0;
}

bool FolderMaker::is_whole(TileId root) const {
  const auto at = [&](TileId id) { return folder_ + "/" + path_of(id); };
  return is_whole_subtree(at(root) + ".subtree") &&
         std::ranges::all_of(tiles_of_subtree(set_, root),
                             [&](TileId id) { return is_whole_glb(at(id) + ".glb"); });
}

/// Of the subtrees that an earlier run has made, those of which a file is gone or cut off since.
Result<std::vector<TileId>> FolderMaker::torn_of(std::span<const TileId> done) const {
  std::vector<std::uint8_t> whole(done.size());
  parallel_for(done.size(), options_.threads, [&](std::size_t i) {
    if (!progress_.stopped()) whole[i] = is_whole(done[i]);
  });
  if (progress_.stopped()) return fail(Errc::cancelled, kStopped);
  std::vector<TileId> torn;
  for (std::size_t i = 0; i < done.size(); ++i)
    if (!whole[i]) torn.push_back(done[i]);
  return torn;
}

/// `before`: so many of all are done, for the progress.
Result<void> FolderMaker::put_batch(std::span<const TileId> roots, std::size_t before,
                                    std::size_t all) {
  std::optional<Error> first_error;
  std::atomic<bool> give_up = false;
  std::atomic<std::size_t> done = 0;
  parallel_for(roots.size(), options_.threads, [&](std::size_t i) {
    if (give_up || progress_.stopped()) return;
    if (auto put = put_subtree(roots[i]); !put) {
      const std::lock_guard lock(mutex_);
      if (!first_error) first_error = put.error();
      give_up = true;
    } else if (const std::size_t n = before + ++done; n % (all / 200 + 1) == 0) {
      progress_.at(double(n) / double(all));
    }
  });
  if (done != roots.size()) {
    if (progress_.stopped()) return fail(Errc::cancelled, kStopped);
    return std::unexpected(*first_error);
  }
  return files_.sync_all(folder_);
}

Result<void> FolderMaker::put_subtrees(std::span<const TileId> roots) {
  std::size_t from = done_before(roots.size());
  const auto torn = torn_of(roots.first(from));
  if (!torn) return std::unexpected(torn.error());
  report_.kept_subtrees = from - torn->size();
  if (!torn->empty())
    if (auto put = put_batch(*torn, report_.kept_subtrees, roots.size()); !put) return put;
  while (from < roots.size()) {
    const std::size_t to = std::min(roots.size(), from + std::max<std::size_t>(options_.batch, 1));
    if (auto put = put_batch(roots.subspan(from, to - from), from, roots.size()); !put) return put;
    if (auto put = put_safely(folder_ + kDone, std::to_string(to) + "\n"); !put) return put;
    from = to;
  }
  return {};
}

/// Comes last, and stays where it is as it should be.
Result<void> FolderMaker::put_tileset() {
  const auto json = tileset_json(source());
  if (!json) return std::unexpected(json.error());
  const auto there = read_regular_file(folder_ + kTileset);
  if (there && *there == *json) {
    report_.there = report_.subtrees == 0;
    return {};
  }
  if (auto done = remove_partials_of(folder_ + kTileset); !done) return done;  // of killed runs
  return write_whole_file(folder_ + kTileset, *json);
}

std::vector<TileId> FolderMaker::roots() const {
  std::vector<TileId> roots;
  each_tile(set_, [&](TileId id) {
    if (id.level % kSubtreeLevels == 0) roots.push_back(id);
  });
  return roots;
}

Result<FolderReport> FolderMaker::make() {
  if (auto made = files_.make_folder(folder_); !made) return std::unexpected(made.error());
  const auto lock = FolderLock::take(folder_);
  if (!lock) return std::unexpected(lock.error());
  const auto before = record_in(folder_, record_);
  if (!before) return std::unexpected(before.error());
  const bool goes_on = *before && is_of_these(**before);
  if (!goes_on)
    if (auto done = end_before(); !done) return std::unexpected(done.error());
  if (*before && !goes_on)
    if (auto done = remove_others(**before); !done) return std::unexpected(done.error());
  if (!goes_on)
    if (auto done = begin(); !done) return std::unexpected(done.error());
  if (auto put = put_subtrees(roots()); !put) return std::unexpected(put.error());
  if (auto put = put_tileset(); !put) return std::unexpected(put.error());
  return report_;
}

}  // namespace

Result<FolderReport> write_tileset(const TileSet& set, const std::string& folder,
                                   const FolderOptions& options, const Progress& progress) {
  if (auto roots = has_roots(set); !roots) return std::unexpected(roots.error());
  return FolderMaker(set, folder, options, progress).make();
}

}  // namespace tind::tiles3d
