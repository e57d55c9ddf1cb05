#pragma once
// Files that belong together come into a folder together: a heightmap and its scale, a raster and
// its .prj. Each has its name at once, all of them have not.

#include <string>

#include "terrain/base/descriptor.h"
#include "terrain/base/result.h"

namespace tind::cli {

/// While it lives, no other that was taken for a file of the same folder does.
class OutputTurn {
 public:
  /// Waits for the others, whose files are made already; busy where one does not end. On file
  /// systems that have no such locks everybody's turn is at once.
  static Result<OutputTurn> take(const std::string& file);

 private:
  explicit OutputTurn(Descriptor folder) : folder_(std::move(folder)) {}
  Descriptor folder_;
};

}  // namespace tind::cli
