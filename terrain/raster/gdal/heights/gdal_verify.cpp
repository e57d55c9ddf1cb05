#include "terrain/raster/gdal/heights/gdal_verify.h"

#include <cpl_string.h>
#include <cpl_vsi.h>
#include <fmt/format.h>
#include <gdal_priv.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdlib>
#include <memory>
#include <string_view>
#include <utility>

#include "terrain/base/deflate.h"
#include "terrain/base/errno_text.h"
#include "terrain/base/lower_case.h"

namespace tind::gdal {
namespace {

struct CloseFile {
  void operator()(VSILFILE* file) const { VSIFCloseL(file); }
};
using File = std::unique_ptr<VSILFILE, CloseFile>;

/// (Masks inside a file are datasets without a driver. Of other formats blocks have no place.)
bool is_deflate_tiff(GDALDataset& set) {
  const char* compression = set.GetMetadataItem("COMPRESSION", "IMAGE_STRUCTURE");
  const std::string_view driver = set.GetDriver() ? set.GetDriverName() : "GTiff";
  return driver == "GTiff" && compression && std::string_view(compression) == "DEFLATE";
}

std::uint64_t blocks_along(int posts, int block) { return std::uint64_t(posts - 1) / block + 1; }

/// Where a block lies in the file; size 0 where it does not (all nodata), or is not known.
struct Extent {
  std::uint64_t offset = 0, size = 0;
};
Extent extent_of(GDALRasterBand& band, int x, int y) {
  const auto item = [&](const char* what) -> std::uint64_t {
    const char* text =
        band.GetMetadataItem(fmt::format("BLOCK_{}_{}_{}", what, x, y).c_str(), "TIFF");
    return text ? std::strtoull(text, nullptr, 10) : 0;
  };
  const std::uint64_t offset = item("OFFSET");
  return {offset, offset ? item("SIZE") : 0};
}

/// One number of an ASCII grid, byte by byte. What GDAL reads of "1.2.3" is 1.2, of "--5" it is 0:
/// heights that nobody wrote. Words ("nan", "inf", "1.#QNAN") pass by their letters.
class NumberShape {
 public:
  void begin() { state_ = State::nothing, whole_ = 0, negative_ = false; }
  void take(char c) {
    using enum State;
    negative_ |= c == '-';
    if (c >= '0' && c <= '9') whole_ = std::min(10 * whole_ + (c - '0'), kTooLarge);
    const bool digit = c >= '0' && c <= '9', point = c == '.' || c == ',',
               sign = c == '+' || c == '-';
    if (state_ == word || std::string_view("nNaAiIfF#qQ").contains(c))
      state_ =
          state_ == bad || !(digit || std::string_view("nNaAiIfF#qQdD").contains(c)) ? bad : word;
    else if (digit)
      state_ = state_ == nothing || state_ == signed_    ? whole
               : state_ == bare_point                    ? fraction
               : state_ == power || state_ == power_sign ? power_digits
                                                         : state_;
    else if (point)
      state_ = state_ == whole                          ? fraction
               : state_ == nothing || state_ == signed_ ? bare_point
                                                        : bad;
    else if (sign)
      state_ = state_ == nothing ? signed_ : state_ == power ? power_sign : bad;
    else if (c == 'e' || c == 'E')
      state_ = state_ == whole || state_ == fraction ? power : bad;
    else
      state_ = bad;
  }
  /// False as soon as it cannot become a number.
  bool may_be() const { return state_ != State::bad; }
  bool is_number() const {
    using enum State;
    return state_ == whole || state_ == fraction || state_ == power_digits || state_ == word;
  }
  /// Of a number: is it a whole one of 32 bits?
  bool is_whole() const { return state_ == State::whole && whole_ - negative_ < kTooLarge - 1; }

 private:
  enum class State {
    nothing,
    signed_,
    whole,
    bare_point,
    fraction,
    power,
    power_sign,
    power_digits,
    word,
    bad
  };
  static constexpr std::int64_t kTooLarge = (std::int64_t(1) << 31) + 1;
  State state_ = State::nothing;
  std::int64_t whole_ = 0;  // its digits
  bool negative_ = false;
};

}  // namespace

BlockSums::BlockSums(GDALDataset& set, std::vector<int> bands) : bands_(std::move(bands)) {
  if (!is_deflate_tiff(set)) return;
  GDALRasterBand& band = *set.GetRasterBand(bands_[0]);
  band.GetBlockSize(&block_cols_, &block_rows_);
  across_ = blocks_along(set.GetRasterXSize(), block_cols_);
  const auto down = blocks_along(set.GetRasterYSize(), block_rows_);
  block_bytes_ = std::size_t(block_cols_) * block_rows_ * set.GetRasterCount() *
                 std::size_t(GDALGetDataTypeSizeBytes(band.GetRasterDataType()));
  of_band_ = across_ * down;
  pages_ = std::vector<std::atomic<Page*>>((of_band_ * bands_.size() - 1) / kPage + 1);
}

BlockSums::~BlockSums() {
  for (const std::atomic<Page*>& page : pages_) delete page.load();
}

std::atomic<bool>& BlockSums::good(std::uint64_t block) const {
  std::atomic<Page*>& place = pages_[block / kPage];
  Page* page = place.load(std::memory_order_acquire);
  if (!page) {
    auto made = std::make_unique<Page>();
    if (place.compare_exchange_strong(page, made.get(), std::memory_order_acq_rel))
      page = made.release();
  }
  return (*page)[block % page->size()];
}

Result<void> BlockSums::check(GDALDataset& set, const std::string& real, int col, int row, int cols,
                              int rows) const {
  if (pages_.empty()) return {};
  for (std::size_t b = 0; b < bands_.size(); ++b)
    for (int y = row / block_rows_; y <= (row + rows - 1) / block_rows_; ++y)
      for (int x = col / block_cols_; x <= (col + cols - 1) / block_cols_; ++x) {
        const std::uint64_t block = b * of_band_ + std::uint64_t(y) * across_ + std::uint64_t(x);
        if (pages_[block / kPage] && good(block).load(std::memory_order_relaxed)) continue;
        const auto there = check_block(set, real, bands_[b], x, y);
        if (!there) return std::unexpected(there.error());
        if (*there) good(block).store(true, std::memory_order_relaxed);
      }
  return {};
}

Result<bool> BlockSums::check_block(GDALDataset& set, const std::string& real, int band, int x,
                                    int y) const {
  const Extent extent = extent_of(*set.GetRasterBand(band), x, y);
  if (extent.size == 0) return false;
  // DEFLATE grows incompressible data by 5 bytes in 65535, and never by half.
  if (extent.size > block_bytes_ + block_bytes_ / 2 + 1024)
    return fail(Errc::bad_data, fmt::format("block {}, {} claims {} bytes", x, y, extent.size));
  std::vector<std::uint8_t> packed(extent.size);
  const File file(VSIFOpenL(real.c_str(), "rb"));
  if (!file)
    return fail(Errc::io, fmt::format("block {}, {} cannot be read: {}", x, y, errno_text(errno)));
  if (VSIFSeekL(file.get(), extent.offset, SEEK_SET) != 0 ||
      VSIFReadL(packed.data(), 1, packed.size(), file.get()) != packed.size())
    return fail(VSIFEofL(file.get()) ? Errc::bad_data : Errc::io,
                fmt::format("block {}, {} {}", x, y,
                            VSIFEofL(file.get()) ? "is cut off" : "cannot be read"));
  if (!inflate(packed, Wrapping::zlib, block_bytes_))
    return fail(Errc::bad_data, fmt::format("the checksum of block {}, {} is wrong", x, y));
  return true;
}

Result<void> check_ascii_grid(const std::string& real, std::int64_t posts, bool whole) {
  const File file(VSIFOpenL(real.c_str(), "rb"));
  if (!file) return fail(Errc::io, "cannot be opened");
  std::string chunk(1 << 20, '\0');
  bool line_start = true, keyword = false, between = true;
  std::int64_t line = 1, numbers = 0;
  NumberShape shape;
  const auto no_number = [&] {
    return fail(Errc::bad_data, fmt::format("line {} holds something that is no number", line));
  };
  const auto not_whole = [&] {
    return fail(Errc::bad_data,
                fmt::format("line {} holds something that is no whole number of 32 bits, in a file "
                            "without a decimal point, where GDAL takes it for another one: write "
                            "one height with a point (100.0), or voids as the NODATA_value",
                            line));
  };
  while (const std::size_t got = VSIFReadL(chunk.data(), 1, chunk.size(), file.get()))
    for (const char c : std::string_view(chunk.data(), got)) {
      // Header lines start with a word: ncols, xllcorner, NODATA_value ...
      if (line_start) keyword = line <= 16 && std::string_view("nNxXyYcCdD").contains(c);
      const bool space = c == ' ' || c == '\t' || c == '\r' || c == '\n';
      if (!keyword) {
        if (!space && between) ++numbers, shape.begin();
        if (!space) shape.take(c);
        if (space ? !between && !shape.is_number() : !shape.may_be()) return no_number();
        if (whole && space && !between && !shape.is_whole()) return not_whole();
      }
      between = space || keyword;
      line_start = c == '\n';
      if (line_start) ++line;
    }
  if (!VSIFEofL(file.get())) return fail(Errc::io, "cannot be read to its end");
  if (!between && !shape.is_number()) return no_number();
  if (whole && !between && !shape.is_whole()) return not_whole();
  if (numbers < posts)
    return fail(Errc::bad_data, fmt::format("holds {} numbers for {} posts", numbers, posts));
  return {};
}

namespace {

/// The first of the files of a dataset with this ending; empty where there is none.
std::string file_with_ending(GDALDataset& set, std::string_view ending) {
  char** const all = set.GetFileList();
  std::string found;
  for (char** file = all; file && *file && found.empty(); ++file)
    if (lower_case(*file).ends_with(ending)) found = *file;
  CSLDestroy(all);
  return found;
}

/// Of the blocks of all bands.
std::uint64_t bytes_of_blocks(GDALDataset& set) {
  GDALRasterBand& band = *set.GetRasterBand(1);
  int cols = 1, rows = 1;
  band.GetBlockSize(&cols, &rows);
  const char* const said = band.GetMetadataItem("NBITS", "IMAGE_STRUCTURE");
  const auto bits = std::uint64_t(said ? std::max(1, std::atoi(said))
                                       : GDALGetDataTypeSizeBits(band.GetRasterDataType()));
  const auto across = blocks_along(set.GetRasterXSize(), cols);
  const auto down = blocks_along(set.GetRasterYSize(), rows);
  return across * down * std::uint64_t(set.GetRasterCount()) *
         ((std::uint64_t(cols) * std::uint64_t(rows) * bits + 7) / 8);
}

/// Before the blocks: a mark, what the stack of bands is like, and for each band a bit for each
/// block. A file that was not written like that has at least the mark.
std::uint64_t bytes_before_blocks(GDALDataset& set, VSILFILE& file) {
  constexpr std::uint64_t kMark = 26, kStack = 1 + 5 * 4 + 2, kBand = 5 * 4;
  std::array<std::uint8_t, kMark + kStack> head{};
  if (VSIFReadL(head.data(), 1, head.size(), &file) != head.size()) return kMark;
  const auto number = [&](std::size_t i) {
    const std::uint8_t* const at = &head[kMark + 1 + i * 4];
    return at[0] | at[1] << 8 | at[2] << 16 | std::int64_t(at[3]) << 24;
  };
  int cols = 1, rows = 1;
  set.GetRasterBand(1)->GetBlockSize(&cols, &rows);
  const std::array<std::int64_t, 5> wanted = {set.GetRasterCount(), set.GetRasterXSize(),
                                              set.GetRasterYSize(), cols, rows};
  for (std::size_t i = 0; i < wanted.size(); ++i)
    if (number(i) != wanted[i]) return kMark;
  const auto across = blocks_along(set.GetRasterXSize(), cols);
  const auto down = blocks_along(set.GetRasterYSize(), rows);
  return kMark + kStack + std::uint64_t(set.GetRasterCount()) * (kBand + (across + 7) / 8 * down);
}

}  // namespace

Result<void> check_spill(GDALDataset& set) {
  const std::string spill = file_with_ending(set, ".ige");
  if (spill.empty()) return {};
  const File file(VSIFOpenL(spill.c_str(), "rb"));
  if (!file) return fail(Errc::io, spill + ": cannot be opened: " + errno_text(errno));
  const std::uint64_t wanted = bytes_before_blocks(set, *file) + bytes_of_blocks(set);
  if (VSIFSeekL(file.get(), 0, SEEK_END) != 0) return fail(Errc::io, spill + ": cannot be read");
  const std::uint64_t there = VSIFTellL(file.get());
  if (there >= wanted) return {};
  return fail(Errc::bad_data, fmt::format("{}: is cut off: it has {} bytes, and its blocks take {}",
                                          spill, there, wanted));
}

}  // namespace tind::gdal
