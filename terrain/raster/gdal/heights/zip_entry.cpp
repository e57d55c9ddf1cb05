// The format: PKWARE's APPNOTE.TXT. Everything is found from the end: end record (4.3.16), then the
// central directory (4.3.12), whose sizes and checksum count; of the local header (4.3.7) only its
// length is used.

#include "terrain/raster/gdal/heights/zip_entry.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cctype>
#include <fstream>
#include <optional>
#include <span>

#include "terrain/base/deflate.h"

namespace tind {
namespace {

using Bytes = std::span<const std::uint8_t>;

/// Little-endian number of `size` bytes at `at`, 0 beyond the end (which no signature equals).
std::uint32_t number(Bytes bytes, std::size_t at, int size) {
  std::uint32_t value = 0;
  if (at > bytes.size() || bytes.size() - at < std::size_t(size)) return 0;
  for (int i = size; i-- > 0;) value = value << 8 | bytes[at + i];
  return value;
}

struct Entry {
  std::string name;
  std::uint32_t flags, method, crc, packed, unpacked, local;
};

std::optional<std::size_t> end_record(Bytes zip) {
  constexpr std::size_t kSize = 22, kLongestComment = 65535;
  if (zip.size() < kSize) return std::nullopt;
  const std::size_t last = zip.size() - kSize, first = last - std::min(last, kLongestComment);
  for (std::size_t at = last + 1; at-- > first;)
    if (number(zip, at, 4) == 0x06054b50) return at;
  return std::nullopt;
}

std::vector<Entry> directory(Bytes zip, std::size_t end) {
  std::vector<Entry> entries;
  const std::uint32_t count = number(zip, end + 10, 2);
  std::size_t at = number(zip, end + 16, 4);
  while (entries.size() < count && number(zip, at, 4) == 0x02014b50) {
    const std::size_t length = number(zip, at + 28, 2);
    if (at + 46 + length > zip.size()) break;
    entries.push_back({std::string(zip.begin() + at + 46, zip.begin() + at + 46 + length),
                       number(zip, at + 8, 2), number(zip, at + 10, 2), number(zip, at + 16, 4),
                       number(zip, at + 20, 4), number(zip, at + 24, 4), number(zip, at + 42, 4)});
    at += 46 + length + number(zip, at + 30, 2) + number(zip, at + 32, 2);
  }
  if (entries.size() < count) entries.clear();
  return entries;
}

bool ends_with(const std::string& name, const std::string& suffix) {
  return name.size() >= suffix.size() && std::equal(suffix.rbegin(), suffix.rend(), name.rbegin(),
                                                    [](unsigned char a, unsigned char b) {
                                                      return std::tolower(a) == std::tolower(b);
                                                    });
}

bool unpack(Bytes zip, const Entry& entry, std::vector<std::uint8_t>& out) {
  if (number(zip, entry.local, 4) != 0x04034b50 || (entry.flags & 1) != 0) return false;
  const std::size_t data = std::size_t(entry.local) + 30 + number(zip, entry.local + 26, 2) +
                           number(zip, entry.local + 28, 2);
  if (data > zip.size() || zip.size() - data < entry.packed) return false;
  const Bytes packed = zip.subspan(data, entry.packed);
  if (entry.method == 0) {
    if (entry.packed != entry.unpacked) return false;
    out.assign(packed.begin(), packed.end());
  } else {
    if (entry.method != 8) return false;
    auto whole = inflate(packed, Wrapping::none, entry.unpacked);
    if (!whole || whole->size() != entry.unpacked) return false;
    out = std::move(*whole);
  }
  return crc32(out) == entry.crc;
}

}  // namespace

Result<ZipEntry> zip_entry(std::span<const std::uint8_t> zip, const std::string& path,
                           const std::vector<std::string>& suffixes, std::size_t max_bytes) {
  const auto damaged = fail(Errc::bad_data, path + ": the zip is truncated or damaged");
  const auto end = end_record(zip);
  if (!end) return damaged;
  std::vector<Entry> entries = directory(zip, *end);
  std::erase_if(entries, [&](const Entry& e) {
    return std::ranges::none_of(suffixes, [&](const auto& one) { return ends_with(e.name, one); });
  });
  if (entries.size() != 1)
    return fail(
        Errc::unsupported,
        fmt::format("{}: holds {} {} files instead of one; unzip it first (or it is damaged)", path,
                    entries.size(), fmt::join(suffixes, " or ")));
  if (entries[0].unpacked > max_bytes)
    return fail(Errc::out_of_range, fmt::format("{}: unpacks to {} bytes, more than {}; unzip it "
                                                "first",
                                                path, entries[0].unpacked, max_bytes));
  ZipEntry result{entries[0].name, {}};
  if (!unpack(zip, entries[0], result.bytes)) return damaged;
  return result;
}

Result<ZipEntry> read_zip_entry(const std::string& path, const std::vector<std::string>& suffixes,
                                std::size_t max_bytes) {
  std::ifstream in(path, std::ios::binary | std::ios::ate);
  const std::streamoff size = in ? std::streamoff(in.tellg()) : -1;
  if (size < 0) return fail(Errc::not_found, path + ": cannot be opened");
  if (std::uint64_t(size) > max_bytes)
    return fail(Errc::out_of_range, fmt::format("{}: {} bytes are more than {} for a zip; unzip it "
                                                "first",
                                                path, size, max_bytes));
  std::vector<std::uint8_t> zip(size);
  in.seekg(0);
  if (!in.read(reinterpret_cast<char*>(zip.data()), size))
    return fail(Errc::io, path + ": cannot be read");

  return zip_entry(zip, path, suffixes, max_bytes);
}

}  // namespace tind
