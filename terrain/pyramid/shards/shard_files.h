#pragma once
// What lies in the folder of shards: packs, the records that commit them, and what tells how far
// those are that are being made. Names, bytes, and the judge of them. docs/formats.md has the
// files.

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "terrain/base/result.h"
#include "terrain/pyramid/shards/shard_plan.h"

namespace tind {

/// What commits a pack: as long as it is not there, there is no shard.
struct ShardRecord {
  struct Level {
    int level = 0;
    std::uint64_t tiles = 0, bytes = 0;
    double worst_error_m = 0, worst_edge_error_m = 0;
    friend bool operator==(const Level&, const Level&) = default;
  };
  std::string plan;  // its hash
  std::string shard;
  std::uint64_t tiles = 0, bytes = 0;  // bytes: of the pack
  std::string sha256;                  // of the pack, 64 digits
  std::uint64_t not_one_sided = 0;
  std::vector<Level> levels;
  std::uint64_t residual_bytes = 0;  // of the shard's part of the residual index; 0: it has none
  std::string residual_sha256 = {};
};

std::string encode(const ShardRecord&);
/// bad_data for what encode() did not make.
Result<ShardRecord> decode_shard_record(std::string_view text);

/// "00007"; the top is "top".
std::string shard_name(std::size_t shard);

/// Where the files are. `folder`: the one that has `shards/` in it.
class ShardFolder {
 public:
  explicit ShardFolder(std::string folder) : folder_(std::move(folder) + "/shards") {}

  const std::string& path() const { return folder_; }
  /// Whose files these are: the hash of a plan.
  std::string plan() const { return folder_ + "/plan"; }
  std::string pack(std::size_t shard) const { return at(shard, ".pmtiles"); }
  std::string record(std::size_t shard) const { return at(shard, ".json"); }
  std::string tiles(std::size_t shard) const {
    return at(shard, ".tiles");
  }  // that are made so far
  std::string error(std::size_t shard) const { return at(shard, ".error"); }
  /// What the shard knows of the residual index (residual_index.h).
  std::string residuals(std::size_t shard) const { return at(shard, ".residuals"); }
  /// Of this process alone.
  std::string beat(std::size_t shard) const;
  std::string own_pack(std::size_t shard) const;
  std::string own_residuals(std::size_t shard) const;

 private:
  std::string folder_;
  std::string at(std::size_t shard, const std::string& ending) const {
    return folder_ + "/" + shard_name(shard) + ending;
  }
};

enum class ShardState { done, running, failed, missing };
std::string name_of(ShardState);

struct ShardStatus {
  ShardState state = ShardState::missing;
  std::uint64_t tiles = 0, made = 0;  // made: as far as is known
  std::string where;                  // running: HOST-PID, of several the last to be heard of
  std::string what;                   // failed: why
  double silent_s = 0;                // running: since it was heard of
  bool unread = false;                // failed: a file of it could not be read, and may be sound
};

struct StatusOptions {
  double silence_s = 60;    // who is not heard of for so long runs no more
  bool every_byte = false;  // hash packs, too; else their size alone is compared
};

/// Of all shards in their order, and of the top as the last. Fails where the folder cannot be read;
/// one that is not there has none.
Result<std::vector<ShardStatus>> shard_status(const ShardPlan&, const ShardFolder&,
                                              const StatusOptions& = {});

/// Fails (bad_data) where the folder has shards of another plan: two plans never write into
/// one folder.
Result<void> belongs_to(const ShardFolder&, const std::string& hash);

/// Of one; `made` is not looked for where it runs.
ShardStatus judge_shard(const ShardPlan&, const std::string& hash, const ShardFolder&,
                        std::size_t shard, bool every_byte);

/// Why the last run of a shard failed, for shard_status(). What cannot be written is not said.
void leave_error(const ShardFolder&, std::size_t shard, const Error&);

/// What runs left that were killed, and that nobody touched for so long: unfinished packs, words of
/// who runs, files that had not got their names, tiles of shards that are done.
void remove_leftovers(const ShardFolder&, double untouched_s = 600);
/// The same of what was to become this file, beside it.
void remove_unfinished(const std::string& file, double untouched_s = 600);

/// The SHA-256 of a file, read in parts.
Result<std::string> sha256_of_file(const std::string& path);

/// Says every so many seconds that a shard is being made, as long as it lives.
class Heartbeat {
 public:
  Heartbeat(std::string path, std::uint64_t tiles, double every_s);
  ~Heartbeat();
  Heartbeat(const Heartbeat&) = delete;
  Heartbeat& operator=(const Heartbeat&) = delete;
  void made(std::uint64_t tiles);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace tind
