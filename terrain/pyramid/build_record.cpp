// The record names the blocks' file by its digest. So there is one moment at which a directory
// changes over to new content, the renaming of the record: before it, the old blocks say what was;
// after it, every tile that is still there is right.

#include "terrain/pyramid/build_record.h"

#include <fmt/format.h>
#include <xxhash.h>

#include <filesystem>
#include <nlohmann/json.hpp>

#include "proto/file_io.h"
#include "terrain/pyramid/dirty_tiles.h"

namespace tind {

namespace fs = std::filesystem;

namespace {

using Json = nlohmann::ordered_json;

constexpr const char* kRecord = "tind-build.json";
constexpr const char* kBlocks = "tind-blocks-";

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
  // By level: a source with a larger range of heights can need coarser steps.
  for (int z = 0; z <= plan.max_level(); ++z) j["steps_m"].push_back(plan.level(z).border_step_m);
  return j;
}

std::string tile_path(const BuildOptions& o, TileId id) {
  return o.output + "/" + id.text() + ".terrain";
}

Result<void> remove_file(const std::string& path) {
  std::error_code error;
  fs::remove(path, error);
  if (error) return fail(Errc::io, "cannot remove " + path + ": " + error.message());
  return {};
}

/// The blocks of the content that the tiles here were made of.
Result<SourceBlocks> old_blocks(const Json& record, const DemInfo& info, const BuildOptions& o) {
  const Json heights = record.value("heights", Json());
  const std::string digest = heights.is_string() ? std::string(heights) : "";
  const std::string path = o.output + "/" + kBlocks + digest;
  const auto bytes = proto::read_whole_file(path);
  if (!bytes) return fail(Errc::io, bytes.error());
  auto blocks = SourceBlocks::decode(*bytes, info, digest);
  if (!blocks) return fail(path, blocks.error());
  return blocks;
}

/// Removes what depends on heights that changed.
Result<UpdateReport> remove_dirty(const DemSource& source, const TilePlan& plan,
                                  const TileOrder& ids, const SourceBlocks& before,
                                  const SourceBlocks& after, const Json& old_steps,
                                  const BuildOptions& o) {
  UpdateReport report;
  report.updated = true;
  report.blocks = after.size();
  report.block_posts = after.side();
  for (const std::uint8_t differs : after.difference(before)) report.changed_blocks += differs;
  const std::vector<std::uint8_t> dirty = dirty_tiles(source, plan, ids, before, after);
  std::vector<bool> other_steps;
  for (int z = 0; z <= plan.max_level(); ++z) {
    const bool same = std::size_t(z) < old_steps.size() &&
                      old_steps[std::size_t(z)] == plan.level(z).border_step_m;
    other_steps.push_back(!same);
    report.levels_of_other_steps += !same;
  }
  if (auto done = remove_file(o.output + "/layer.json"); !done)
    return std::unexpected(done.error());
  for (std::size_t k = 0; k < ids.size(); ++k) {
    const TileId id = ids[k];
    if (!dirty[k] && !other_steps[std::size_t(id.level)]) continue;
    ++report.dirty_tiles;
    if (auto done = remove_file(tile_path(o, id)); !done) return std::unexpected(done.error());
  }
  return report;
}

Result<void> remove_all_tiles(const BuildOptions& o) {
  std::error_code error;
  // So that none of them can be taken for ours.
  fs::remove(o.output + "/layer.json", error);
  for (int z = 0; z <= tiling::kMaxLevel && !error; ++z)
    fs::remove_all(o.output + "/" + std::to_string(z), error);
  if (error) return fail(Errc::io, "cannot empty " + o.output + ": " + error.message());
  return {};
}

Result<void> write_record(const Json& record, const SourceBlocks& blocks, const BuildOptions& o) {
  const std::string name = kBlocks + blocks.digest();
  if (auto w = write_whole(o.output + "/" + name, blocks.encode()); !w) return w;
  if (auto w = write_whole(o.output + "/" + kRecord, record.dump(1) + "\n"); !w) return w;
  std::error_code error;  // a file too many does no harm
  for (const auto& entry : fs::directory_iterator(o.output, error)) {
    const std::string other = entry.path().filename().string();
    if (other.starts_with(kBlocks) && other != name) fs::remove(entry.path(), error);
  }
  return {};
}

/// The same but for the heights, and the steps that follow from them.
bool same_but_heights(Json a, Json b) {
  for (const char* key : {"heights", "steps_m"}) a.erase(key), b.erase(key);
  return a == b;
}

}  // namespace

Result<void> write_whole(const std::string& path, std::string_view bytes) {
  const auto done = proto::write_whole_file(path, bytes);
  if (!done) return fail(Errc::io, done.error());
  return {};
}

Result<UpdateReport> claim_directory(const DemSource& source, const TilePlan& plan,
                                     const TileOrder& ids, const SourceBlocks& blocks,
                                     const BuildOptions& o) {
  std::error_code error;
  fs::create_directories(o.output, error);
  if (error) return fail(Errc::io, "cannot create " + o.output + ": " + error.message());
  const std::string path = o.output + "/" + kRecord;
  const Json wanted = record_of(source, plan, blocks, o);
  UpdateReport report;
  if (const bool there = fs::exists(path); there) {
    const auto text = proto::read_whole_file(path);
    if (!text) return fail(Errc::io, text.error());
    const Json found = Json::parse(*text, nullptr, false);
    if (found == wanted) return report;
    std::string why = "other options";
    if (found.is_object() && same_but_heights(found, wanted)) {
      const auto before = old_blocks(found, source.info(), o);
      if (before) {
        auto removed = remove_dirty(source, plan, ids, *before, blocks,
                                    found.value("steps_m", Json::array()), o);
        if (!removed) return removed;
        if (auto w = write_record(wanted, blocks, o); !w) return std::unexpected(w.error());
        return removed;
      }
      why = "other heights, and what changed cannot be told (" + before.error().what + ")";
    } else if (found.is_object() && found.value("grid", Json()) != wanted["grid"]) {
      why = "another source";
    }
    if (!o.force) {
      return fail(Errc::invalid_argument,
                  o.output + " holds tiles of " + why + " (see " + path +
                      "): choose another directory, or --force to replace them");
    }
  } else if (fs::exists(o.output + "/layer.json") && !o.force) {
    return fail(Errc::invalid_argument, o.output +
                                            " holds a tile set that tind build did not make: "
                                            "choose another directory, or --force");
  }
  if (auto done = remove_all_tiles(o); !done) return std::unexpected(done.error());
  if (auto w = write_record(wanted, blocks, o); !w) return std::unexpected(w.error());
  return report;
}

}  // namespace tind
