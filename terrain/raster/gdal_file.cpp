// Opening: the path must be a real file (never a GDAL name, URL or inline XML); the header is
// judged before the first block is decoded, since one hostile block can ask for gigabytes.
// Reading: one dataset per concurrent reader, because a GDAL dataset is not thread-safe.
//
// SRTM tiles come as "N41E001.hgt.zip". Random access inside a zip restarts decompression, and GDAL
// does not compare its checksum; so the tile is unpacked into memory, once per handle (26 MB for
// 1").

#include "terrain/raster/gdal_file.h"

#include <cpl_string.h>
#include <cpl_vsi.h>
#include <fmt/format.h>
#include <gdal_priv.h>
#include <xxhash.h>

#include <atomic>
#include <cmath>
#include <filesystem>
#include <limits>

#include "terrain/raster/gdal_setup.h"
#include "terrain/raster/gdal_verify.h"
#include "terrain/raster/zip_entry.h"

namespace tind::gdal {
namespace {

namespace fs = std::filesystem;
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
struct CloseFile {
  void operator()(VSILFILE* file) const { VSIFCloseL(file); }
};
using File = std::unique_ptr<VSILFILE, CloseFile>;
constexpr double kFoot = 0.3048, kUsFoot = 1200.0 / 3937.0;

std::string lower(std::string text) {
  for (char& c : text) c = char(std::tolower(static_cast<unsigned char>(c)));
  return text;
}

bool is_zip(const std::string& path) { return lower(path).ends_with(".zip"); }

/// The path for GDAL: absolute, so that no prefix of GDAL's own name syntax can match.
Result<std::string> real_file(const std::string& path) {
  std::error_code error;
  if (path.starts_with("/vsi") || !fs::is_regular_file(path, error))
    return fail(Errc::not_found, path + ": no such file");
  return fs::absolute(path).string();
}

/// Unpacks an SRTM tile to /vsimem/, whose path is returned; the driver goes by its name.
Result<std::string> unpack(const std::string& path) {
  auto entry = read_zip_entry(path, ".hgt", std::size_t(kRasterLimits.max_block_bytes));
  if (!entry) return std::unexpected(entry.error());
  static std::atomic<unsigned> counter{0};
  const std::string target =
      fmt::format("/vsimem/tind/{}/{}", counter++, CPLGetFilename(entry->name.c_str()));
  const File memory(VSIFOpenL(target.c_str(), "wb"));
  if (!memory ||
      VSIFWriteL(entry->bytes.data(), 1, entry->bytes.size(), memory.get()) != entry->bytes.size())
    return fail(Errc::io, path + ": no memory to unpack it");
  return target;
}

/// Metres per unit as the band's unit type names it; 0 where it names none, NaN where unknown.
double unit_in_metres(const std::string& given) {
  const std::string unit = lower(given);
  if (unit.empty()) return 0;
  for (const char* name : {"m", "metre", "metres", "meter", "meters"})
    if (unit == name) return 1;
  for (const char* name : {"ft", "foot", "feet", "international foot", "international feet"})
    if (unit == name) return kFoot;
  for (const char* name : {"us survey foot", "us survey feet", "ftus", "us-ft", "us_survey_foot",
                           "foot_us", "us_ft", "sft"})
    if (unit == name) return kUsFoot;
  if (unit == "cm" || unit == "centimetre" || unit == "centimeter") return 0.01;
  if (unit == "dm" || unit == "decimetre" || unit == "decimeter") return 0.1;
  if (unit == "mm" || unit == "millimetre" || unit == "millimeter") return 0.001;
  if (unit == "km" || unit == "kilometre" || unit == "kilometer") return 1000;
  return kNaN;
}

/// Refuses what would be costly or meaningless before any block is decoded.
Result<void> preflight(const std::string& path, GDALDataset& set) {
  const int bands = set.GetRasterCount();
  if (bands < 1) return fail(Errc::unsupported, path + ": has no raster");
  GDALRasterBand& band = *set.GetRasterBand(1);
  const bool alpha = bands == 2 && set.GetRasterBand(2)->GetColorInterpretation() == GCI_AlphaBand;
  if (bands > 1 && !alpha)
    return fail(
        Errc::unsupported,
        fmt::format("{}: has {} bands; a DEM has one (pick it: gdal_translate -b 1)", path, bands));
  const GDALDataType type = band.GetRasterDataType();
  if (GDALDataTypeIsComplex(type) || band.GetColorTable())
    return fail(Errc::unsupported, path + ": its numbers are colours or complex, not heights");
  const std::int64_t cols = set.GetRasterXSize(), rows = set.GetRasterYSize();
  if (cols < 1 || rows < 1 || cols > kRasterLimits.max_side || rows > kRasterLimits.max_side)
    return fail(Errc::out_of_range, fmt::format("{}: {} x {} posts is beyond {} a side", path, cols,
                                                rows, kRasterLimits.max_side));
  int block_cols = 0, block_rows = 0;
  band.GetBlockSize(&block_cols, &block_rows);
  const std::int64_t sample = GDALGetDataTypeSizeBytes(type) * bands;
  if (std::int64_t(block_cols) * block_rows > kRasterLimits.max_block_bytes / sample)
    return fail(Errc::out_of_range,
                fmt::format("{}: blocks of {} x {} are larger than {} MiB; rewrite it with "
                            "gdal_translate -co TILED=YES",
                            path, block_cols, block_rows, kRasterLimits.max_block_bytes >> 20));
  const std::string driver = set.GetDriverName();
  const bool whole = driver == "PNG" || driver == "USGSDEM";
  if (whole && cols * rows > kRasterLimits.max_whole_bytes / sample)
    return fail(Errc::out_of_range, path + ": too large for its format; convert it to GeoTIFF");
  return {};
}

std::string hash_of_ends(const std::string& path, std::uint64_t size) {
  constexpr std::uint64_t kEnd = 64 << 10;
  const File file(VSIFOpenL(path.c_str(), "rb"));
  if (!file) return "unreadable";
  std::string bytes(std::min(size, 2 * kEnd), '\0');
  const std::size_t head = std::min<std::size_t>(bytes.size(), kEnd);
  std::size_t got = VSIFReadL(bytes.data(), 1, head, file.get());
  if (bytes.size() > head) {
    VSIFSeekL(file.get(), size - (bytes.size() - head), SEEK_SET);
    got += VSIFReadL(bytes.data() + head, 1, bytes.size() - head, file.get());
  }
  return fmt::format("{:016x}", XXH3_64bits(bytes.data(), got));
}

}  // namespace

struct IdleHandles::Handle {
  GDALDataset* set = nullptr;
  std::string memory;     // the /vsimem/ file below it, if any
  std::size_t bytes = 0;  // of that file

  Handle() = default;
  Handle(const Handle&) = delete;
  Handle& operator=(const Handle&) = delete;
  ~Handle() {
    const Complaints silence;
    if (set) GDALClose(set);
    if (!memory.empty()) VSIUnlink(memory.c_str());
  }
};

struct IdleHandles::Entry {
  const RasterFile* owner;
  std::unique_ptr<Handle> handle;
};

IdleHandles::IdleHandles(std::size_t max_bytes) : max_bytes_(max_bytes) {}
IdleHandles::~IdleHandles() = default;

std::unique_ptr<IdleHandles::Handle> IdleHandles::take(const RasterFile* owner) {
  const std::lock_guard lock(mutex_);
  for (auto it = idle_.begin(); it != idle_.end(); ++it) {
    if (it->owner != owner) continue;
    auto handle = std::move(it->handle);
    bytes_ -= handle->bytes;
    idle_.erase(it);
    return handle;
  }
  return nullptr;
}

void IdleHandles::give(const RasterFile* owner, std::unique_ptr<Handle> handle) {
  std::list<Entry> closed;  // destroyed after the lock is gone
  const std::lock_guard lock(mutex_);
  bytes_ += handle->bytes;
  idle_.push_front({owner, std::move(handle)});
  while (idle_.size() > kMaxIdle || (bytes_ > max_bytes_ && idle_.size() > 1)) {
    bytes_ -= idle_.back().handle->bytes;
    closed.splice(closed.begin(), idle_, std::prev(idle_.end()));
  }
}

RasterFile::RasterFile(std::string path, bool allow_vrt, std::shared_ptr<IdleHandles> idle)
    : path_(std::move(path)), allow_vrt_(allow_vrt), idle_(std::move(idle)) {}
RasterFile::~RasterFile() = default;

Result<std::unique_ptr<IdleHandles::Handle>> RasterFile::open_handle() const {
  const Complaints complaints;
  auto real = real_file(path_);
  if (!real) return std::unexpected(real.error());
  auto handle = std::make_unique<IdleHandles::Handle>();
  std::string target = *real;
  if (is_zip(path_)) {
    auto memory = unpack(path_);
    if (!memory) return std::unexpected(memory.error());
    target = handle->memory = *memory;
    VSIStatBufL stat;
    if (VSIStatL(target.c_str(), &stat) == 0) handle->bytes = std::size_t(stat.st_size);
  }
  handle->set = static_cast<GDALDataset*>(
      GDALOpenEx(target.c_str(), GDAL_OF_RASTER | GDAL_OF_READONLY | GDAL_OF_VERBOSE_ERROR,
                 raster_drivers(allow_vrt_), nullptr, nullptr));
  if (!handle->set)
    return fail(Errc::bad_data, path_ +
                                    ": not a raster tind reads (GeoTIFF, SRTM HGT, DTED, USGS "
                                    "DEM, Arc/Info ASCII, PNG), or damaged: " +
                                    complaints.text("no driver recognises it"));
  return handle;
}

Result<void> RasterFile::learn(IdleHandles::Handle& handle, bool keep_source_units) {
  const Complaints complaints;
  GDALDataset& set = *handle.set;
  if (auto ok = preflight(path_, set); !ok) return ok;
  GDALRasterBand& band = *set.GetRasterBand(1);
  facts_.path = path_;
  facts_.driver = set.GetDriverName();
  facts_.cols = set.GetRasterXSize();
  facts_.rows = set.GetRasterYSize();

  double g[6] = {0, 1, 0, 0, 0, 1};
  const bool placed = set.GetGeoTransform(g) == CE_None;
  const bool identity =
      g[0] == 0 && g[1] == 1 && g[2] == 0 && g[3] == 0 && g[4] == 0 && std::abs(g[5]) == 1;
  if (placed && !identity) {
    facts_.has_geotransform = true;
    facts_.post_to_crs = {g[0] + 0.5 * (g[1] + g[2]), g[1], g[2],
                          g[3] + 0.5 * (g[4] + g[5]), g[4], g[5]};
    const double det = g[1] * g[5] - g[2] * g[4];
    if (!std::isfinite(det) || det == 0 || !std::isfinite(g[0]) || !std::isfinite(g[3]))
      return fail(Errc::bad_data, path_ + ": its geotransform is singular");
    auto crs = describe(set.GetSpatialRef());
    if (!crs) return fail(path_, crs.error());
    facts_.crs = *crs;
  }

  int has = 0;
  scale_ = band.GetScale(&has);
  offset_ = band.GetOffset(&has);
  if (!std::isfinite(scale_) || scale_ == 0 || !std::isfinite(offset_))
    return fail(Errc::bad_data, path_ + ": its scale or offset is not a number");
  facts_.z_unit_m = unit_in_metres(band.GetUnitType());
  if (std::isnan(facts_.z_unit_m))
    return fail(Errc::unsupported, fmt::format("{}: heights in the unit '{}', which tind does not "
                                               "know; set m or ft with gdal_edit.py -units",
                                               path_, band.GetUnitType()));
  if (facts_.z_unit_m == 0) facts_.z_unit_m = facts_.crs.vertical_unit_m;
  if (facts_.z_unit_m == 0) facts_.z_unit_m = 1;

  const GDALDataType type = band.GetRasterDataType();
  is_float_ = GDALDataTypeIsFloating(type);
  const bool converted =
      scale_ != 1 || offset_ != 0 || (facts_.z_unit_m != 1 && !keep_source_units);
  facts_.exact = !converted && type != GDT_Float64;
  if (!keep_source_units) {
    scale_ *= facts_.z_unit_m;
    offset_ *= facts_.z_unit_m;
  }
  nodata_ = band.GetNoDataValue(&has);
  has_nodata_ = has != 0;
  masked_ = (band.GetMaskFlags() & GMF_PER_DATASET) != 0;
  sums_ = std::make_unique<BlockSums>(set);
  if (facts_.driver == "AAIGrid")
    if (auto ok = check_ascii_grid(path_, facts_.cols * facts_.rows); !ok)
      return fail(path_, ok.error());
  if (complaints.failed()) return fail(Errc::bad_data, path_ + ": " + complaints.text(""));
  return {};
}

Result<std::unique_ptr<RasterFile>> RasterFile::open(const std::string& path, bool allow_vrt,
                                                     bool keep_source_units,
                                                     std::shared_ptr<IdleHandles> idle) {
  set_up();
  if (allow_vrt) register_vrt();
  std::unique_ptr<RasterFile> file(new RasterFile(path, allow_vrt, std::move(idle)));
  auto handle = file->open_handle();
  if (!handle) return std::unexpected(handle.error());
  if (auto ok = file->learn(**handle, keep_source_units); !ok) return std::unexpected(ok.error());
  file->idle_->give(file.get(), std::move(*handle));
  return file;
}

bool RasterFile::is_void(double raw) const {
  if (!(std::abs(raw) < 1e38)) return true;  // NaN, infinite, or the usual +-3.4e38
  if (!has_nodata_) return false;
  // A float32 nodata value is often written in decimal with other digits than the stored float.
  return raw == nodata_ || (is_float_ && float(raw) == float(nodata_));
}

Result<std::unique_ptr<IdleHandles::Handle>> RasterFile::borrow() const {
  if (auto idle = idle_->take(this)) return idle;
  auto handle = open_handle();
  if (!handle) return handle;
  GDALDataset& set = *(*handle)->set;
  if (set.GetRasterXSize() != facts_.cols || set.GetRasterYSize() != facts_.rows)
    return fail(Errc::bad_data, path_ + ": the file changed while it was open");
  return handle;
}

Result<void> RasterFile::read_with(IdleHandles::Handle& handle, int col, int row, int cols,
                                   int rows, std::span<double> out) const {
  if (auto ok = sums_->check(*handle.set, path_, col, row, cols, rows); !ok)
    return fail(path_, ok.error());
  const Complaints complaints;
  GDALRasterBand& band = *handle.set->GetRasterBand(1);
  CPLErr status = band.RasterIO(GF_Read, col, row, cols, rows, out.data(), cols, rows, GDT_Float64,
                                0, 0, nullptr);
  std::vector<GByte> mask;
  if (status == CE_None && masked_) {
    mask.resize(out.size());
    status = band.GetMaskBand()->RasterIO(GF_Read, col, row, cols, rows, mask.data(), cols, rows,
                                          GDT_Byte, 0, 0, nullptr);
  }
  if (status != CE_None || complaints.failed())
    return fail(Errc::bad_data,
                fmt::format("{}: cannot read posts at column {}, row {}: {}", path_, col, row,
                            complaints.text("the file is truncated or damaged")));
  for (std::size_t i = 0; i < out.size(); ++i) {
    const bool hidden = !mask.empty() && mask[i] == 0;
    out[i] = hidden || is_void(out[i]) ? kNaN : out[i] * scale_ + offset_;
  }
  return {};
}

// A handle that failed is not given back: GDAL may keep half-decoded blocks in it.

Result<void> RasterFile::read(int col, int row, int cols, int rows, std::span<double> out) const {
  auto handle = borrow();
  if (!handle) return std::unexpected(handle.error());
  if (auto ok = read_with(**handle, col, row, cols, rows, out); !ok) return ok;
  idle_->give(this, std::move(*handle));
  return {};
}

Result<void> RasterFile::read_posts(std::span<const Post> posts) const {
  auto handle = borrow();
  if (!handle) return std::unexpected(handle.error());
  for (const Post& p : posts)
    if (auto ok = read_with(**handle, p.col, p.row, 1, 1, {p.height, 1}); !ok) return ok;
  idle_->give(this, std::move(*handle));
  return {};
}

Result<std::string> RasterFile::fingerprint() const {
  const Complaints silence;
  auto handle = borrow();
  if (!handle) return std::unexpected(handle.error());
  CPLStringList files((*handle)->set->GetFileList());
  idle_->give(this, std::move(*handle));
  if (is_zip(path_)) {
    files.Clear();
    files.AddString(path_.c_str());
  }
  std::string text;
  for (int i = 0; i < files.Count(); ++i) {
    const char* name = files[i];
    VSIStatBufL stat;
    if (VSIStatL(name, &stat) != 0) return fail(Errc::io, std::string(name) + ": cannot be read");
    const auto size = std::uint64_t(stat.st_size);
    text += fmt::format("{} {} {}\n", size, std::int64_t(stat.st_mtime), hash_of_ends(name, size));
  }
  return text;
}

}  // namespace tind::gdal
