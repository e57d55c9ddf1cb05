#pragma once
// The two folders of an update inside the folder of a build: kAside, where its tiles are made, and
// kReady, which kAside is renamed to when it is whole, and from which it moves in.

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "terrain/base/result.h"
#include "terrain/store/folder/folder_files.h"

namespace tind::folder {

/// Is it the record of a build?
bool is_record(const nlohmann::ordered_json&);
/// Can a build with the one record be updated to one with the other (may_update())?
bool is_update(const nlohmann::ordered_json& from, const nlohmann::ordered_json& to);

/// The files in `name` (kAside, kReady) of this folder, relative to it, with a leading '/'; none
/// where it is not there. Fails where something in it is not proven to be a build's: it must be a
/// folder, with a record to which the folder's own can be updated; tiles must have a place in a
/// ledger of them; other files, or none but tiles, are somebody else's.
Result<std::vector<std::string>> look_aside(const std::string& folder, const char* name);

/// Removes what look_aside() allows, and the folders that this leaves empty: what proves the rest
/// goes last.
Result<void> remove_aside(FolderFiles&, const std::string& folder, const char* name);

/// Moves the files of an update that is whole to where they belong, the record last, and removes
/// tiles that it does not have any more. Fails, with nothing done, where kReady is not a build's or
/// something else is in the way.
Result<void> adopt(FolderFiles&, const std::string& folder);

}  // namespace tind::folder
