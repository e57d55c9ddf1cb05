#pragma once
// A folder for files of this process alone.

#include <string>

#include "terrain/base/result.h"

namespace tind {

/// Below the system's folder for such things; nobody else may look into it, or knew its name
/// before it was there. It goes with the object, with all that is in it.
class TemporaryFolder {
 public:
  /// `purpose`: a word for its name, "archive".
  static Result<TemporaryFolder> make(const std::string& purpose);
  TemporaryFolder(TemporaryFolder&&) noexcept;
  TemporaryFolder& operator=(TemporaryFolder&&) = delete;
  ~TemporaryFolder();
  const std::string& path() const { return path_; }

 private:
  explicit TemporaryFolder(std::string path) : path_(std::move(path)) {}
  std::string path_;
};

}  // namespace tind
