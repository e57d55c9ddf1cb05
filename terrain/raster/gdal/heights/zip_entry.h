#pragma once
// Reads the one file in a zip archive into memory and verifies its checksum.

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "terrain/base/result.h"

namespace tind {

struct ZipEntry {
  std::string name;  // as in the archive
  std::vector<std::uint8_t> bytes;
};

/// The only entry of `zip` whose name ends in one of `suffixes` (letters of either case), at most
/// `max_bytes` long. Stored and DEFLATE entries; no encryption, no zip64. Takes any bytes; errors
/// begin with `path`. (GDAL's /vsizip/ reads over a wrong checksum.)
Result<ZipEntry> zip_entry(std::span<const std::uint8_t> zip, const std::string& path,
                           const std::vector<std::string>& suffixes, std::size_t max_bytes);

/// The same of a file, itself at most `max_bytes` long.
Result<ZipEntry> read_zip_entry(const std::string& path, const std::vector<std::string>& suffixes,
                                std::size_t max_bytes);

}  // namespace tind
