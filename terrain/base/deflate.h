#pragma once
// DEFLATE data (RFC 1951) and what stands around them. The only user of libdeflate.

#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include "terrain/base/bytes.h"
#include "terrain/base/result.h"

namespace tind {

enum class Wrapping {
  none,  // as in zip archives: no checksum
  zlib,  // RFC 1950: PNG, TIFF
  gzip,  // RFC 1952: files, and Content-Encoding
};

/// Packs all of `bytes`; `level` is libdeflate's, 1 (fast) to 12 (small). Empty where more than
/// `most` bytes would come out. `Out` is a vector of bytes or a string. Throws std::bad_alloc.
template <class Out = std::vector<std::uint8_t>>
Out deflate(ByteView bytes, Wrapping, int level,
            std::size_t most = std::numeric_limits<std::size_t>::max());

/// Unpacks what must be at most `most` bytes, for which it takes memory at once; a checksum is
/// compared. bad_data: damaged, or more.
Result<std::vector<std::uint8_t>> inflate(ByteView bytes, Wrapping, std::size_t most);

/// Do they begin as gzip data do?
bool is_gzip(ByteView bytes);

/// Unpacks a gzip file of one member that says that it holds at most `most` bytes. bad_data:
/// damaged, or more.
Result<std::vector<std::uint8_t>> gunzip(ByteView bytes, std::size_t most);

/// The checksum of gzip, zip and PNG.
std::uint32_t crc32(ByteView bytes);

}  // namespace tind
