#pragma once
// Files on other machines as GDAL sees them: under names of their own, which only we give. GDAL
// itself never asks a server for anything (gdal_setup.cpp); what it reads comes from RemoteFile,
// exactly or not at all.

#include <memory>
#include <optional>
#include <string>

#include "terrain/base/result.h"
#include "terrain/raster/remote/remote_file.h"

namespace tind::gdal {

/// As long as it lives, GDAL finds the file, to be read, by name().
class RemoteMount {
 public:
  explicit RemoteMount(std::shared_ptr<const remote::RemoteFile>);
  ~RemoteMount();
  RemoteMount(const RemoteMount&) = delete;
  RemoteMount& operator=(const RemoteMount&) = delete;

  const std::string& name() const { return name_; }
  const remote::RemoteFile& file() const { return *file_; }

 private:
  const std::shared_ptr<const remote::RemoteFile> file_;
  std::string name_;
};

/// While it lives: the first failure of reading a remote file in this thread, whatever GDAL made of
/// it. One at a time in a thread.
class RemoteFailures {
 public:
  RemoteFailures();
  ~RemoteFailures();
  RemoteFailures(const RemoteFailures&) = delete;
  RemoteFailures& operator=(const RemoteFailures&) = delete;

  const std::optional<Error>& first() const;
};

}  // namespace tind::gdal
