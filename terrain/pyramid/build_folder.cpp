// The record names the blocks' file by its digest. An update has both in its own folder, with the
// tiles. There is one moment at which it counts, the renaming of that folder: before it, the old
// record says what the directory holds; after it, every run moves what is left of it first.

#include "terrain/pyramid/build_folder.h"

#include <fmt/format.h>
#include <unistd.h>
#include <xxhash.h>

#include <algorithm>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <set>

#include "proto/file_io.h"
#include "terrain/pyramid/dirty_tiles.h"
#include "terrain/pyramid/plan_source.h"

namespace tind {

namespace fs = std::filesystem;

namespace {

using Json = nlohmann::ordered_json;

/// Grows with every change of what tiles that rest on the residual index share with their
/// neighbours: borders, normals.
constexpr int kIndexedTiles = 3;

constexpr const char* kRecord = "/tind-build.json";
constexpr const char* kBlocks = "/tind-blocks-";
constexpr const char* kLayer = "/layer.json";
constexpr const char* kAside = "/tind-update";        // an update, on the way
constexpr const char* kReady = "/tind-update-ready";  // whole: it counts

/// Where the posts are and what their heights mean.
std::string grid_of(const DemInfo& info) {
  const Affine& a = info.post_to_crs;
  const std::string text = fmt::format("{} {} {} {} {} {} {} {} {} {} {} {}", info.cols, info.rows,
                                       a.x0, a.x_col, a.x_row, a.y0, a.y_col, a.y_row, info.crs_wkt,
                                       name(info.datum), info.rounding_m, info.wraps_longitude);
  const XXH128_hash_t h = XXH3_128bits(text.data(), text.size());
  return fmt::format("{:016x}{:016x}", h.high64, h.low64);
}

/// Everything that the tiles depend on.
Json record_of(const DemSource& source, const TilePlan& plan, const SourceBlocks& blocks,
               const BuildOptions& o) {
  Json j;
  j["made_by"] = "tind build";
  j["format"] = 2;
  j["grid"] = grid_of(source.info());
  j["heights"] = blocks.digest();
  j["max_error_m"] = o.tiles.max_error_m;
  j["error_factor"] = o.tiles.error_factor;
  j["min_level"] = o.tiles.min_level;
  j["max_level"] = o.tiles.max_level;
  j["side"] = o.tiles.side;
  j["effort"] = o.tiles.effort;
  j["gzip"] = o.gzip;
  if (o.tiles.exact_posts > 0) j["exact_posts"] = o.tiles.exact_posts;
  // Old and new ones would not fit at their edges.
  if (deepest_indexed_level(source.info(), plan) >= 0) j["indexed_tiles"] = kIndexedTiles;
  // By level: a source with a larger range of heights can need coarser steps.
  for (int z = 0; z <= plan.max_level(); ++z) j["steps_m"].push_back(plan.level(z).border_step_m);
  return j;
}

Result<void> write_whole(const std::string& path, std::string_view bytes) {
  const auto done = proto::write_whole_file(path, bytes);
  if (!done) return fail(Errc::io, done.error());
  return {};
}

Result<void> cannot(const std::string& what, const std::error_code& error) {
  return fail(Errc::io, "cannot " + what + ": " + error.message());
}

/// The blocks of the content that the tiles here were made of.
Result<SourceBlocks> old_blocks(const Json& record, const DemInfo& info, const BuildOptions& o) {
  const Json heights = record.value("heights", Json());
  const std::string digest = heights.is_string() ? std::string(heights) : "";
  const std::string path = o.output + kBlocks + digest;
  const auto bytes = proto::read_whole_file(path);
  if (!bytes) return fail(Errc::io, bytes.error());
  auto blocks = SourceBlocks::decode(*bytes, info, digest);
  if (!blocks) return fail(path, blocks.error());
  return blocks;
}

/// Which tiles depend on heights that changed.
std::vector<std::uint8_t> tiles_of_changes(const DemSource& source, const TilePlan& plan,
                                           const TileOrder& ids, const SourceBlocks& before,
                                           const SourceBlocks& after, const Json& old_steps,
                                           UpdateReport& report) {
  report.updated = true;
  report.blocks = after.size();
  report.block_posts = after.side();
  for (const std::uint8_t differs : after.difference(before)) report.changed_blocks += differs;
  std::vector<std::uint8_t> dirty = dirty_tiles(source, plan, ids, before, after);
  std::vector<bool> other_steps;
  for (int z = 0; z <= plan.max_level(); ++z) {
    const bool same = std::size_t(z) < old_steps.size() &&
                      old_steps[std::size_t(z)] == plan.level(z).border_step_m;
    other_steps.push_back(!same);
    report.levels_of_other_steps += !same;
  }
  for (std::size_t k = 0; k < ids.size(); ++k) {
    // A tile that stands in for missing children has vertices of the next level.
    const auto z = std::size_t(ids[k].level);
    dirty[k] = dirty[k] || other_steps[z] || (z + 1 < other_steps.size() && other_steps[z + 1]);
    report.dirty_tiles += dirty[k];
  }
  return dirty;
}

Result<void> remove_all_tiles(const BuildOptions& o) {
  std::error_code error;
  // So that none of them can be taken for ours.
  fs::remove(o.output + kLayer, error);
  if (!error) fs::remove_all(o.output + kAside, error);
  for (int z = 0; z <= tiling::kMaxLevel && !error; ++z)
    fs::remove_all(o.output + "/" + std::to_string(z), error);
  if (error) return cannot("empty " + o.output, error);
  return {};
}

Result<void> write_record(const std::string& folder, const Json& record,
                          const SourceBlocks& blocks) {
  if (auto w = write_whole(folder + kBlocks + blocks.digest(), blocks.encode()); !w) return w;
  return write_whole(folder + kRecord, record.dump(1) + "\n");
}

/// Removes hashes of other content than the record's. A file too many does no harm.
void remove_other_blocks(const std::string& folder, const std::string& digest) {
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(folder, error)) {
    const std::string path = entry.path().string();
    if (path.starts_with(folder + kBlocks) && path != folder + kBlocks + digest)
      fs::remove(entry.path(), error);
  }
}

/// Moves the files of an update that is whole to where they belong: the record last.
Result<void> adopt(const std::string& output) {
  const std::string ready = output + kReady;
  std::error_code error;
  if (!fs::exists(ready, error)) return {};
  std::vector<std::string> files;
  for (fs::recursive_directory_iterator it(ready, error), end; !error && it != end;
       it.increment(error))
    if (it->is_regular_file(error)) files.push_back(it->path().string().substr(ready.size()));
  if (error) return cannot("look into " + ready, error);
  std::ranges::sort(files, {}, [](const std::string& f) { return std::pair(f == kRecord, f); });
  for (const std::string& file : files) {
    fs::rename(ready + file, output + file, error);
    if (error) return cannot("move " + ready + file, error);
  }
  if (const auto text = proto::read_whole_file(output + kRecord)) {
    const Json record = Json::parse(*text, nullptr, false);
    if (record.is_object() && record.contains("heights") && record["heights"].is_string())
      remove_other_blocks(output, record["heights"]);
  }
  fs::remove_all(ready, error);
  if (error) return cannot("remove " + ready, error);
  return {};
}

/// The folder of an update, with what an earlier run to the same content left in it.
Result<void> open_aside(const std::string& output, const Json& wanted, const SourceBlocks& blocks) {
  const std::string aside = output + kAside;
  const auto text = proto::read_whole_file(aside + kRecord);
  if (text && Json::parse(*text, nullptr, false) == wanted) return {};
  std::error_code error;
  fs::remove_all(aside, error);
  if (!error) fs::create_directories(aside, error);
  if (error) return cannot("make the folder " + aside, error);
  return write_record(aside, wanted, blocks);
}

/// The same but for the heights, and the steps that follow from them.
bool same_but_heights(Json a, Json b) {
  for (const char* key : {"heights", "steps_m"}) a.erase(key), b.erase(key);
  return a == b;
}

}  // namespace

Result<BuildFolder> BuildFolder::claim(const DemSource& source, const TilePlan& plan,
                                       const TileOrder& ids, const SourceBlocks& blocks,
                                       const BuildOptions& o) {
  BuildFolder folder(ids);
  folder.output_ = o.output;
  std::error_code error;
  fs::create_directories(o.output, error);
  if (error) return fail(Errc::io, "cannot create " + o.output + ": " + error.message());
  if (auto done = adopt(o.output); !done) return std::unexpected(done.error());
  const std::string path = o.output + kRecord;
  const Json wanted = record_of(source, plan, blocks, o);
  std::string why;
  if (fs::exists(path)) {
    const auto text = proto::read_whole_file(path);
    if (!text) return fail(Errc::io, text.error());
    const Json found = Json::parse(*text, nullptr, false);
    if (found == wanted) {
      fs::remove_all(o.output + kAside, error);  // to content that has gone again
      if (auto done = folder.make_folders(); !done) return std::unexpected(done.error());
      return folder;
    }
    why = "tiles of other options";
    if (found.is_object() && same_but_heights(found, wanted)) {
      const auto before = old_blocks(found, source.info(), o);
      if (before) {
        folder.dirty_ = tiles_of_changes(source, plan, ids, *before, blocks,
                                         found.value("steps_m", Json::array()), folder.update_);
        if (auto done = open_aside(o.output, wanted, blocks); !done)
          return std::unexpected(done.error());
        if (auto done = folder.make_folders(); !done) return std::unexpected(done.error());
        return folder;
      }
      why = "tiles of other heights, and what changed cannot be told (" + before.error().what + ")";
    } else if (found.is_object() && found.value("grid", Json()) != wanted["grid"]) {
      why = "tiles of another source";
    }
    why += " (see " + path + ")";
  } else if (fs::exists(o.output + kLayer)) {
    why = "a tile set that tind build did not make";
  }
  if (!why.empty() && !o.force) {
    return fail(Errc::invalid_argument, o.output + " holds " + why +
                                            ": choose another directory, or --force to replace "
                                            "them");
  }
  if (auto done = remove_all_tiles(o); !done) return std::unexpected(done.error());
  if (auto w = write_record(o.output, wanted, blocks); !w) return std::unexpected(w.error());
  remove_other_blocks(o.output, blocks.digest());
  if (auto done = folder.make_folders(); !done) return std::unexpected(done.error());
  return folder;
}

std::string BuildFolder::path(std::size_t k) const {
  return output_ + (is_aside(k) ? kAside : "") + "/" + ids_[k].text() + ".terrain";
}

Result<void> BuildFolder::make_folders() const {
  std::set<std::string> made;
  for (std::size_t k = 0; k < ids_.size(); ++k) {
    std::string folder = path(k);
    folder.resize(folder.find_last_of('/'));
    if (!made.insert(folder).second) continue;
    std::error_code error;
    fs::create_directories(folder, error);
    if (error) return cannot("make the folder " + folder, error);
  }
  return {};
}

std::optional<std::size_t> BuildFolder::finished(std::size_t k) const {
  std::error_code error;
  const auto bytes = fs::file_size(path(k), error);
  if (error) return {};
  return std::size_t(bytes);
}

Result<void> BuildFolder::write(std::size_t k, std::string_view bytes) const {
  return write_whole(path(k), bytes);
}

Result<void> BuildFolder::finish(std::string_view layer_json) const {
  ::sync();  // the tiles, before anything says that they are there
  if (dirty_.empty()) return write_whole(output_ + kLayer, layer_json);
  if (auto w = write_whole(output_ + kAside + kLayer, layer_json); !w) return w;
  std::error_code error;
  fs::rename(output_ + kAside, output_ + kReady, error);
  if (error) return cannot("move " + output_ + kAside, error);
  return adopt(output_);
}

}  // namespace tind
