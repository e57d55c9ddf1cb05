#pragma once
// What the objects of a tile set are called, below its prefix: as the files of a folder, and on the
// way also journals of what is written.

#include <cstddef>
#include <string>

#include "terrain/store/folder/folder_contents.h"

namespace tind {

/// And a name: what a build that has not ended knows of the tiles that it wrote.
inline constexpr const char* kJournal = "/tind-journal/";

inline constexpr std::size_t kLargestObject = 1u << 30u;  // beside the tiles: the ledger

/// Does a build give this name to an object beside the tiles? `digest`: of its blocks.
inline bool is_object_of_build(const std::string& key, const std::string& digest) {
  return key.starts_with(kJournal + 1) || folder::is_own_name(key, digest);
}

}  // namespace tind
