#pragma once
// A directory as a store that is written.

#include <memory>
#include <string>

#include "terrain/base/result.h"
#include "terrain/store/folder/folder_files.h"
#include "terrain/store/tile_writer.h"

namespace tind {

/// Four kinds of files: the tiles and layer.json; a record of the grid, the options and the
/// content; hashes of the content's blocks; and the ledger of finished tiles. A first build writes
/// tiles where they belong, and layer.json last. An update writes the tiles that depend on heights
/// that changed aside, into tind-update/, and moves them in when all are there: until then the old
/// pyramid can be served.
///
/// Makes the directory if need be, and locks it; invalid_argument where it would lie in that of
/// another tile set. `files`: how files are written; null: as ever.
Result<std::unique_ptr<LockedStore>> lock_folder(const std::string& directory,
                                                 std::shared_ptr<FolderFiles> files = nullptr);

}  // namespace tind
