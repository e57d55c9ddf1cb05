#pragma once
// The bytes of a vector file and of what belongs to it, read before GDAL opens them: GDAL takes a
// disk that fails for a damaged file, and some of its drivers (GML, MapInfo) read on for ever.

#include <cstdint>
#include <string>
#include <vector>

#include "terrain/base/result.h"
#include "terrain/raster/file_state.h"

namespace tind::gdal {

/// Files that are together no larger are read into memory and opened there: no read of GDAL can
/// fail then. Of larger ones GDAL's reads come from the system's cache, most likely.
inline constexpr std::uint64_t kMostInMemory = 64 << 20;

/// What is in memory goes with the object, which must outlive the dataset.
class VectorFiles {
 public:
  /// Of a file, those of its name that GDAL opens with it; of a folder, those in it. Anything else
  /// (a pipe) is left to GDAL. `states` (or null) gets the files before they are read, of a folder
  /// and of SQLite's logs none. Fails (io) with "cannot read FILE: reason".
  static Result<VectorFiles> read(const std::string& path, FileStates* states);
  VectorFiles(VectorFiles&& other) noexcept;
  VectorFiles& operator=(VectorFiles&&) = delete;
  ~VectorFiles();

  /// For GDAL: below /vsimem/, or the path.
  const std::string& target() const { return target_; }
  /// A file's name or a message of GDAL's, with the user's path.
  std::string shown(std::string text) const;
  /// Of a file as GDAL names it; 0 where it is none.
  std::uint64_t size_of(const std::string& name) const;
  /// GDAL failed: was it the disk? (io)
  Result<void> still_readable() const;

 private:
  struct Found;
  VectorFiles() = default;

  void leave_in_place();
  Result<void> read_all(std::vector<Found>& found);

  std::string path_, target_;
  std::string memory_;                 // a folder below /vsimem/ with / at its end, or empty
  std::vector<std::string> in_place_;  // where nothing is in memory
};

}  // namespace tind::gdal
