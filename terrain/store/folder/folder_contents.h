#pragma once
// What lies in the folder of a build: the names of our own files, and what is in their way. Nothing
// here touches a file that tind build did not write.

#include <atomic>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <system_error>
#include <vector>

#include "terrain/base/result.h"
#include "terrain/geo/tile_order.h"
#include "terrain/store/folder/folder_files.h"
#include "terrain/store/folder/tile_ledger.h"

namespace tind::folder {

inline constexpr const char* kTileSuffix = ".terrain";
inline constexpr const char* kRecord = "/tind-build.json";
inline constexpr const char* kLedger = "/tind-tiles.ledger";
inline constexpr const char* kBlocks = "/tind-blocks-";  // and 32 digits
inline constexpr const char* kLayer = "/layer.json";
inline constexpr const char* kResiduals = "/residuals.tind";
inline constexpr const char* kPartial = "/tind-partial";     // files that are being written
inline constexpr const char* kAside = "/tind-update";        // an update, on the way
inline constexpr const char* kReady = "/tind-update-ready";  // whole: it counts

std::string tile_path(const std::string& folder, TileId);
/// The tile at z/x/y.terrain; nothing for other paths.
std::optional<TileId> tile_of_path(const std::filesystem::path& relative);

/// Fails where something lies in the place of a tile, of a folder of tiles or of another of our
/// files, and is not ours: a folder in a file's place, a file in a folder's, a link; a tile that is
/// not `own`; where the folder is not `claimed` yet, files of our names that are not of our making.
Result<void> check_way(const std::string& folder, const TileOrder&, bool claimed,
                       const std::function<bool(TileId)>& own);

/// Fails where the hashes of blocks of this content are to go and something else lies there.
/// `named`: the folder's record names the file, so that it is ours however damaged.
Result<void> check_blocks(const std::string& folder, const std::string& digest, bool named);
/// Fails where kPartial holds files of names that a build writes there, unless builds `began` here.
Result<void> check_partial(const std::string& folder, bool began);
/// Fails where these (relative, with a leading '/') cannot come to lie in the folder of a build:
/// a link on the way, or something else in the place of one of them.
Result<void> check_places(const std::string& folder, const std::vector<std::string>& files);

/// Is it a name that a build gives to something in its folder, tiles and their folders aside?
/// `digest`: of its blocks.
bool is_own_name(const std::string& name, const std::string& digest);
/// Is there nothing in a folder but a lock, and what a run that was killed left of writing `record`
/// (with a leading '/')? Fails where it cannot be looked into (not_found: where there is none).
Result<bool> is_unclaimed(const std::string& folder, const std::string& record);
/// Folders in `folder` that these files were in, which are gone, and that are empty now. One that
/// cannot go stays, which harms nobody.
void remove_empty_folders(const std::string& folder, const std::vector<std::string>& files);
/// Is it the name of a folder of tiles?
bool is_level(const std::filesystem::path& name);
/// A file of hashes of blocks, sound or not? Fails where it has the name of one and cannot be read.
Result<bool> is_blocks(const std::string& path);
/// Without following links. Fails (io) where it cannot be told: that is no word on what is there.
Result<std::filesystem::file_type> type_of(const std::string& path);
/// "PATH WHAT, and tind build did not make it: ..."
std::unexpected<Error> in_the_way(const std::string& path, const std::string& what);
std::unexpected<Error> cannot_look(const std::string& path, const std::error_code&);

/// Removes the tiles that the ledger names and that are `gone`, and folders that this leaves empty.
Result<void> remove_tiles(FolderFiles&, const std::string& folder, const TileLedger&,
                          const std::function<bool(TileId)>& gone);
/// Removes hashes of blocks of other content than the digest says.
Result<void> remove_other_blocks(FolderFiles&, const std::string& folder,
                                 const std::string& digest);
/// Removes what builds that were killed had begun to write. REQUIRES: no build runs here.
Result<void> remove_partial_files(FolderFiles&, const std::string& folder);

/// Paths in kPartial for files that are being written. Those of two writers differ, on whichever
/// hosts: not every network file system passes on the lock that keeps two builds apart.
/// Thread-safe.
class PartialPaths {
 public:
  explicit PartialPaths(const std::string& folder);
  std::string next();

 private:
  const std::string begin_;
  std::atomic<std::uint64_t> count_ = 0;
};

}  // namespace tind::folder
