#include "terrain/pyramid/shards/shard_files.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cctype>
#include <cerrno>
#include <chrono>
#include <condition_variable>
#include <filesystem>
#include <fstream>
#include <functional>
#include <map>
#include <mutex>
#include <nlohmann/json.hpp>
#include <optional>
#include <thread>

#include "proto/json_member.h"
#include "proto/json_text.h"
#include "terrain/base/errno_text.h"
#include "terrain/base/file_io.h"
#include "terrain/base/file_there.h"
#include "terrain/base/folder_entries.h"
#include "terrain/base/sha256.h"

namespace tind {

namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

/// What ought to be some kilobytes may be whatever somebody put there.
Result<std::string> read_small(const std::string& path) {
  constexpr std::uintmax_t kLargest = 16u << 20;
  std::error_code none;
  if (const auto size = fs::file_size(path, none); !none && size > kLargest)
    return fail(Errc::bad_data, path + " is far too large to be what its name says");
  return read_regular_file(path);
}

constexpr int kFormat = 1;

/// "HOST-PID", with nothing in it that a file's name cannot have.
std::string who_am_i() {
  char host[256] = "unknown";
  ::gethostname(host, sizeof host - 1);
  std::string name(host);
  for (char& c : name)
    if (!std::isalnum(static_cast<unsigned char>(c)) && c != '-') c = '-';
  return name + "-" + std::to_string(::getpid());
}

Json content_of(const ShardRecord& r) {
  Json j;
  j["tind_shard"] = kFormat;
  j["plan"] = r.plan;
  j["shard"] = r.shard;
  j["tiles"] = r.tiles;
  j["bytes"] = r.bytes;
  j["sha256"] = r.sha256;
  j["not_one_sided"] = r.not_one_sided;
  j["levels"] = Json::array();
  for (const ShardRecord::Level& l : r.levels)
    j["levels"].push_back({{"level", l.level},
                           {"tiles", l.tiles},
                           {"bytes", l.bytes},
                           {"worst_error_m", l.worst_error_m},
                           {"worst_edge_error_m", l.worst_edge_error_m}});
  if (r.residual_bytes > 0)
    j["residuals"] = {{"bytes", r.residual_bytes}, {"sha256", r.residual_sha256}};
  return j;
}

constexpr std::int64_t kMost = std::int64_t(1) << 52;

std::optional<ShardRecord::Level> level_in(const Json& j) {
  const auto level = json::whole(j, "level", 0, tiling::kMaxLevel);
  const auto tiles = json::whole(j, "tiles", 0, kMost), bytes = json::whole(j, "bytes", 0, kMost);
  const auto worst = json::number(j, "worst_error_m"), edge = json::number(j, "worst_edge_error_m");
  if (!level || !tiles || !bytes || !worst || !edge) return {};
  return ShardRecord::Level{int(*level), std::uint64_t(*tiles), std::uint64_t(*bytes), *worst,
                            *edge};
}

double seconds_since(fs::file_time_type then) {
  return std::chrono::duration<double>(fs::file_time_type::clock::now() - then).count();
}

/// What is heard of a shard by others.
struct Heard {
  double silent_s = 0;
  std::string where;
  std::uint64_t made = 0;
};

/// "00007.HOST-PID.beat": of which shard, and who.
std::optional<std::pair<std::string, std::string>> beat_of(const std::string& file) {
  constexpr std::string_view kEnding = ".beat";
  const auto dot = file.find('.');
  if (!file.ends_with(kEnding) || dot + 1 >= file.size() - kEnding.size()) return {};
  return std::pair{file.substr(0, dot),
                   file.substr(dot + 1, file.size() - kEnding.size() - dot - 1)};
}

/// The latest of each shard, by its name.
Result<std::map<std::string, Heard>> all_heard(const std::string& folder, double silence_s) {
  std::map<std::string, Heard> heard;
  const auto entries = entries_of(folder);
  if (!entries && entries.error().code == Errc::not_found) return heard;
  if (!entries) return std::unexpected(entries.error());
  std::error_code error;
  for (const fs::directory_entry& entry : *entries) {
    const auto beat = beat_of(entry.path().filename().string());
    if (!beat) continue;
    const auto at = entry.last_write_time(error);
    if (error == std::errc::no_such_file_or_directory) continue;  // gone by now
    if (error)
      return fail(Errc::io, "cannot look at " + entry.path().string() + ": " + error.message());
    const double silent = std::max(0.0, seconds_since(at));
    const auto known = heard.find(beat->first);
    if (silent > silence_s || (known != heard.end() && known->second.silent_s <= silent)) continue;
    Heard& h = heard[beat->first];
    h = {silent, beat->second, 0};
    if (const auto text = read_small(entry.path().string()))
      if (const Json j = json::parse<Json>(*text); j.is_object())
        h.made = std::uint64_t(json::whole(j, "made", 0, kMost).value_or(0));
  }
  return heard;
}

}  // namespace

std::string encode(const ShardRecord& r) { return json::to_text(content_of(r), 1) + "\n"; }

Result<ShardRecord> decode_shard_record(std::string_view text) {
  const auto bad = fail(Errc::bad_data, "no record of a shard, or damaged");
  const Json j = json::parse<Json>(text);
  const auto plan = json::text(j, "plan"), shard = json::text(j, "shard"),
             hash = json::text(j, "sha256");
  const auto tiles = json::whole(j, "tiles", 0, kMost), bytes = json::whole(j, "bytes", 0, kMost),
             sides = json::whole(j, "not_one_sided", 0, kMost);
  const Json* const levels = json::member(j, "levels");
  if (!plan || !shard || !hash || !tiles || !bytes || !sides || !levels || !levels->is_array())
    return bad;
  ShardRecord r{
      *plan, *shard, std::uint64_t(*tiles), std::uint64_t(*bytes), *hash, std::uint64_t(*sides), {},
      0,     {}};
  if (const Json* const residuals = json::member(j, "residuals")) {
    const auto size = json::whole(*residuals, "bytes", 1, kMost);
    const auto sum = json::text(*residuals, "sha256");
    if (!size || !sum) return bad;
    r.residual_bytes = std::uint64_t(*size), r.residual_sha256 = *sum;
  }
  for (const Json& level : *levels) {
    const auto one = level_in(level);
    if (!one) return bad;
    r.levels.push_back(*one);
  }
  if (encode(r) != text) return bad;
  return r;
}

std::string shard_name(std::size_t shard) {
  if (shard == ShardTiles::kTop) return "top";
  const std::string digits = std::to_string(shard);
  return std::string(5 - std::min<std::size_t>(5, digits.size()), '0') + digits;
}

std::string ShardFolder::beat(std::size_t shard) const {
  return at(shard, "." + who_am_i() + ".beat");
}
std::string ShardFolder::own_pack(std::size_t shard) const {
  return at(shard, "." + who_am_i() + ".pmtiles");
}

std::string ShardFolder::own_residuals(std::size_t shard) const {
  return at(shard, "." + who_am_i() + ".residuals");
}

std::string name_of(ShardState state) {
  switch (state) {
    case ShardState::done:
      return "done";
    case ShardState::running:
      return "running";
    case ShardState::failed:
      return "failed";
    case ShardState::missing:
      break;
  }
  return "missing";
}

Result<std::string> sha256_of_file(const std::string& path) {
  const int file = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (file < 0)
    return fail(errno == ENOENT ? Errc::not_found : Errc::io,
                "cannot open " + path + ": " + errno_text(errno));
  Sha256Sum sum;
  std::string part(1u << 20, '\0');
  for (;;) {
    const ssize_t got = ::read(file, part.data(), part.size());
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) {
      const std::string why = errno_text(errno);
      ::close(file);
      return fail(Errc::io, "cannot read " + path + ": " + why);
    }
    if (got == 0) break;
    sum.add(std::string_view(part).substr(0, std::size_t(got)));
  }
  ::close(file);
  return hex_of(sum.finish());
}

namespace {

/// Fails where a file is not the one that a record speaks of (bad_data), or cannot be read (io).
Result<void> is_of_record(const std::string& record, const std::string& file, std::uint64_t bytes,
                          const std::string& sha256, bool every_byte) {
  const auto type = file_type_of(file);
  if (!type) return std::unexpected(type.error());
  if (*type != fs::file_type::regular)
    return fail(Errc::bad_data, record + " says that there is " + file + ", and there is none");
  std::error_code error;
  const auto size = fs::file_size(file, error);
  if (error) return fail(Errc::io, "cannot look into " + file + ": " + error.message());
  const std::string other = file + " is not the one of its record: ";
  if (size != bytes)
    return fail(Errc::bad_data,
                other + "it has " + std::to_string(size) + " bytes, not " + std::to_string(bytes));
  if (!every_byte) return {};
  const auto sum = sha256_of_file(file);
  if (!sum) return std::unexpected(sum.error());
  if (*sum != sha256) return fail(Errc::bad_data, other + "its bytes are others");
  return {};
}

}  // namespace

Result<void> belongs_to(const ShardFolder& folder, const std::string& hash) {
  const auto text = read_small(folder.plan());
  if (!text && text.error().code == Errc::not_found) return {};
  if (!text) return std::unexpected(text.error());
  if (*text == hash + "\n") return {};
  return fail(Errc::bad_data,
              folder.path() + " has shards of another plan: name another directory, or remove it");
}

void leave_error(const ShardFolder& folder, std::size_t shard, const Error& error) {
  std::error_code none;
  fs::create_directories(folder.path(), none);
  (void)write_whole_file(folder.error(shard), error.what + "\n");
}

ShardStatus judge_shard(const ShardPlan& plan, const std::string& hash, const ShardFolder& folder,
                        std::size_t shard, bool every_byte) {
  ShardStatus s;
  s.tiles = shard == ShardTiles::kTop ? plan.top_tiles : plan.shards[shard].tiles;
  const auto failed = [&](std::string what, Errc code = Errc::bad_data) {
    s.state = ShardState::failed, s.what = std::move(what), s.unread = code == Errc::io;
    return s;
  };
  const std::string path = folder.record(shard), pack = folder.pack(shard);
  const auto text = read_small(path);
  if (!text) {
    if (text.error().code != Errc::not_found) return failed(text.error().what, text.error().code);
    const auto error = read_regular_file(folder.error(shard));
    if (!error) return s;
    return failed(error->substr(0, error->find('\n')));
  }
  const auto record = decode_shard_record(*text);
  if (!record) return failed(path + ": " + record.error().what);
  if (record->plan != hash) return failed(path + " is of another plan");
  if (record->shard != shard_name(shard) || record->tiles != s.tiles)
    return failed(path + " is of another shard");
  auto same = is_of_record(path, pack, record->bytes, record->sha256, every_byte);
  if (same && record->residual_bytes > 0)
    same = is_of_record(path, folder.residuals(shard), record->residual_bytes,
                        record->residual_sha256, every_byte);
  if (!same) return failed(same.error().what, same.error().code);
  s.state = ShardState::done, s.made = s.tiles;
  return s;
}

Result<std::vector<ShardStatus>> shard_status(const ShardPlan& plan, const ShardFolder& folder,
                                              const StatusOptions& o) {
  const std::string hash = plan.hash();
  if (auto ours = belongs_to(folder, hash); !ours) return std::unexpected(ours.error());
  const auto heard = all_heard(folder.path(), o.silence_s);
  if (!heard) return std::unexpected(heard.error());
  std::vector<ShardStatus> all;
  for (std::size_t i = 0; i <= plan.shards.size(); ++i) {
    const std::size_t shard = i == plan.shards.size() ? ShardTiles::kTop : i;
    ShardStatus s = judge_shard(plan, hash, folder, shard, o.every_byte);
    const auto beat = heard->find(shard_name(shard));
    if (s.state != ShardState::done && beat != heard->end()) {
      s.state = ShardState::running, s.what.clear();
      s.made = beat->second.made, s.where = beat->second.where;
      s.silent_s = beat->second.silent_s;
    }
    all.push_back(std::move(s));
  }
  return all;
}

namespace {

/// Is it one of the names in a folder of shards that FileWriter gives?
bool is_written_whole(const std::string& name) {
  if (name == "plan") return true;
  const auto dot = name.find('.');
  if (dot == name.npos || (name.substr(dot) != ".json" && name.substr(dot) != ".error"))
    return false;
  const std::string shard = name.substr(0, dot);
  return shard == "top" ||
         (shard.size() >= 5 && shard.find_first_not_of("0123456789") == shard.npos);
}

bool is_leftover(const fs::path& path) {
  const std::string name = path.filename().string();
  if (is_written_whole(finished_name(name))) return true;
  std::error_code none;
  const bool tiles = name.ends_with(".tiles");  // once their shard is done
  if (tiles && fs::exists(fs::path(path).replace_extension(".json"), none)) return true;
  if (std::ranges::count(name, '.') < 2) return false;  // "00007.pmtiles" has one
  return name.ends_with(".beat") || name.ends_with(".pmtiles") || name.ends_with(".residuals") ||
         name.ends_with(".tind-part");
}

void remove_from(const std::string& folder, double untouched_s,
                 const std::function<bool(const fs::path&)>& is_left) {
  std::error_code error;
  std::vector<fs::path> left;
  for (fs::directory_iterator at(folder, error), end; !error && at != end; at.increment(error)) {
    if (!is_left(at->path())) continue;
    std::error_code none;
    const auto then = at->last_write_time(none);
    if (!none && seconds_since(then) > untouched_s) left.push_back(at->path());
  }
  for (const fs::path& path : left) ::unlink(path.c_str());
}

}  // namespace

void remove_leftovers(const ShardFolder& folder, double untouched_s) {
  remove_from(folder.path(), untouched_s, is_leftover);
}

void remove_unfinished(const std::string& file, double untouched_s) {
  std::error_code none;
  const fs::path real = fs::canonical(file, none);  // beside what a link names
  const fs::path target = none ? fs::absolute(file, none) : real;
  remove_from(target.parent_path().string(), untouched_s, [&](const fs::path& path) {
    return finished_name(path.filename().string()) == target.filename().string();
  });
}

struct Heartbeat::State {
  std::string path;
  std::uint64_t tiles = 0;
  std::atomic<std::uint64_t> made = 0;
  std::mutex mutex;
  std::condition_variable_any wake;
  std::jthread thread;

  /// What cannot be written is not heard of: no reason to fail.
  void beat() const {
    Json j;
    j["made"] = made.load();
    j["tiles"] = tiles;
    std::ofstream(path) << json::to_text(j) << "\n";
  }
};

Heartbeat::Heartbeat(std::string path, std::uint64_t tiles, double every_s)
    : state_(std::make_unique<State>()) {
  state_->path = std::move(path), state_->tiles = tiles;
  state_->beat();
  state_->thread = std::jthread([s = state_.get(), every_s](std::stop_token stop) {
    std::unique_lock lock(s->mutex);
    for (;;) {
      s->wake.wait_for(lock, stop, std::chrono::duration<double>(every_s), [] { return false; });
      if (stop.stop_requested()) return;
      s->beat();
    }
  });
}

Heartbeat::~Heartbeat() {
  state_->thread.request_stop();
  state_->thread.join();
  ::unlink(state_->path.c_str());
}

void Heartbeat::made(std::uint64_t tiles) { state_->made = tiles; }

}  // namespace tind
