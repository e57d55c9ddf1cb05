// A build of the same tiles, which finds most of them made. Before it touches anything, its record
// is held against the store's.

#include "terrain/pyramid/build/repair.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <map>
#include <mutex>
#include <optional>
#include <utility>
#include <vector>

#include "terrain/pyramid/build/build.h"
#include "terrain/pyramid/plan/tile_method.h"
#include "terrain/store/copy/copy_store.h"
#include "terrain/store/open/open_store.h"

namespace tind {

namespace {

constexpr std::uint64_t kMostHeld = 4ull << 30;  // bytes of an archive's tiles that are made again

using Differences = std::vector<std::string>;

std::string counted(std::size_t n, const char* what) {
  return fmt::format("{} {}{}", n, what, n == 1 ? "" : "s");
}

/// What of one layer's options is other than then; of an upper one, how far it bends those below.
void compare_options(const LayerRecord& was, const LayerRecord& is, const std::string& layer,
                     Differences& found) {
  if (was.blend_m != is.blend_m)
    found.push_back(
        fmt::format("layer {} bent what lies below over {:.6g} m, not {:.6g} m: "
                    "say --blend {}={}",
                    layer, was.blend_m, is.blend_m, layer, was.blend_m));
  if (was.max_error_m == is.max_error_m) return;
  if (was.max_error_m > 0)
    found.push_back(fmt::format("layer {} had an error of its own: say --layer-error {}={}", layer,
                                layer, was.max_error_m));
  else
    found.push_back(
        fmt::format("layer {} had no error of its own: leave its --layer-error out", layer));
}

/// What of the layers is other than then. Their names are no part of the record: those of today.
void compare_layers(const BuildRecord& store, const BuildRecord& made, const Surface& surface,
                    Differences& found) {
  const std::size_t count = made.layers.size();
  if (store.layers.size() != count) {
    found.push_back(
        fmt::format("they were made of {}, not of {}: name the same files, or the same --layer",
                    counted(store.layers.size(), "layer"), counted(count, "layer")));
    return;
  }
  const bool same_datum = store.vertical_datum == made.vertical_datum;  // a part of every `crs`
  const auto other_posts = [&](const LayerRecord& was, const LayerRecord& is) {
    return store.grid != made.grid &&
           (was.post_to_crs != is.post_to_crs || was.cols != is.cols || was.rows != is.rows ||
            (same_datum && !was.same_lattice(is)));
  };
  for (std::size_t k = 0; k < count; ++k) {
    const LayerRecord &was = store.layers[k], &is = made.layers[k];
    const std::string& name = surface.layers()[k].name;
    const std::string of_layer = count == 1 ? "" : " of layer " + name;
    if (was.files != is.files)
      found.push_back(fmt::format("the posts{} were those of {}, not of {}: name the same files",
                                  of_layer, counted(std::size_t(was.files), "file"),
                                  counted(std::size_t(is.files), "file")));
    else if (other_posts(was, is))
      found.push_back(
          fmt::format("the posts{} lie elsewhere, or their heights mean something else: name the "
                      "same files, with the same options of DEMs{}",
                      of_layer, count == 1 ? "" : " and --layer-option"));
    compare_options(was, is, name, found);
  }
}

/// What of the lines, the polygons and the water is other than then. Only what becomes level or an
/// edge has levels, so these tell --flatten and --breaklines from the others.
void compare_shapes(const BuildRecord& store, const BuildRecord& made, Differences& found) {
  if (store.shapes == made.shapes) return;
  const bool had_lines = !store.shape_levels.empty(), has_lines = !made.shape_levels.empty();
  if (store.shapes.empty())
    found.push_back(
        "they were made without lines, polygons and water: leave --breaklines, --flatten, "
        "--boundary and --water out");
  else if (had_lines && !has_lines)
    found.push_back(
        "they were made with lines or level polygons, of which none is named: repeat --breaklines "
        "and --flatten of the build, and its --boundary, --water and --line-heights if it had any");
  else if (made.shapes.empty())
    found.push_back(
        "they were made with a boundary or with water, which is not named: repeat --boundary and "
        "--water of the build");
  else if (has_lines && !had_lines)
    found.push_back(
        "they were made without lines and level polygons: leave --breaklines and --flatten out, "
        "and repeat --boundary and --water of the build");
  else
    found.push_back(
        "they were made with other lines, polygons or water, or by a version of tind that took "
        "these otherwise: repeat --breaklines, --flatten, --boundary, --water and --line-heights "
        "of the build, the files in their order");
}

/// What keeps tiles of the one record from being made again by what made the other; empty: nothing.
std::string difference(const BuildRecord& store, const BuildRecord& made, const Surface& surface) {
  if (encode(store) == encode(made)) return {};
  // Of one file and of several, tiles are made otherwise: that is no other version.
  const bool one_and_several = (store.layer_epoch == 0) != (made.layer_epoch == 0);
  if (store.epoch != made.epoch || (store.layer_epoch != made.layer_epoch && !one_and_several))
    return "another version of tind made them, which made other bytes of the same posts";
  Differences found;
  if (!store.vertical_datum.empty() && store.vertical_datum != made.vertical_datum)
    found.push_back(
        fmt::format("the datum of their heights is {}, not {}: repeat --from-datum and --to-datum "
                    "of the build",
                    store.vertical_datum, made.vertical_datum));
  if (!store.layers.empty()) compare_layers(store, made, surface, found);
  if (found.empty() && (store.grid != made.grid || one_and_several))
    found.push_back(
        "the posts lie elsewhere, or their heights mean something else, or layers meet otherwise: "
        "name the same files, with the same options of DEMs, --layer-option, --blend and "
        "--layer-error");
  compare_shapes(store, made, found);
  // Last, as all of those make other heights, too, of files that nobody has changed.
  if (found.empty() && store.heights != made.heights)
    found.push_back(
        "the heights are others by now, or they were read otherwise: repeat the options of DEMs "
        "(--from-datum, --nodata, --band, --encoding, --scale, --offset, --layer-option) of the "
        "build; if it is the files that changed, tind build with its options updates the tiles");
  if (found.empty())
    found.push_back(
        "their record has other layers or options than these make, or PROJ places these posts "
        "otherwise by now");
  return fmt::format("{}", fmt::join(found, "; "));
}

/// A text of layer.json that is as it was, or what the plan says.
std::string layer_text(const TileStore& store, std::string_view made) {
  const auto found = store.layer_json();
  if (!found) return std::string(made);
  std::string text(found->begin(), found->end());
  const auto old = proto::decode_layer_json(text), now = proto::decode_layer_json(made);
  const bool same = old && now && old->available == now->available && old->version == now->version;
  return same ? text : std::string(made);
}

/// Tiles that were made again, over those of an archive.
class MendedStore : public TileStore {
 public:
  struct Made {
    std::vector<std::uint8_t> bytes;
    TileFacts facts;
  };
  MendedStore(const TileStore& store, const BuildRecord& record, std::string blocks)
      : store_(store), record_(record), blocks_(std::move(blocks)) {}

  std::string name() const override { return "what was mended of " + store_.name(); }
  std::string layer_name() const override { return store_.layer_name(); }
  std::string tile_name(TileId id) const override { return store_.tile_name(id); }
  bool remote() const override { return false; }
  Result<std::vector<std::uint8_t>> layer_json() const override {
    return std::vector<std::uint8_t>(layer.begin(), layer.end());
  }
  Result<std::optional<BuildRecord>> record() const override { return record_; }
  Result<std::string> kept_blocks() const override { return blocks_; }
  Result<std::vector<std::uint8_t>> read(TileId id) const override {
    auto tile = look_at(id);
    if (!tile) return std::unexpected(tile.error());
    return std::move(tile->bytes);
  }
  Result<StoredTile> look_at(TileId id) const override {
    const auto it = made.find(id);
    if (it == made.end()) return store_.look_at(id);
    return StoredTile{it->second.bytes, Vouched::yes, it->second.facts};
  }

  std::map<TileId, Made> made;
  std::string layer;

 private:
  const TileStore& store_;
  const BuildRecord record_;
  const std::string blocks_;
};

/// An archive as a store that is written: it is written anew at the end.
class MendedArchive : public TileWriter {
 public:
  MendedArchive(std::string location, const TileWork& work)
      : location_(std::move(location)),
        threads_(work.threads),
        ids_(work.ids),
        store_(open_store(location_)),
        generation_(store_->generation()),
        mended_(*store_, work.record, work.blocks.encode()) {}

  std::uint64_t unsound() const override { return 0; }
  std::optional<TileFacts> finished(std::size_t k) const override {
    const auto tile = store_->look_at(ids_[k]);
    if (!tile || tile->vouched != Vouched::yes) return {};
    return tile->facts;
  }
  Result<void> write(std::size_t k, std::string_view bytes, TileFacts facts) override {
    const std::lock_guard lock(mutex_);
    held_ += bytes.size();
    if (held_ > kMostHeld)
      return fail(Errc::out_of_range, location_ +
                                          ": so much of it is broken that it is better "
                                          "built and copied anew");
    mended_.made[ids_[k]] = {{bytes.begin(), bytes.end()}, facts};
    return {};
  }
  Result<void> commit() override { return {}; }
  Result<void> finish(std::string_view layer_json) override {
    mended_.layer = layer_text(*store_, layer_json);
    if (open_store(location_)->generation() != generation_)
      return fail(Errc::busy, location_ + " has got other tiles meanwhile: nothing was repaired");
    const auto copied = copy_store(mended_, location_, {.force = true, .threads = threads_});
    if (!copied) return std::unexpected(copied.error());
    return {};
  }

 private:
  const std::string location_;
  const int threads_;
  const TileOrder& ids_;
  const std::unique_ptr<TileStore> store_;
  const std::optional<std::uint64_t> generation_;
  std::mutex mutex_;
  std::uint64_t held_ = 0;
  MendedStore mended_;
};

/// A directory's writer, which leaves layer.json as it is.
class MendedFolder : public TileWriter {
 public:
  MendedFolder(std::unique_ptr<TileWriter> writer, std::string location)
      : writer_(std::move(writer)), location_(std::move(location)) {}

  std::uint64_t unsound() const override { return writer_->unsound(); }
  std::optional<TileFacts> finished(std::size_t k) const override { return writer_->finished(k); }
  Result<void> write(std::size_t k, std::string_view bytes, TileFacts facts) override {
    return writer_->write(k, bytes, facts);
  }
  Result<void> commit() override { return writer_->commit(); }
  Result<void> finish(std::string_view layer_json) override {
    return writer_->finish(layer_text(*open_store(location_), layer_json));
  }
  std::string index_path() const override { return writer_->index_path(); }

 private:
  const std::unique_ptr<TileWriter> writer_;
  const std::string location_;
};

class MendedLock : public LockedStore {
 public:
  MendedLock(std::string location, BuildRecord record, Surface surface,
             std::unique_ptr<LockedStore> folder)
      : location_(std::move(location)),
        record_(std::move(record)),
        surface_(std::move(surface)),
        folder_(std::move(folder)) {}

  Result<std::unique_ptr<TileWriter>> claim(const TileWork& work,
                                            const Progress& progress) override {
    if (const std::string why = difference(record_, work.record, surface_); !why.empty())
      return fail(Errc::invalid_argument,
                  location_ + ": its tiles cannot be made again of this source: " + why);
    if (!folder_) return std::make_unique<MendedArchive>(location_, work);
    auto writer = folder_->claim(work, progress);
    if (!writer) return writer;
    return std::make_unique<MendedFolder>(std::move(*writer), location_);
  }

 private:
  const std::string location_;
  const BuildRecord record_;
  const Surface surface_;
  const std::unique_ptr<LockedStore> folder_;  // null: an archive
};

}  // namespace

Result<TileSetOptions> tile_options_of(const BuildRecord& r) {
  if (!r.drape.empty())
    return fail(Errc::unsupported,
                "an image had a say in its tiles, which is not at hand here: the tind build that "
                "made them, run again, makes broken ones anew");
  TileSetOptions o;
  o.max_error_m = r.max_error_m;
  o.error_factor = r.error_factor;
  o.max_level = r.asked_deepest;
  o.first_level = r.first_level, o.last_level = r.last_level;
  o.exact_posts = r.exact_posts;
  const auto side = enum_named<Side>(r.side);
  const auto effort = enum_named<Effort>(r.effort);
  const auto method = r.method.empty() ? MethodOptions{} : tile_method_from_text(r.method);
  if (!side || !effort || !method || !(o.error_factor > 0) || !(o.max_error_m >= 0))
    return fail(Errc::bad_data, "its record says nothing of how its tiles were made");
  o.side = *side, o.effort = *effort, o.method = *method;
  return o;
}

Result<RepairReport> repair_tiles(const Surface& surface, const std::string& location, int threads,
                                  const Progress& progress) {
  const auto store = open_store(location);
  const auto read = store->record();
  if (!read) return std::unexpected(read.error());
  const auto& record = *read;
  if (!record) {
    if (const auto layer = store->layer_json(); !layer) return std::unexpected(layer.error());
    return fail(Errc::bad_data, location +
                                    " has no sound record of how its tiles were made, to make "
                                    "others alike: tind build makes all of them anew, here with "
                                    "--force");
  }
  const auto tiles = tile_options_of(*record);
  if (!tiles) return fail(location, tiles.error());
  BuildOptions o{.tiles = *tiles, .output = location, .threads = threads, .gzip = record->gzip};
  o.lock = [&](const std::string&) -> Result<std::unique_ptr<LockedStore>> {
    std::unique_ptr<LockedStore> folder;
    if (!names_archive(location)) {
      auto locked = lock_store(location);
      if (!locked) return std::unexpected(locked.error());
      folder = std::move(*locked);
      const auto now = open_store(location)->record();  // nobody changes it any more
      if (!now) return std::unexpected(now.error());
      if (!*now || encode(**now) != encode(*record))
        return fail(Errc::busy, location + " has just got other tiles: run it again");
    }
    return std::make_unique<MendedLock>(location, *record, surface, std::move(folder));
  };
  const auto built = build_tiles(surface, o, progress);
  if (!built) return std::unexpected(built.error());
  return RepairReport{built->tiles, built->built};
}

}  // namespace tind
