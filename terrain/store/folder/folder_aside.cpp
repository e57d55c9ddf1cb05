// Whether files are ours is read off the record and the ledger that lie with them. So those two are
// the first to come and the last to go, each step synced before the next: a folder that a power cut
// leaves proves what is in it, or holds nothing that needs proof.

#include "terrain/store/folder/folder_aside.h"

#include <algorithm>
#include <filesystem>
#include <optional>

#include "proto/json_member.h"
#include "proto/json_text.h"
#include "terrain/base/file_io.h"
#include "terrain/raster/source_blocks.h"
#include "terrain/store/folder/folder_contents.h"
#include "terrain/store/folder/tile_ledger.h"

namespace tind::folder {

namespace fs = std::filesystem;

namespace {

using Json = nlohmann::ordered_json;

struct Proof {
  std::string digest;                // of the content, as the record has it
  std::optional<TileLedger> ledger;  // of the same places
};

/// Nothing where there is no such file, or it is not JSON; fails where it cannot be read, which is
/// no proof of anything.
Result<Json> json_in(const std::string& path) {
  const auto text = read_regular_file(path);
  if (!text && text.error().code != Errc::not_found) return std::unexpected(text.error());
  return text ? json::parse<Json>(*text) : Json();
}

bool is_tile(const std::string& file) {
  return tile_of_path(fs::path(file).relative_path()).has_value();
}

/// A build's record here, one above that can become it, and a ledger of either.
Result<std::optional<Proof>> proof_of(const std::string& folder, const std::string& aside) {
  const auto own = json_in(aside + kRecord), before = json_in(folder + kRecord);
  for (const auto* record : {&own, &before})
    if (!*record) return std::unexpected(record->error());
  if (!is_record(*own) || !is_update(*before, *own)) return std::nullopt;
  Proof proof;
  proof.digest = json::text(*own, "heights").value_or("");
  for (const std::string& place : {aside, folder}) {
    auto ledger = TileLedger::open(place + kLedger);
    if (!ledger && ledger.error().code == Errc::io) return std::unexpected(ledger.error());
    if (!ledger) continue;
    proof.ledger = std::move(*ledger);
    break;
  }
  return proof;
}

/// Fails where a file that might prove itself cannot be read.
Result<bool> proven(const std::string& aside, const std::string& file,
                    const std::optional<Proof>& proof) {
  if (const auto id = tile_of_path(fs::path(file).relative_path()))
    return proof && proof->ledger && proof->ledger->names(*id);
  if (file == kLayer || file == kRecord) return proof.has_value();
  if (file == kLedger) {
    if (proof) return true;
    const auto ledger = TileLedger::open(aside + file);
    if (!ledger && ledger.error().code == Errc::io) return std::unexpected(ledger.error());
    return ledger.has_value();
  }
  if (!file.starts_with(kBlocks)) return false;
  const std::string digest = file.substr(std::string_view(kBlocks).size());
  if (proof && proof->digest == digest) return true;
  const auto bytes = read_regular_file(aside + file);
  if (!bytes) return std::unexpected(bytes.error());
  return SourceBlocks::whole(*bytes, digest);
}

bool may_hold_tiles(const std::string& folder) {
  return folder.find_first_not_of("/0123456789") == folder.npos &&
         std::ranges::count(folder, '/') <= 2;
}

std::unexpected<Error> not_ours(const std::string& path) {
  return fail(Errc::invalid_argument,
              path +
                  " is in the way, and nothing proves that tind build made it: move it "
                  "elsewhere, or choose another directory");
}

/// What is below, folders with a '/' at the end.
Result<std::vector<std::string>> names_below(const std::string& aside) {
  std::vector<std::string> names;
  std::error_code error;
  for (fs::recursive_directory_iterator it(aside, error), end; !error && it != end;
       it.increment(error)) {
    const std::string name = it->path().string().substr(aside.size());
    const auto type = type_of(aside + name);
    if (!type) return std::unexpected(type.error());
    if (*type == fs::file_type::directory && may_hold_tiles(name))
      names.push_back(name + "/");
    else if (*type == fs::file_type::regular)
      names.push_back(name);
    else
      return not_ours(aside + name);
  }
  if (error) return cannot_look(aside, error);
  std::ranges::sort(names);
  return names;
}

}  // namespace

bool is_record(const Json& j) { return json::text(j, "made_by") == "tind build"; }

bool is_update(const Json& from, const Json& to) {
  if (!from.is_object() || !to.is_object()) return false;
  if (from.value("format", Json()) != to.value("format", Json())) return false;
  const auto a = decode_build_record(from.dump()), b = decode_build_record(to.dump());
  return a && b && may_update(*a, *b);
}

Result<std::vector<std::string>> look_aside(const std::string& folder, const char* name) {
  const std::string aside = folder + name;
  const auto type = type_of(aside);
  if (!type) return std::unexpected(type.error());
  if (*type == fs::file_type::not_found) return std::vector<std::string>{};
  if (*type != fs::file_type::directory) return not_ours(aside);
  auto files = names_below(aside);
  if (!files) return files;
  std::erase_if(*files, [](const std::string& file) { return file.ends_with('/'); });
  if (files->empty()) return files;
  const auto proof = proof_of(folder, aside);
  if (!proof) return std::unexpected(proof.error());
  for (const std::string& file : *files) {
    const auto own = proven(aside, file, *proof);
    if (!own) return std::unexpected(own.error());
    if (!*own) return not_ours(aside + file);
  }
  return files;
}

Result<void> remove_aside(FolderFiles& files, const std::string& folder, const char* name) {
  const std::string aside = folder + name;
  const auto type = type_of(aside);
  if (!type) return std::unexpected(type.error());
  if (*type != fs::file_type::directory) return {};
  auto own = look_aside(folder, name);
  if (!own) return std::unexpected(own.error());
  const auto proof = std::ranges::stable_partition(
      *own, [](const std::string& file) { return is_tile(file) || file == kLayer; });
  for (auto it = own->begin(); it != own->end(); ++it) {
    if (it == proof.begin())
      if (auto done = files.sync_all(folder); !done) return done;
    if (auto done = files.remove(aside + *it); !done) return done;
  }
  const auto left = names_below(aside);
  if (!left) return std::unexpected(left.error());
  for (auto it = left->rbegin(); it != left->rend(); ++it)  // those inside first
    if (auto done = files.remove(aside + it->substr(0, it->size() - 1)); !done) return done;
  return files.remove(aside);
}

namespace {

/// Removes the tiles that the ledger here names and that of the update does not. What is gone stays
/// gone before the update's ledger takes the place of the one that named them.
Result<void> remove_old_tiles(FolderFiles& files, const std::string& folder,
                              const std::string& ready) {
  const auto old = TileLedger::open(folder + kLedger), now = TileLedger::open(ready + kLedger);
  for (const auto* ledger : {&old, &now})
    if (!*ledger && ledger->error().code == Errc::io) return std::unexpected(ledger->error());
  if (!old || !now || old->same_tiles(*now)) return {};
  const auto gone = [&](TileId id) { return !now->names(id); };
  if (auto done = remove_tiles(files, folder, *old, gone); !done) return done;
  return files.sync_all(folder);
}

}  // namespace

Result<void> adopt(FolderFiles& files, const std::string& folder) {
  const std::string ready = folder + kReady;
  const auto type = type_of(ready);
  if (!type) return std::unexpected(type.error());
  if (*type == fs::file_type::not_found) return {};
  auto own = look_aside(folder, kReady);
  if (!own) return std::unexpected(own.error());
  if (std::ranges::find(*own, kRecord) != own->end()) {
    if (auto ok = check_places(folder, *own); !ok) return ok;
    const auto order = [](const std::string& f) {  // tiles, what vouches for them, the record
      return std::pair(f == kRecord ? 2 : f == kLedger ? 1 : 0, f);
    };
    std::ranges::sort(*own, {}, order);
    for (const std::string& file : *own) {
      if (file == kLedger)
        if (auto done = remove_old_tiles(files, folder, ready); !done) return done;
      if (file == kRecord)
        if (auto done = files.sync_all(folder); !done) return done;
      const std::string parent = fs::path(folder + file).parent_path().string();
      if (auto done = files.make_folder(parent); !done) return done;
      if (auto done = files.rename(ready + file, folder + file); !done) return done;
    }
    if (auto done = files.sync_folder(folder); !done) return done;
  }
  const auto record = json_in(folder + kRecord);
  if (!record) return std::unexpected(record.error());
  if (const auto digest = json::text(*record, "heights"); digest && is_record(*record))
    if (auto done = remove_other_blocks(files, folder, *digest); !done) return done;
  if (auto done = remove_aside(files, folder, kReady); !done) return done;
  return files.sync_folder(folder);
}

}  // namespace tind::folder
