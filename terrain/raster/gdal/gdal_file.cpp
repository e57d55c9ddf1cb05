// Opening: the path must be a real file (never a GDAL name, URL or inline XML); the header is
// judged before the first block is decoded, since one hostile block can ask for gigabytes.
// Reading: one dataset per concurrent reader, because a GDAL dataset is not thread-safe.
//
// SRTM tiles come as "N41E001.hgt.zip". Random access inside a zip restarts decompression, and
// GDAL does not compare its checksum; so the tile is unpacked into memory, once per handle (26 MB
// for 1").
//
// What lies at the path may change while the source is in use, and a handle that is opened then
// would see other heights than the one before. So whatever was read counts only when all files are
// still as they were when the source was opened.

#include "terrain/raster/gdal/gdal_file.h"

#include <cpl_string.h>
#include <cpl_vsi.h>
#include <fmt/format.h>
#include <gdal_priv.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <filesystem>
#include <limits>
#include <set>

#include "terrain/base/hash.h"
#include "terrain/raster/gdal/gdal_setup.h"
#include "terrain/raster/gdal/gdal_verify.h"
#include "terrain/raster/gdal/zip_entry.h"

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
  if (fs::is_directory(path, error))
    return fail(Errc::not_found, path + ": is a folder; name the rasters in it");
  if (path.starts_with("/vsi") || !fs::exists(path, error))
    return fail(Errc::not_found, path + ": no such file");
  if (!fs::is_regular_file(path, error))
    return fail(Errc::not_found,
                path + ": is a device or a pipe; a raster is read from a file, in any order");
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

/// The file of the system that GDAL reads a name from: that of an archive for a member of it; empty
/// for what is in memory.
std::string file_behind(std::string name) {
  std::error_code error;
  if (name.starts_with("/vsi")) name.erase(0, std::min(name.find('/', 1), name.size() - 1) + 1);
  for (fs::path path = fs::absolute(name, error); path.has_relative_path();
       path = path.parent_path())
    if (fs::is_regular_file(path, error)) return path.string();
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
  return fmt::format("{:016x}", hash64({bytes.data(), got}));
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

namespace {

bool is_vrt(const IdleHandles::Handle& handle) {
  return std::string_view(handle.set->GetDriverName()) == "VRT";
}

}  // namespace

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

RasterFile::RasterFile(std::string path, const DemOptions& options,
                       std::shared_ptr<IdleHandles> idle)
    : path_(std::move(path)),
      allow_vrt_(options.allow_vrt),
      idle_(std::move(idle)),
      ignore_declared_nodata_(options.ignore_declared_nodata),
      nodata_(options.nodata) {}
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
  if (!handle->set && !allow_vrt_ && lower(path_).ends_with(".vrt"))
    return fail(Errc::unsupported, path_ +
                                       ": a VRT can name any other file, so it is read only with "
                                       "--allow-vrt");
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
  const double declared = band.GetNoDataValue(&has);
  if (has && !ignore_declared_nodata_) nodata_.push_back(declared);
  masked_ = (band.GetMaskFlags() & GMF_PER_DATASET) != 0;
  sums_ = std::make_unique<BlockSums>(set);
  if (facts_.driver == "AAIGrid")
    if (auto ok = check_ascii_grid(path_, facts_.cols * facts_.rows); !ok)
      return fail(path_, ok.error());
  if (complaints.failed()) return fail(Errc::bad_data, path_ + ": " + complaints.text(""));
  return {};
}

Result<std::unique_ptr<RasterFile>> RasterFile::open(const std::string& path,
                                                     const DemOptions& options,
                                                     std::shared_ptr<IdleHandles> idle) {
  set_up();
  if (options.allow_vrt) register_vrt();
  std::unique_ptr<RasterFile> file(new RasterFile(path, options, std::move(idle)));
  if (auto real = real_file(path); !real) return std::unexpected(real.error());
  if (auto ok = file->states_.add(path); !ok) return std::unexpected(ok.error());
  auto handle = file->open_handle();
  if (!handle) return std::unexpected(handle.error());
  // Which other files there are is known only now, when they have been looked into already.
  const std::vector<std::string> others = file->files_of(**handle);
  for (const std::string& other : others)
    if (auto ok = file->states_.add(other); !ok) return std::unexpected(ok.error());
  if (!others.empty()) handle = file->open_handle();
  if (!handle) return std::unexpected(handle.error());
  if (auto ok = file->if_unchanged(file->learn(**handle, options.keep_source_units)); !ok)
    return std::unexpected(ok.error());
  file->idle_->give(file.get(), std::move(*handle));
  return file;
}

bool RasterFile::is_void(double raw) const {
  if (!(std::abs(raw) < 1e38)) return true;  // NaN, infinite, or the usual +-3.4e38
  // A float32 nodata value is often written in decimal with other digits than the stored float.
  return std::ranges::any_of(nodata_, [&](double nodata) {
    return raw == nodata || (is_float_ && float(raw) == float(nodata));
  });
}

void RasterFile::count_customary(std::span<const double> raw) const {
  const auto posts = std::int64_t(raw.size());
  if (looked_at_.fetch_add(posts, std::memory_order_relaxed) + posts > facts_.cols * facts_.rows)
    return;
  for (const double z : raw) {
    if (z > -9999 && z < 32767) continue;
    for (std::size_t k = 0; k < customary_.size(); ++k)
      if (z == kCustomaryNodata[k] && !is_void(z))
        customary_[k].fetch_add(1, std::memory_order_relaxed);
  }
}

Result<std::unique_ptr<IdleHandles::Handle>> RasterFile::borrow() const {
  if (auto idle = idle_->take(this)) return idle;
  auto handle = open_handle();
  if (!handle) {
    if (auto same = states_.unchanged(); !same) return std::unexpected(same.error());
    return handle;
  }
  // A mask or a world file that came since is seen by new handles only.
  if (!is_vrt(**handle) && files_of(**handle).size() + 1 != states_.entries().size())
    return fail(Errc::io, path_ +
                              ": there are other files beside it than when it was opened; start "
                              "again to read what is there now");
  return handle;
}

Result<void> RasterFile::if_unchanged(Result<void> done) const {
  if (auto same = states_.unchanged(); !same) return same;
  return done;
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
  for (std::size_t i = 0; i < mask.size(); ++i)
    if (mask[i] == 0) out[i] = kNaN;
  count_customary(out);
  for (double& z : out) z = is_void(z) ? kNaN : z * scale_ + offset_;
  return {};
}

// A handle that failed is not given back: GDAL may keep half-decoded blocks in it.

Result<void> RasterFile::read(int col, int row, int cols, int rows, std::span<double> out) const {
  auto handle = borrow();
  if (!handle) return std::unexpected(handle.error());
  if (auto ok = if_unchanged(read_with(**handle, col, row, cols, rows, out)); !ok) return ok;
  idle_->give(this, std::move(*handle));
  return {};
}

Result<void> RasterFile::read_posts(std::span<const Post> posts) const {
  auto handle = borrow();
  if (!handle) return std::unexpected(handle.error());
  Result<void> done;
  for (const Post& p : posts)
    if (done = read_with(**handle, p.col, p.row, 1, 1, {p.height, 1}); !done) break;
  if (auto ok = if_unchanged(std::move(done)); !ok) return ok;
  idle_->give(this, std::move(*handle));
  return {};
}

std::vector<std::string> RasterFile::files_of(IdleHandles::Handle& handle) const {
  std::vector<std::string> found;
  std::set<std::string> seen = {file_behind(path_)};
  const auto add = [&](GDALDataset& set) {
    const CPLStringList files(set.GetFileList());
    for (int i = 0; i < files.Count(); ++i)
      if (const std::string file = file_behind(files[i]); !file.empty() && seen.insert(file).second)
        found.push_back(file);
  };
  if (is_zip(path_)) return found;
  add(*handle.set);
  if (!is_vrt(handle)) return found;
  // A VRT names its parts, but not what they are made of.
  const Complaints silence;
  for (std::size_t i = 0; i < found.size(); ++i)
    if (const std::unique_ptr<GDALDataset> part{static_cast<GDALDataset*>(GDALOpenEx(
            found[i].c_str(), GDAL_OF_RASTER, raster_drivers(allow_vrt_), nullptr, nullptr))})
      add(*part);
  return found;
}

Result<std::string> RasterFile::fingerprint() const {
  const Complaints silence;
  std::string text;
  for (const auto& [path, state] : states_.entries())
    text += fmt::format("{} {} {} {} {}\n", state.size, state.inode, state.written_ns,
                        state.changed_ns, hash_of_ends(path, state.size));
  if (auto same = states_.unchanged(); !same) return std::unexpected(same.error());
  return text;
}

}  // namespace tind::gdal
