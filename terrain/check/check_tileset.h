#pragma once
// Are these 3D Tiles what they say they are? Anyone's, in a folder or a .3tz: as far as a look at
// all files tells without drawing them.

#include <cstdint>
#include <string>
#include <vector>

#include "terrain/base/progress.h"
#include "terrain/base/result.h"
#include "terrain/check/tileset_files.h"

namespace tind {

struct TilesetLevel {
  int level = 0;  // of the implicit tiling
  std::uint64_t contents = 0, bytes = 0;
};

/// What tileset.json and a look at the first content say.
struct TilesetFacts {
  std::string version, tileset_version, generator, name, attribution;  // "1.1"; empty: not said
  bool implicit = false;
  std::uint64_t contents = 0, subtrees = 0;  // files
  std::string compression = "none";          // "meshopt", "draco"
  std::vector<TilesetLevel> levels;          // where files are named LEVEL/X/Y.glb
};
/// bad_data where tileset.json is none.
Result<TilesetFacts> tileset_facts(const TilesetFiles&);

struct TilesetReport {
  static constexpr std::size_t kExamples = 20;
  static constexpr std::uint64_t kMost = 1'000'000;  // violations: then the check ends

  std::uint64_t contents = 0, subtrees = 0;  // looked at
  std::uint64_t violations = 0;
  std::vector<std::string> examples;  // "west/3/1/2.glb: ends before ..."
  std::uint64_t unread = 0;           // the disk failed: nothing is said of them
  std::vector<std::string> unread_examples;

  bool ended_early() const { return violations >= kMost; }
  bool ok() const { return violations == 0 && unread == 0; }
};

/// From tileset.json down: its tiles, and of implicit tiling (quadtrees) every subtree, whose bits
/// must name the files that are there, no fewer and no more. Every content that is a GLB must be
/// whole: its chunks, its JSON, and the bytes that buffer views and accessors lie in; what is
/// compressed is not unpacked. Of an archive also each file's checksum and the index. Fails
/// only on a stop (cancelled) and where tileset.json cannot be read; one file
/// is in memory at a time, and of what subtrees name only what is there.
Result<TilesetReport> check_tileset(const TilesetFiles&, const Progress& = {});

}  // namespace tind
