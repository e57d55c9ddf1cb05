#pragma once
// The bytes of an archive, wherever it lies: a file of this machine's, or one on another.

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "proto/tile/pmtiles.h"
#include "terrain/base/result.h"

namespace tind::pmtiles {

/// Of one archive for good, whatever becomes of its name. Nothing but whole parts are read.
/// Thread-safe.
class ArchiveBytes {
 public:
  virtual ~ArchiveBytes() = default;
  virtual std::uint64_t size() const = 0;
  /// REQUIRES: it lies in the archive. io; busy where another has taken its place on the way.
  virtual Result<std::vector<std::uint8_t>> read(const proto::PmtilesSection&) const = 0;
  /// The same for small parts of which those beside it are likely to be asked for, too.
  virtual Result<std::vector<std::uint8_t>> read_small(const proto::PmtilesSection& part) const {
    return read(part);
  }
};

/// not_found, io, bad_data. `location`: a path, or what raster/remote/objects.h reads.
Result<std::unique_ptr<const ArchiveBytes>> open_archive_bytes(const std::string& location);

}  // namespace tind::pmtiles
