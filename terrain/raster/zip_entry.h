#pragma once
// The one file of a zip archive, as bytes whose checksum has been compared.

#include <cstdint>
#include <string>
#include <vector>

#include "terrain/base/result.h"

namespace tind {

struct ZipEntry {
  std::string name;  // as in the archive
  std::vector<std::uint8_t> bytes;
};

/// Reads the only entry of `path` whose name ends in `suffix` (letters of either case), at most
/// `max_bytes` long packed and unpacked. Stored and DEFLATE entries; no encryption, no zip64.
/// (GDAL's /vsizip/ reads over a wrong checksum.)
Result<ZipEntry> read_zip_entry(const std::string& path, const std::string& suffix,
                                std::size_t max_bytes);

}  // namespace tind
