// Tiles are unpacked and packed anew, however they were packed: so the bytes of an archive do not
// depend on who did it. Chunks of them are got ready by all threads, and written in their order.

#include "terrain/store/copy/copy_store.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <filesystem>
#include <mutex>
#include <utility>
#include <vector>

#include "terrain/base/deflate.h"
#include "terrain/base/file_there.h"
#include "terrain/base/parallel.h"
#include "terrain/encode/quantized_mesh_tile.h"
#include "terrain/geo/availability.h"
#include "terrain/geo/ellipsoid.h"
#include "terrain/geo/tile_order.h"
#include "terrain/raster/remote/objects.h"
#include "terrain/raster/source_blocks.h"
#include "terrain/store/folder/folder_within.h"
#include "terrain/store/layer_place.h"
#include "terrain/store/object/object_store.h"
#include "terrain/store/open/open_store.h"
#include "terrain/store/taken_away.h"

namespace tind {

namespace {

namespace fs = std::filesystem;
using Bytes = std::vector<std::uint8_t>;

constexpr std::size_t kChunk = 1024;  // tiles
constexpr int kRemoteThreads = 8;     // mostly waiting for answers
constexpr int kLevel = 10;            // of DEFLATE, as tind build --gzip has it

/// What is copied.
struct Source {
  const TileStore& store;
  std::string layer_text;
  proto::LayerJson layer;
  std::optional<BuildRecord> record;
  std::string blocks;
  std::vector<TileArea> areas;  // by level
  std::uint64_t tiles = 0;
  int threads = 0;
  bool packed = false;  // as CopyOptions
};

struct Ready {
  Bytes bytes;
  TileFacts facts;
  bool vouched = false;
};

Result<Source> look_at_source(const TileStore& store, const CopyOptions& o) {
  const auto text = store.layer_json();
  if (!text) return std::unexpected(text.error());
  const auto read = store.record();
  if (!read) return std::unexpected(read.error());
  const auto& record = *read;
  auto blocks = store.kept_blocks();
  // What is there and could not be read is not what is not there: the copy would lack it for good.
  if (!blocks && blocks.error().code != Errc::not_found) return std::unexpected(blocks.error());
  if (blocks && !record) return fail(Errc::io, store.name() + ": its record cannot be read");
  if (blocks && !record->heights.empty() && !SourceBlocks::whole(*blocks, record->heights))
    return fail(Errc::bad_data,
                store.name() + ": its hashes of blocks are damaged; tind verify says more");
  Source from{.store = store,
              .layer_text = {text->begin(), text->end()},
              .layer = {},
              .record = record,
              .blocks = blocks ? std::move(*blocks) : "",
              .areas = {},
              .threads = o.threads,
              .packed = o.packed};
  auto layer = proto::decode_layer_json(from.layer_text);
  if (!layer) return fail(store.layer_name(), layer.error());
  from.layer = std::move(*layer);
  if (auto sure = store.vouched_for(); !sure) return std::unexpected(sure.error());
  for (const auto& level : from.layer.available) {
    from.areas.push_back(area_of(level));
    from.tiles += from.areas.back().size();
  }
  if (from.tiles > kMostCopiedTiles)
    return fail(Errc::out_of_range, store.name() + " has more than " +
                                        std::to_string(kMostCopiedTiles / 1'000'000) +
                                        " million tiles: copy what other programs copy");
  // Those that the list lacks, the copy would lack for good.
  if (auto all = store.names_as_many(from.tiles); !all) return std::unexpected(all.error());
  if (from.tiles == 0) return fail(Errc::bad_data, store.name() + " has no tiles");
  if (from.threads == 0 && store.remote()) from.threads = kRemoteThreads;
  return from;
}

Bytes packed(const Bytes& bytes) { return deflate(bytes, Wrapping::gzip, kLevel); }

/// Whoever serves tiles may mix them up; a tile's centre is in it, or nearly where makers differ.
bool is_of_place(const TileModel& tile) {
  const auto place = wgs84::from_ecef(tile.volumes.center).p;
  const GeoRect r = tiling::rect(tile.id);
  const double slack = r.width() / 4;
  const bool at_pole = std::abs(place.lat) > 89;
  const double east = std::remainder(place.lon - (r.west + r.east) / 2, 360);
  return place.lat >= r.south - slack && place.lat <= r.north + slack &&
         (at_pole || std::abs(east) <= r.width() / 2 + slack);
}

/// The tile, packed or not.
Result<Ready> fetch(const Source& from, TileId id, bool pack) {
  auto tile = from.store.look_at(id);
  const std::string name = from.store.tile_name(id);
  if (!tile) return fail("tile " + id.text(), tile.error());
  if (tile->vouched == Vouched::other_bytes || tile->vouched == Vouched::not_listed)
    return fail(Errc::bad_data,
                name + " is not as it was written; tind verify says more, and mends it");
  Ready ready{std::move(tile->bytes), tile->facts.value_or(TileFacts{}),
              tile->vouched == Vouched::yes};
  if (pack && from.packed && ready.vouched) return ready;
  if (!gunzip(ready.bytes)) return fail(Errc::bad_data, name + ": damaged gzip data");
  if (!tile->facts) {
    const auto decoded = decode_tile(id, ready.bytes);
    if (!decoded) return fail(name + " is no tile that could be copied", decoded.error());
    if (!is_of_place(*decoded))
      return fail(Errc::bad_data, name + " is the tile of another place: its centre says so");
    if (decoded->certificate) {
      ready.facts.max_error_m = decoded->certificate->max_error_m;
      ready.facts.edge_error_m = decoded->certificate->edge_error_m;
    }
  }
  if (pack) ready.bytes = packed(ready.bytes);
  return ready;
}

/// Are both one file?
Result<bool> is_same(const std::string& source, const std::string& to) {
  std::error_code error;
  const bool same = fs::equivalent(source, to, error);
  if (error && error != std::errc::no_such_file_or_directory)
    return fail(Errc::io, "cannot tell whether " + source + " and " + to +
                              " are one file: " + error.message());
  return same;
}

/// Is what lies there no archive of tind's? Fails where it cannot be read, and may be one.
Result<bool> is_foreign(const TileStore& there) {
  const auto layer = there.layer_json();
  if (!layer &&
      (layer.error().code == Errc::io || (there.remote() && layer.error().code != Errc::bad_data)))
    return std::unexpected(layer.error());
  return !there.generation();
}

/// Does something lie there that is not to be replaced by an archive?
Result<void> check_target(const Source& from, const std::string& to, bool force) {
  const bool remote = remote::is_remote(to);
  const auto any = remote ? true : is_there(to);
  if (!any) return std::unexpected(any.error());
  if (!*any) return {};
  const auto same =
      remote || from.store.remote() ? from.store.name() == to : is_same(from.store.name(), to);
  if (!same) return std::unexpected(same.error());
  if (*same)
    return fail(Errc::invalid_argument, to + " is what is to be copied: name another file");
  const auto there = open_store(to);
  const auto foreign = is_foreign(*there);
  if (!foreign && foreign.error().code == Errc::not_found) return {};
  if (!foreign) return std::unexpected(foreign.error());
  if (*foreign)
    return fail(
        Errc::invalid_argument,
        to + " is there, and no whole archive of tind's: move it away, or name another file");
  if (force) return {};
  const auto read = there->record();
  if (!read) return std::unexpected(read.error());
  const auto& record = *read;
  if (record && from.record && may_update(*record, *from.record)) {
    const auto layer = layer_of(*there);
    return layer ? most_stay(to, layer->available, from.layer.available) : Result<void>();
  }
  if (record && from.record && encode(*record) == encode(*from.record)) return {};
  return fail(Errc::invalid_argument, to + " holds tiles of another source or of other options: "
                                           "name another file, or --force to replace them");
}

Result<CopyReport> into_archive(const Source& from, const std::string& to, const CopyOptions& o,
                                const Progress& progress) {
  if (auto free = check_target(from, to, o.force); !free) return std::unexpected(free.error());
  auto writer = write_archive_store(to, {.layer = from.layer,
                                         .layer_text = from.layer_text,
                                         .record_text = from.record ? encode(*from.record) : "",
                                         .blocks = from.blocks});
  if (!writer) return std::unexpected(writer.error());
  CopyReport report{.tiles = from.tiles};
  std::uint64_t done = 0;
  for (std::size_t z = 0; z < from.areas.size(); ++z) {
    std::vector<TileId> ids(from.areas[z].size());
    for (std::size_t k = 0; k < ids.size(); ++k) {
      const auto [x, y] = from.areas[z][k];
      ids[k] = {int(z), x, y};
    }
    (*writer)->put_in_order(ids);
    for (std::size_t at = 0; at < ids.size(); at += kChunk) {
      if (progress.stopped())
        return fail(Errc::cancelled, "stopped after " + std::to_string(done) + " of " +
                                         std::to_string(from.tiles) +
                                         " tiles; nothing is left of it");
      std::vector<Result<Ready>> chunk(std::min(kChunk, ids.size() - at),
                                       fail(Errc::internal, "not read"));
      parallel_for(chunk.size(), from.threads,
                   [&](std::size_t k) { chunk[k] = fetch(from, ids[at + k], true); });
      for (std::size_t k = 0; k < chunk.size(); ++k) {
        if (!chunk[k]) return std::unexpected(chunk[k].error());
        report.bytes += chunk[k]->bytes.size();
        report.unvouched += !chunk[k]->vouched;
        if (auto added = (*writer)->add(ids[at + k], chunk[k]->bytes, chunk[k]->facts); !added)
          return std::unexpected(added.error());
      }
      done += chunk.size();
      progress.at(double(done) / double(from.tiles));
    }
  }
  if (auto finished = (*writer)->finish(); !finished) return std::unexpected(finished.error());
  return report;
}

/// As a build of these tiles would write them. Without a record, which alone tells whether two tile
/// sets are the same, every tile is compared.
class IntoFolder {
 public:
  IntoFolder(const Source& from, const std::string& to, const CopyOptions& o)
      : from_(from), to_(to), force_(o.force), ids_(from.areas, 0, int(from.areas.size()) - 1) {}

  Result<CopyReport> run(const Progress&);

 private:
  const Source& from_;
  const std::string to_;
  const bool force_;
  const TileOrder ids_;
  std::unique_ptr<TileWriter> writer_;
  std::mutex mutex_;
  std::optional<Error> error_;
  CopyReport report_;

  /// It speaks of hashes of blocks, by which a build goes on: a folder without them has none.
  bool has_record() const { return from_.record && !from_.blocks.empty(); }
  bool gzip() const { return from_.record && from_.record->gzip; }
  bool same_there(const TileStore& there, TileId id, const Bytes& wanted) const {
    const auto found = there.look_at(id);
    return found && found->vouched == Vouched::yes && found->bytes == wanted;
  }
  Result<std::vector<std::uint8_t>> changed();
  void copy(std::size_t k, const TileStore& there);
  void give_up(Error error) {
    const std::lock_guard lock(mutex_);
    if (!error_) error_ = std::move(error);
  }
  bool given_up() {
    const std::lock_guard lock(mutex_);
    return error_.has_value();
  }
};

/// Which tiles of an earlier copy are others by now.
Result<std::vector<std::uint8_t>> IntoFolder::changed() {
  const auto there = open_store(to_);
  std::vector<std::uint8_t> flags(ids_.size());
  parallel_for(ids_.size(), from_.threads, [&](std::size_t k) {
    const auto tile = fetch(from_, ids_[k], gzip());
    flags[k] = !tile || !same_there(*there, ids_[k], tile->bytes);
  });
  return flags;
}

void IntoFolder::copy(std::size_t k, const TileStore& there) {
  const auto known = writer_->finished(k);
  std::uint64_t size = known ? known->size : 0;
  bool kept = known.has_value(), vouched = true;
  if (!known || !has_record()) {
    auto tile = fetch(from_, ids_[k], gzip());
    if (!tile) return give_up(tile.error());
    size = tile->bytes.size(), vouched = tile->vouched;
    kept = known && same_there(there, ids_[k], tile->bytes);
    if (!kept) {
      const std::string_view bytes{reinterpret_cast<const char*>(tile->bytes.data()), size};
      if (auto done = writer_->write(k, bytes, tile->facts); !done) return give_up(done.error());
    }
  }
  const std::lock_guard lock(mutex_);
  report_.bytes += size, report_.kept += kept, report_.unvouched += !vouched;
}

Result<CopyReport> IntoFolder::run(const Progress& progress) {
  const auto store = lock_store(to_);
  if (!store) return std::unexpected(store.error());
  const BuildRecord record = has_record() ? *from_.record : BuildRecord{};
  const TileWork work{.ids = ids_,
                      .levels = from_.layer.available,
                      .record = record,
                      .blocks = {record.heights, [&] { return from_.blocks; }},
                      .changes = [&](const BuildRecord&, std::string_view) { return changed(); },
                      .force = force_,
                      .threads = from_.threads};
  auto claimed = (*store)->claim(work, progress.part(0, 0.05));
  if (!claimed) return std::unexpected(claimed.error());
  writer_ = std::move(*claimed);
  const auto there = open_store(to_);
  report_.tiles = from_.tiles;
  std::atomic<std::size_t> done = 0;
  parallel_for(ids_.size(), from_.threads, [&](std::size_t k) {
    if (given_up() || progress.stopped()) return;
    copy(k, *there);
    if (++done % std::max<std::size_t>(1, ids_.size() / 300) == 0)
      progress.at(0.05 + 0.95 * double(done) / double(ids_.size()));
  });
  const auto committed = writer_->commit();  // what was copied is not lost, however it ended
  if (error_) return std::unexpected(*error_);
  if (!committed) return std::unexpected(committed.error());
  if (progress.stopped())
    return fail(Errc::cancelled, "stopped after " + std::to_string(done) + " of " +
                                     std::to_string(ids_.size()) +
                                     " tiles; run the same command to go on");
  if (auto finished = writer_->finish(from_.layer_text); !finished)
    return std::unexpected(finished.error());
  return report_;
}

}  // namespace

Result<CopyReport> copy_store(const TileStore& store, const std::string& to, const CopyOptions& o,
                              const Progress& progress) {
  auto from = look_at_source(store, o);
  if (!from) return std::unexpected(from.error());
  if (o.threads == 0 && remote::is_remote(to)) from->threads = kRemoteThreads;
  if (!remote::is_remote(to) && !store.remote()) {
    const auto within = folder::lies_within(to, store.name());
    if (!within) return std::unexpected(within.error());
    if (*within)
      return fail(Errc::invalid_argument,
                  to + " is, or lies in, what is to be copied: name another place");
  }
  if (names_archive(to)) return into_archive(*from, to, o, progress);
  if (remote::is_remote(to)) {
    if (store.name() == object_prefix(to))
      return fail(Errc::invalid_argument, to + " is what is to be copied: name another prefix");
    return IntoFolder(*from, to, o).run(progress);
  }
  const auto type = file_type_of(to);
  if (!type) return std::unexpected(type.error());
  if (*type != fs::file_type::not_found && *type != fs::file_type::directory)
    return fail(Errc::invalid_argument,
                to + " is a file, and no name of an archive (.pmtiles, .mbtiles)");
  return IntoFolder(*from, to, o).run(progress);
}

}  // namespace tind
