#pragma once
// What a build does to the files of its folder: each step by itself, so that a test can look at
// the steps between two moments and ask what a power cut would have left of them.

#include <cstdint>
#include <string>
#include <string_view>

#include "terrain/base/result.h"

namespace tind {

/// A step is seen by everybody at once, and by whoever comes after a power cut only once it was
/// synced. Thread-safe.
class FolderFiles {
 public:
  virtual ~FolderFiles() = default;

  /// And those above it. One that is there is left.
  virtual Result<void> make_folder(const std::string& path);
  /// Begins the file anew.
  virtual Result<void> write(const std::string& path, std::string_view bytes);
  /// Into a file that is there.
  virtual Result<void> write_at(const std::string& path, std::uint64_t at, std::string_view bytes);
  /// Files and folders; a file takes the place of another at once.
  virtual Result<void> rename(const std::string& from, const std::string& to);
  /// A file or an empty folder. What is not there is no failure.
  virtual Result<void> remove(const std::string& path);

  /// What is in the file.
  virtual Result<void> sync_file(const std::string& path);
  /// Which names the folder holds.
  virtual Result<void> sync_folder(const std::string& path);
  /// Everything on the folder's file system: many files in the time of a few.
  virtual Result<void> sync_all(const std::string& folder);
};

}  // namespace tind
