#pragma once
// Objects of an S3 store as a tile set that is written.

#include <memory>
#include <string>

#include "terrain/base/result.h"
#include "terrain/raster/remote/objects.h"
#include "terrain/store/tile_writer.h"

namespace tind {

/// Tiles become objects where they belong, each with one PUT that is looked at afterwards;
/// layer.json comes last. What is finished, journals say until the ledger does: a run that was
/// killed goes on by them and by the store's list of sizes and MD5s. Other than in a folder:
/// - there is no lock: of two builds, the one that finds another's record gives up (busy) when it
///   next commits; two of the same make the same bytes
/// - there is no update in place: tiles of another source or other options are refused, or with
///   `force` removed first
std::unique_ptr<LockedStore> lock_objects(const std::string& url, const remote::Objects&);

}  // namespace tind
