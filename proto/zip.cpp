#include "proto/zip.h"

#include <algorithm>
#include <array>
#include <optional>
#include <vector>

#include "terrain/base/bytes.h"
#include "terrain/base/md5.h"

namespace tind::proto {
namespace {

constexpr std::uint16_t kPlain = 20, kZip64 = 45;  // versions of the format, times ten
constexpr std::uint16_t kDate = 1 << 5 | 1;        // 1 January 1980
constexpr std::uint16_t kMany = 0xffff;            // what a number of 16 bits says of a larger one
constexpr std::uint32_t kLarge = 0xffffffff;       // and of 32 bits

template <Number T>
void put(std::string& out, T v) {
  out.resize(out.size() + sizeof v);
  store(v, out.data() + out.size() - sizeof v);
}

std::uint32_t clipped(std::uint64_t v) { return std::uint32_t(std::min<std::uint64_t>(v, kLarge)); }

/// What local headers and the directory say in the same words.
void put_facts(std::string& out, const ZipEntry& e, std::uint16_t version, std::uint16_t extra) {
  put(out, version);
  put(out, std::uint16_t(0));  // flags
  put(out, std::uint16_t(e.method));
  put(out, std::uint16_t(0));  // midnight
  put(out, kDate);
  put(out, e.crc);
  put(out, e.packed);
  put(out, e.size);
  put(out, std::uint16_t(e.name.size()));
  put(out, extra);
}

void put_directory_entry(std::string& out, const ZipEntry& e) {
  const bool far = e.offset >= kLarge;
  const std::uint16_t version = far ? kZip64 : kPlain;
  put(out, std::uint32_t(0x02014b50));
  put(out, version);  // that made it, on no system in particular
  put_facts(out, e, version, far ? 12 : 0);
  put(out, std::uint16_t(0));  // comment
  put(out, std::uint16_t(0));  // disk
  put(out, std::uint16_t(0));  // attributes
  put(out, std::uint32_t(0));
  put(out, clipped(e.offset));
  out += e.name;
  if (!far) return;
  put(out, std::uint16_t(1));  // Zip64: what did not fit
  put(out, std::uint16_t(8));
  put(out, e.offset);
}

void put_zip64_end(std::string& out, std::uint64_t count, std::uint64_t offset,
                   std::uint64_t size) {
  put(out, std::uint32_t(0x06064b50));
  put(out, std::uint64_t(44));  // of the rest of this record
  put(out, kZip64);
  put(out, kZip64);
  put(out, std::uint32_t(0));  // this disk
  put(out, std::uint32_t(0));  // that of the directory
  put(out, count);
  put(out, count);
  put(out, size);
  put(out, offset);
  put(out, std::uint32_t(0x07064b50));  // where that record is
  put(out, std::uint32_t(0));
  put(out, offset + size);
  put(out, std::uint32_t(1));  // disks
}

std::unexpected<Error> bad(const char* why) {
  return fail(Errc::bad_data, std::string("not a zip archive that can be read: ") + why);
}

/// The offset of an entry that did not fit into 32 bits; nothing where no Zip64 field says it.
std::optional<std::uint64_t> far_offset(std::string_view extra) {
  while (extra.size() >= 4) {
    const auto id = load<std::uint16_t>(extra.data()), size = load<std::uint16_t>(&extra[2]);
    if (size > extra.size() - 4) return {};
    if (id == 1 && size >= 8) return load<std::uint64_t>(&extra[4]);
    extra.remove_prefix(4 + std::size_t(size));
  }
  return {};
}

}  // namespace

std::string encode_local_header(const ZipEntry& e) {
  std::string out;
  put(out, std::uint32_t(0x04034b50));
  put_facts(out, e, kPlain, 0);
  return out + e.name;
}

std::string encode_directory(std::span<const ZipEntry> entries, std::uint64_t offset) {
  std::string out;
  for (const ZipEntry& e : entries) put_directory_entry(out, e);
  const std::uint64_t size = out.size(), count = entries.size();
  if (count >= kMany || offset >= kLarge || size >= kLarge) put_zip64_end(out, count, offset, size);
  put(out, std::uint32_t(0x06054b50));
  put(out, std::uint32_t(0));  // disks
  const auto few = std::uint16_t(std::min<std::uint64_t>(count, kMany));
  put(out, few);
  put(out, few);
  put(out, clipped(size));
  put(out, clipped(offset));
  put(out, std::uint16_t(0));  // comment
  return out;
}

Result<ZipDirectory> find_directory(std::string_view tail, std::uint64_t archive_size) {
  constexpr std::size_t kEnd = 22, kLocator = 20, kEnd64 = 56;
  if (tail.size() < kEnd) return bad("it is too short");
  std::size_t at = tail.size() - kEnd;
  while (load<std::uint32_t>(&tail[at]) != 0x06054b50)
    if (at-- == 0) return bad("its end is missing");
  const char* const end = &tail[at];
  ZipDirectory found{.offset = load<std::uint32_t>(end + 16),
                     .size = load<std::uint32_t>(end + 12),
                     .entries = load<std::uint16_t>(end + 10)};
  const bool large = found.offset == kLarge || found.size == kLarge || found.entries == kMany;
  if (large && at >= kLocator + kEnd64) {
    const char* const end64 = end - kLocator - kEnd64;
    if (load<std::uint32_t>(end - kLocator) == 0x07064b50 &&
        load<std::uint32_t>(end64) == 0x06064b50)
      found = {load<std::uint64_t>(end64 + 48), load<std::uint64_t>(end64 + 40),
               load<std::uint64_t>(end64 + 32)};
  }
  if (found.offset > archive_size || found.size > archive_size - found.offset)
    return bad("its directory lies outside of it");
  return found;
}

Result<std::vector<ZipEntry>> decode_directory(std::string_view directory) {
  constexpr std::size_t kFixed = 46;
  std::vector<ZipEntry> entries;
  while (!directory.empty()) {
    if (directory.size() < kFixed || load<std::uint32_t>(directory.data()) != 0x02014b50)
      return bad("its directory is damaged");
    const char* const p = directory.data();
    const std::size_t name = load<std::uint16_t>(p + 28), extra = load<std::uint16_t>(p + 30),
                      comment = load<std::uint16_t>(p + 32);
    if (name + extra + comment > directory.size() - kFixed) return bad("its directory is cut off");
    ZipEntry e{.name = std::string(directory.substr(kFixed, name)),
               .method = ZipMethod(load<std::uint16_t>(p + 10)),
               .crc = load<std::uint32_t>(p + 16),
               .packed = load<std::uint32_t>(p + 20),
               .size = load<std::uint32_t>(p + 24),
               .offset = load<std::uint32_t>(p + 42)};
    if (load<std::uint16_t>(p + 8) & 1) return bad("it is encrypted");
    if (e.method != ZipMethod::stored && e.method != ZipMethod::deflated)
      return bad("it is packed by another method than DEFLATE");
    if (e.packed == kLarge || e.size == kLarge) return bad("it holds a file of 4 GiB");
    if (e.offset == kLarge) {
      const auto far = far_offset(directory.substr(kFixed + name, extra));
      if (!far) return bad("its directory is damaged");
      e.offset = *far;
    }
    entries.push_back(std::move(e));
    directory.remove_prefix(kFixed + name + extra + comment);
  }
  return entries;
}

Result<std::size_t> local_header_size(std::string_view header) {
  if (header.size() < kZipHeader || load<std::uint32_t>(header.data()) != 0x04034b50)
    return bad("an entry is not where its directory says");
  return kZipHeader + load<std::uint16_t>(&header[26]) + load<std::uint16_t>(&header[28]);
}

std::string encode_3tz_index(std::span<const ZipEntry> entries) {
  struct Row {
    std::uint64_t first, second, offset;
    auto operator<=>(const Row&) const = default;
  };
  std::vector<Row> rows;
  for (const ZipEntry& e : entries) {
    const auto hash = md5(e.name);
    rows.push_back(
        {load<std::uint64_t>(hash.data()), load<std::uint64_t>(hash.data() + 8), e.offset});
  }
  std::ranges::sort(rows);
  std::string out;
  for (const Row& row : rows) put(out, row.first), put(out, row.second), put(out, row.offset);
  return out;
}

}  // namespace tind::proto
