#include "terrain/base/deflate.h"

#include <libdeflate.h>

#include <algorithm>
#include <memory>
#include <new>

namespace tind {
namespace {

using Compressor = std::unique_ptr<libdeflate_compressor, decltype(&libdeflate_free_compressor)>;
using Decompressor =
    std::unique_ptr<libdeflate_decompressor, decltype(&libdeflate_free_decompressor)>;

/// libdeflate allocates, and says that it could not only by a null pointer.
template <class Tool>
Tool checked(Tool tool) {
  if (!tool) throw std::bad_alloc();
  return tool;
}

/// This thread's compressor of a level. At level 10 and above it has 9 MB, which to take and give
/// back for each tile cost a fifth of the tile's time: 2,200 pages to be made and zeroed. The last
/// one stays.
libdeflate_compressor* compressor(int level) {
  thread_local int level_of_kept = -1;
  thread_local Compressor kept(nullptr, libdeflate_free_compressor);
  if (level != level_of_kept) {
    kept.reset();
    level_of_kept = -1;
    kept = checked(Compressor(libdeflate_alloc_compressor(level), libdeflate_free_compressor));
    level_of_kept = level;
  }
  return kept.get();
}

std::unexpected<Error> damaged() { return fail(Errc::bad_data, "damaged gzip data"); }

}  // namespace

template <class Out>
Out deflate(ByteView bytes, Wrapping wrapping, int level, std::size_t most) {
  libdeflate_compressor* const tool = compressor(level);
  const auto [bound, pack] = [&] {
    switch (wrapping) {
      case Wrapping::zlib:
        return std::pair(&libdeflate_zlib_compress_bound, &libdeflate_zlib_compress);
      case Wrapping::gzip:
        return std::pair(&libdeflate_gzip_compress_bound, &libdeflate_gzip_compress);
      case Wrapping::none:
        break;
    }
    return std::pair(&libdeflate_deflate_compress_bound, &libdeflate_deflate_compress);
  }();
  Out out;
  out.resize(std::min(most, bound(tool, bytes.size)));
  out.resize(pack(tool, bytes.data, bytes.size, out.data(), out.size()));
  return out;
}

template std::vector<std::uint8_t> deflate(ByteView, Wrapping, int, std::size_t);
template std::string deflate(ByteView, Wrapping, int, std::size_t);

Result<std::vector<std::uint8_t>> inflate(ByteView bytes, Wrapping wrapping, std::size_t most) {
  const auto tool =
      checked(Decompressor(libdeflate_alloc_decompressor(), libdeflate_free_decompressor));
  const auto unpack = wrapping == Wrapping::zlib   ? libdeflate_zlib_decompress
                      : wrapping == Wrapping::gzip ? libdeflate_gzip_decompress
                                                   : libdeflate_deflate_decompress;
  std::vector<std::uint8_t> out(most);
  std::size_t size = 0;
  if (unpack(tool.get(), bytes.data, bytes.size, out.data(), out.size(), &size) !=
      LIBDEFLATE_SUCCESS)
    return fail(Errc::bad_data, "damaged compressed data");
  out.resize(size);
  return out;
}

bool is_gzip(ByteView bytes) {
  const auto* p = static_cast<const std::uint8_t*>(bytes.data);
  return bytes.size >= 2 && p[0] == 0x1f && p[1] == 0x8b;
}

Result<std::vector<std::uint8_t>> gunzip(ByteView bytes, std::size_t most) {
  constexpr std::size_t kLeast = 18;  // its header and trailer
  if (bytes.size < kLeast) return damaged();
  // The size in the last four bytes can be a lie: bounded.
  const auto* end = static_cast<const std::uint8_t*>(bytes.data) + bytes.size;
  const std::size_t size = load<std::uint32_t>(end - 4);
  if (size > most) return damaged();
  auto out = inflate(bytes, Wrapping::gzip, size);
  if (!out || out->size() != size) return damaged();
  return out;
}

std::uint32_t crc32(ByteView bytes) { return libdeflate_crc32(0, bytes.data, bytes.size); }

}  // namespace tind
