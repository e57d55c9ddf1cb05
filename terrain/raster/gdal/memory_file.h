#pragma once
// A file of GDAL's memory file system, whose bytes then go the way of every other output.

#include <string>

namespace tind::gdal {

/// A name that nobody else has; what is there goes with the object. Thread-safe.
class MemoryFile {
 public:
  explicit MemoryFile(const std::string& extension);
  ~MemoryFile();
  MemoryFile(const MemoryFile&) = delete;
  MemoryFile& operator=(const MemoryFile&) = delete;

  const std::string& name() const { return name_; }
  /// Of this name with another extension, or its own; empty where there is no such file.
  std::string bytes() const;
  std::string bytes_beside(const std::string& extension) const;

 private:
  std::string stem_, name_;
};

}  // namespace tind::gdal
