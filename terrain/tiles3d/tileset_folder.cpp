// A copy of layer.json stands for which tiles the files are of, and for that they are ours. It is
// there before the first of them and as long as one is.

#include "terrain/tiles3d/tileset_folder.h"

#include <atomic>
#include <filesystem>
#include <mutex>
#include <optional>
#include <string_view>
#include <system_error>
#include <vector>

#include "proto/layer_json.h"
#include "terrain/base/file_io.h"
#include "terrain/base/parallel.h"
#include "terrain/encode/quantized_mesh_tile.h"
#include "terrain/store/folder/folder_files.h"
#include "terrain/tiles3d/tileset.h"

namespace tind::tiles3d {
namespace {

namespace fs = std::filesystem;

constexpr const char* kRecord = "/tind-3dtiles.json";
constexpr const char* kTileset = "/tileset.json";
constexpr const char* kPartial = ".part";

/// What was written here before; nothing in a folder that is new or empty.
Result<std::optional<proto::LayerJson>> record_in(const std::string& folder) {
  std::error_code error;
  if (!fs::exists(folder, error) || fs::is_empty(folder, error)) return std::nullopt;
  const auto text = read_regular_file(folder + kRecord);
  auto layer = text ? proto::decode_layer_json(*text) : fail(Errc::io, "");
  if (!layer)
    return fail(Errc::invalid_argument,
                folder +
                    " holds files that tind build did not make: move them, or choose another "
                    "directory");
  return std::optional(std::move(*layer));
}

void add_roots(const TileSet& set, TileId id, std::vector<TileId>& roots) {
  if (!set.available(id)) return;
  if (id.level % kSubtreeLevels == 0) roots.push_back(id);
  if (id.level == set.layer().maxzoom) return;
  for (const int north : {0, 1})
    for (const int east : {0, 1}) add_roots(set, id.child(east, north), roots);
}

std::string_view text_of(const std::vector<std::uint8_t>& bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

class FolderMaker {
 public:
  FolderMaker(const TileSet& set, const std::string& folder, const Progress& progress)
      : set_(set), folder_(folder), progress_(progress) {}

  Result<FolderReport> make(int threads);

 private:
  const TileSet& set_;
  const std::string folder_;
  const Progress& progress_;
  FolderFiles files_;
  FolderReport report_;
  std::mutex mutex_;  // of the report

  Source source() const {
    return {set_, [this](TileId id) -> Result<TileModel> {
              const auto tile = set_.tile(id, progress_.stop);
              if (!tile) return std::unexpected(tile.error());
              return decode_tile(id, tile->bytes);
            }};
  }
  Result<void> begin();
  Result<void> put(const std::string& path, std::string_view bytes, std::uint64_t FolderReport::*);
  Result<void> put_subtree(TileId root);
  Result<void> remove_others(const proto::LayerJson& before);
};

/// From here on nobody takes what lies here for whole.
Result<void> FolderMaker::begin() {
  if (auto done = files_.make_folder(folder_); !done) return done;
  if (auto done = files_.remove(folder_ + kTileset); !done) return done;
  if (auto done = files_.sync_folder(folder_); !done) return done;
  return write_whole_file(folder_ + kRecord, proto::encode_layer_json(set_.layer()));
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

/// Files of tiles that are no more.
Result<void> FolderMaker::remove_others(const proto::LayerJson& before) {
  for (std::size_t z = 0; z < before.available.size(); ++z)
    for (const proto::TileRange& r : before.available[z])
      for (std::uint64_t x = r.start_x; x <= r.end_x; ++x)
        for (std::uint64_t y = r.start_y; y <= r.end_y; ++y) {
          const auto id = tiling::tile(std::int64_t(z), std::int64_t(x), std::int64_t(y));
          if (!id || set_.available(*id)) continue;
          for (const char* suffix : {".glb", ".subtree"})
            if (auto done = files_.remove(folder_ + "/" + path_of(*id) + suffix); !done)
              return done;
        }
  return {};
}

Result<FolderReport> FolderMaker::make(int threads) {
  const auto before = record_in(folder_);
  if (!before) return std::unexpected(before.error());
  if (*before && (*before)->version == set_.layer().version &&
      read_regular_file(folder_ + kTileset)) {
    report_.there = true;
    return report_;
  }
  if (*before)
    if (auto done = remove_others(**before); !done) return std::unexpected(done.error());
  if (auto done = begin(); !done) return std::unexpected(done.error());
  std::vector<TileId> roots;
  for (const TileId root : {TileId{0, 0, 0}, TileId{0, 1, 0}}) add_roots(set_, root, roots);
  std::optional<Error> first_error;
  std::atomic<bool> give_up = false;
  std::atomic<std::size_t> done = 0;
  parallel_for(roots.size(), threads, [&](std::size_t i) {
    if (give_up || progress_.stopped()) return;
    if (auto put = put_subtree(roots[i]); !put) {
      const std::lock_guard lock(mutex_);
      if (!first_error) first_error = put.error();
      give_up = true;
    }
    if (const std::size_t n = ++done; n % (roots.size() / 200 + 1) == 0)
      progress_.at(double(n) / double(roots.size()));
  });
  if (progress_.stopped()) return fail(Errc::cancelled, "stopped before all 3D Tiles were written");
  if (first_error) return std::unexpected(*first_error);
  const auto json = tileset_json(source());
  if (!json) return std::unexpected(json.error());
  if (auto synced = files_.sync_all(folder_); !synced) return std::unexpected(synced.error());
  if (auto put = write_whole_file(folder_ + kTileset, *json); !put)
    return std::unexpected(put.error());
  return report_;
}

}  // namespace

Result<FolderReport> write_tileset(const TileSet& set, const std::string& folder, int threads,
                                   const Progress& progress) {
  if (auto roots = has_roots(set); !roots) return std::unexpected(roots.error());
  return FolderMaker(set, folder, progress).make(threads);
}

}  // namespace tind::tiles3d
