#pragma once
// One build at a time in a folder.

#include <string>

#include "terrain/base/result.h"

namespace tind {

/// A lock of the file system's on FOLDER/tind-lock: it goes with the process, however that ends,
/// and holds on other hosts, too, where the file system passes locks on (NFS does unless mounted
/// with nolock). What is written in the file only says to others who holds it.
class FolderLock {
 public:
  static constexpr const char* kName = "tind-lock";
  /// REQUIRES: the folder is there. Errc::busy, with process, host and time, where another has it;
  /// invalid_argument where something else has the name.
  static Result<FolderLock> take(const std::string& folder);
  /// Nobody has it, or that cannot be told. Errc::busy, with the same, where somebody does, this
  /// process included: what a build is to put there may come yet.
  static Result<void> nobody_has(const std::string& folder);

  /// Did a build that was killed leave its lock's file here? It is on the disk before anything else
  /// of a build is.
  bool left_behind() const { return left_behind_; }
  /// The file stays as if this process were killed now.
  void leave_behind() { path_.clear(); }

  FolderLock(FolderLock&& other) noexcept;
  FolderLock& operator=(FolderLock&&) = delete;
  ~FolderLock();  // the file goes, too

 private:
  FolderLock(std::string path, int file) : path_(std::move(path)), file_(file) {}

  std::string path_;
  int file_;
  bool left_behind_ = false;
};

}  // namespace tind
