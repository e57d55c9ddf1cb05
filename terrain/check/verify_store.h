#pragma once
// Are the bytes of a store those that were written? Each is held against the hashes that the store
// keeps of them; what the tiles say is check's business (check.h).

#include <algorithm>
#include <cstdint>
#include <string>
#include <vector>

#include "terrain/base/progress.h"
#include "terrain/base/result.h"
#include "terrain/store/tile_store.h"

namespace tind {

struct VerifyReport {
  static constexpr std::size_t kNamed = 1000;  // of each list of tiles

  /// Tiles of one fault, by level, column and row; the first ones by name.
  struct Tiles {
    std::uint64_t count = 0;
    std::vector<std::string> named;
  };

  std::uint64_t tiles = 0;  // that there should be
  std::uint64_t sound = 0, bytes = 0;
  Tiles damaged;                    // other bytes than were written
  Tiles unread;                     // cannot be read, and may be sound
  Tiles missing;                    // should be there
  Tiles unlisted;                   // there, and nothing vouches for them
  Tiles foreign;                    // there, and no part of the set
  std::vector<StoreFault> faults;   // of what lies beside the tiles
  std::vector<std::string> others;  // files that are no tiles; no fault

  bool ok() const {
    return damaged.count + unread.count + missing.count + unlisted.count + foreign.count +
               faults.size() ==
           0;
  }
  /// Was all of it read? Else what is not ok() may be, once it can.
  bool all_read() const {
    return unread.count == 0 && std::ranges::none_of(faults, &StoreFault::unread);
  }
};

/// Reads every tile. Fails (unsupported) where the store keeps no hashes, and where it cannot be
/// read at all.
Result<VerifyReport> verify_store(const TileStore&, int threads = 0, const Progress& = {});

}  // namespace tind
