#pragma once
// Zip archives (PKWARE's APPNOTE 6.3.9, within ISO/IEC 21320-1), and 3TZ, which is one for 3D
// Tiles. What is packed is packed, and unpacked, elsewhere.

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "terrain/base/result.h"

namespace tind::proto {

enum class ZipMethod : std::uint16_t { stored = 0, deflated = 8 };

struct ZipEntry {
  std::string name;  // relative, with '/'
  ZipMethod method = ZipMethod::stored;
  std::uint32_t crc = 0;               // of what is in it, unpacked
  std::uint32_t packed = 0, size = 0;  // bytes: as it lies there, and unpacked
  std::uint64_t offset = 0;            // of its local header, from the archive's beginning
};

/// What stands before an entry's bytes. All entries are of the first minute of 1980, so that the
/// same files make the same archive.
std::string encode_local_header(const ZipEntry&);

/// What stands behind the last one's, which is where `offset` is: the directory, in the entries'
/// order. Zip64 where there are 65535 entries or more, or 4 GiB before the directory's end.
std::string encode_directory(std::span<const ZipEntry>, std::uint64_t offset);

/// Where the directory lies in an archive, and how many entries it has.
struct ZipDirectory {
  std::uint64_t offset = 0, size = 0, entries = 0;
};
/// So many bytes at an archive's end say it.
inline constexpr std::size_t kZipTail = 65535 + 22 + 20 + 56;
/// From the archive's last bytes, kZipTail or all that there are, and its size. bad_data; a
/// directory that it gives lies inside the archive.
Result<ZipDirectory> find_directory(std::string_view tail, std::uint64_t archive_size);
/// From the bytes of a directory. bad_data: cut off, encrypted, packed otherwise than ZipMethod
/// says, or with an entry of 4 GiB.
Result<std::vector<ZipEntry>> decode_directory(std::string_view directory);
/// How many bytes stand before an entry's own, from the first 30 of its local header. bad_data.
inline constexpr std::size_t kZipHeader = 30;
Result<std::size_t> local_header_size(std::string_view header);

/// The name of the last entry of a .3tz (3D Tiles Archive Format 1.3): stored, it says where each
/// of the others is.
inline constexpr const char* k3tzIndex = "@3dtilesIndex1@";

/// 24 bytes an entry: the MD5 of its name and the place of its local header, in the order of the
/// hash as two numbers of 64 bits, little endian.
std::string encode_3tz_index(std::span<const ZipEntry>);

}  // namespace tind::proto
