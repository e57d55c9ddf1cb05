// Opening: the path must be a real file (never a GDAL name, URL or inline XML); the header is
// judged before the first block is decoded, since one hostile block can ask for gigabytes.
// Reading: one dataset per concurrent reader, because a GDAL dataset is not thread-safe.
//
// SRTM tiles come as "N41E001.hgt.zip". Random access inside a zip restarts decompression, and
// GDAL does not compare its checksum; so the tile is unpacked into memory (26 MB for 1"), where all
// handles of the file share it.
//
// What lies at the path may change while the source is in use, and a handle that is opened then
// would see other heights than the one before. So whatever was read counts only when all files are
// still as they were when the source was opened. A file on another machine says so itself, with
// every range that is read of it.

#include "terrain/raster/gdal/heights/gdal_file.h"

#include <cpl_string.h>
#include <cpl_vsi.h>
#include <fcntl.h>
#include <fmt/format.h>
#include <gdal_priv.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <filesystem>
#include <limits>
#include <set>
#include <string_view>

#include "terrain/base/descriptor.h"
#include "terrain/base/errno_text.h"
#include "terrain/base/existing_file.h"
#include "terrain/base/file_io.h"
#include "terrain/base/hash.h"
#include "terrain/base/lower_case.h"
#include "terrain/base/whole_io.h"
#include "terrain/raster/datums.h"
#include "terrain/raster/dem_files.h"
#include "terrain/raster/gdal/crs/gdal_crs.h"
#include "terrain/raster/gdal/crs/geotransform.h"
#include "terrain/raster/gdal/gdal_setup.h"
#include "terrain/raster/gdal/heights/beside_raster.h"
#include "terrain/raster/gdal/heights/file_wire.h"
#include "terrain/raster/gdal/heights/gdal_verify.h"
#include "terrain/raster/gdal/heights/vrt_nesting.h"
#include "terrain/raster/gdal/heights/zip_entry.h"

namespace tind::gdal {
namespace {

namespace fs = std::filesystem;
constexpr const char* kOnlyGeoTiff[] = {"GTiff", nullptr};
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
struct CloseFile {
  void operator()(VSILFILE* file) const { VSIFCloseL(file); }
};
using File = std::unique_ptr<VSILFILE, CloseFile>;

bool is_zip(const std::string& path) { return lower_case(path).ends_with(".zip"); }

/// The path for GDAL: absolute, so that no prefix of GDAL's own name syntax can match.
Result<std::string> real_file(const std::string& path) {
  std::error_code error;
  if (fs::is_directory(path, error))
    return fail(Errc::not_found, path + ": is a folder; name the rasters in it");
  if (path.starts_with("/vsi")) return fail(Errc::not_found, path + ": no such file");
  if (auto there = check_exists(path); !there) return std::unexpected(there.error());
  if (!fs::is_regular_file(path, error))
    return fail(Errc::not_found,
                path + ": is a device or a pipe; a raster is read from a file, in any order");
  if (auto ok = look_beside(path); !ok) return std::unexpected(ok.error());
  const int file = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (file < 0)
    return fail(errno == ENOENT || errno == ENOTDIR || errno == EACCES ? Errc::not_found : Errc::io,
                path + ": " + errno_text(errno));
  ::close(file);
  return fs::absolute(path).string();
}

}  // namespace

/// A file in memory, below all handles of one raster.
struct IdleHandles::Unpacked {
  std::string path;  // below /vsimem/
  std::size_t bytes = 0;

  Unpacked() = default;
  Unpacked(const Unpacked&) = delete;
  Unpacked& operator=(const Unpacked&) = delete;
  ~Unpacked() {
    const Complaints silence;
    if (!path.empty()) VSIUnlink(path.c_str());
  }
};

namespace {

/// An SRTM tile or a GeoTIFF in memory; the driver goes by its name.
Result<std::shared_ptr<const IdleHandles::Unpacked>> unpack(const std::string& path) {
  auto entry =
      read_zip_entry(path, {".hgt", ".tif", ".tiff"}, std::size_t(kRasterLimits.max_whole_bytes));
  if (!entry) return std::unexpected(entry.error());
  static std::atomic<unsigned> counter{0};
  auto unpacked = std::make_shared<IdleHandles::Unpacked>();
  unpacked->path =
      fmt::format("/vsimem/tind/{}/{}", counter++, CPLGetFilename(entry->name.c_str()));
  unpacked->bytes = entry->bytes.size();
  const File memory(VSIFOpenL(unpacked->path.c_str(), "wb"));
  if (!memory ||
      VSIFWriteL(entry->bytes.data(), 1, entry->bytes.size(), memory.get()) != entry->bytes.size())
    return fail(Errc::io, path + ": no memory to unpack it");
  return unpacked;
}

/// The file of the system that GDAL reads a name from: that of an archive for a member of it; empty
/// for what is in memory.
Result<std::string> file_behind(std::string name) {
  std::error_code error;
  if (name.starts_with("/vsi")) name.erase(0, std::min(name.find('/', 1), name.size() - 1) + 1);
  for (fs::path path = fs::absolute(name, error); path.has_relative_path();
       path = path.parent_path()) {
    const auto type = fs::status(path, error).type();
    if (type == fs::file_type::regular) return path.string();
    if (type == fs::file_type::none)
      return fail(Errc::io, "cannot look at " + path.string() + ": " + error.message());
  }
  return "";
}

/// Of the first and the last 64 KB.
Result<std::string> hash_of_ends(const std::string& path, std::uint64_t size) {
  constexpr std::uint64_t kEnd = 64 << 10;
  const Descriptor file(::open(path.c_str(), O_RDONLY | O_CLOEXEC));
  if (file.get() < 0) return fail(Errc::io, "cannot open " + path + ": " + errno_text(errno));
  std::string bytes(std::min(size, 2 * kEnd), '\0');
  const std::size_t head = std::min<std::size_t>(bytes.size(), kEnd), tail = bytes.size() - head;
  if (!read_whole_at(file.get(), 0, bytes.data(), head) ||
      !read_whole_at(file.get(), size - tail, bytes.data() + head, tail))
    return fail(Errc::io, "cannot read " + path);
  return fmt::format("{:016x}", hash64({bytes.data(), bytes.size()}));
}

}  // namespace

struct IdleHandles::Handle {
  GDALDataset* set = nullptr;
  std::shared_ptr<const Unpacked> memory;  // below it, if any

  std::size_t bytes() const { return memory ? memory->bytes : 0; }

  Handle() = default;
  Handle(const Handle&) = delete;
  Handle& operator=(const Handle&) = delete;
  ~Handle() {
    const Complaints silence;
    if (set) GDALClose(set);
  }
};

struct IdleHandles::Entry {
  const RasterFile* owner;
  std::unique_ptr<Handle> handle;
};

namespace {

bool is_vrt(GDALDataset& set) { return std::string_view(set.GetDriverName()) == "VRT"; }

/// What `set`, opened from `path`, is read from beside it; of a VRT also what its parts are.
Result<std::vector<std::string>> other_files(GDALDataset& set, const std::string& path,
                                             bool allow_vrt) {
  std::vector<std::string> found;
  std::set<std::string> seen;
  const auto add = [&](GDALDataset& one) -> Result<void> {
    const CPLStringList files(one.GetFileList());
    for (int i = 0; i < files.Count(); ++i) {
      // Overviews are never read: who makes them beside a DEM that is served changes no height.
      if (std::string_view(files[i]).ends_with(".ovr")) continue;
      const auto file = file_behind(files[i]);
      if (!file) return std::unexpected(file.error());
      if (!file->empty() && seen.insert(*file).second) found.push_back(*file);
    }
    return {};
  };
  const auto own = file_behind(path);
  if (!own) return std::unexpected(own.error());
  seen.insert(*own);
  if (auto ok = add(set); !ok) return std::unexpected(ok.error());
  if (!is_vrt(set)) return found;
  // A VRT names its parts, but not what they are made of.
  const Complaints silence;
  for (std::size_t i = 0; i < found.size(); ++i)
    if (const std::unique_ptr<GDALDataset> part{static_cast<GDALDataset*>(
            GDALOpenEx(found[i].c_str(), GDAL_OF_RASTER, raster_drivers(allow_vrt, found[i]),
                       nullptr, nullptr))})
      if (auto ok = add(*part); !ok) return std::unexpected(ok.error());
  return found;
}

/// An .img names the file that its posts lie in where they are many, and GDAL opens whatever that
/// is, a pipe among others.
Result<void> check_spilled(GDALDataset& set, const std::string& path, const std::string& shown) {
  if (std::string_view(set.GetDriverName()) != "HFA") return {};
  const CPLStringList files(set.GetFileList());
  for (int i = 0; i < files.Count(); ++i) {
    std::error_code error;
    if (belongs_to(path, files[i]) && fs::is_regular_file(files[i], error)) continue;
    return fail(Errc::unsupported,
                fmt::format("{}: its posts are in {}, which is no file of its own name beside it: "
                            "rename both alike, or make a GeoTIFF of it (gdal_translate)",
                            shown, files[i]));
  }
  return {};
}

}  // namespace

IdleHandles::IdleHandles(std::size_t max_bytes, std::size_t max_open)
    : max_bytes_(max_bytes), max_open_(max_open) {}
IdleHandles::~IdleHandles() = default;

std::unique_ptr<IdleHandles::Handle> IdleHandles::take(const RasterFile* owner) {
  const std::lock_guard lock(mutex_);
  for (auto it = idle_.begin(); it != idle_.end(); ++it) {
    if (it->owner != owner) continue;
    auto handle = std::move(it->handle);
    bytes_ -= handle->bytes();
    idle_.erase(it);
    return handle;
  }
  return nullptr;
}

void IdleHandles::give(const RasterFile* owner, std::unique_ptr<Handle> handle) {
  std::list<Entry> closed;  // destroyed after the lock is gone
  const std::lock_guard lock(mutex_);
  bytes_ += handle->bytes();
  idle_.push_front({owner, std::move(handle)});
  while (idle_.size() > max_open_ || (bytes_ > max_bytes_ && idle_.size() > 1)) {
    bytes_ -= idle_.back().handle->bytes();
    closed.splice(closed.begin(), idle_, std::prev(idle_.end()));
  }
}

void IdleHandles::forget(const RasterFile* owner) {
  std::list<Entry> closed;  // destroyed after the lock is gone
  const std::lock_guard lock(mutex_);
  for (auto it = idle_.begin(); it != idle_.end();) {
    const auto here = it++;
    if (here->owner != owner) continue;
    bytes_ -= here->handle->bytes();
    closed.splice(closed.begin(), idle_, here);
  }
}

RasterFile::RasterFile(std::string path, const DemOptions& options,
                       std::shared_ptr<IdleHandles> idle)
    : path_(std::move(path)), allow_vrt_(options.allow_vrt), idle_(std::move(idle)) {}
RasterFile::~RasterFile() { idle_->forget(this); }

Result<std::shared_ptr<const IdleHandles::Unpacked>> RasterFile::unpacked() const {
  const std::lock_guard one_at_a_time(unpacking_);
  if (auto there = unpacked_.lock()) return there;
  auto made = unpack(path_);
  if (made) unpacked_ = *made;
  return made;
}

Result<std::string> RasterFile::target() const {
  if (remote_) return remote_->name();
  return real_file(path_);
}

/// GDAL looks through a whole text grid for a decimal point, and on for ever where it cannot be
/// read.
Result<void> can_be_looked_through(const std::string& path) {
  static constexpr const char* kTextGrid[] = {"AAIGrid", nullptr};
  if (!GDALIdentifyDriverEx(path.c_str(), GDAL_OF_RASTER, kTextGrid, nullptr)) return {};
  const Descriptor file(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK));
  const int code = file.get() < 0 ? errno : read_to_end(file.get());
  if (code == 0) return {};
  return fail(Errc::io, path + ": cannot be read: " + errno_text(code));
}

Result<std::unique_ptr<IdleHandles::Handle>> RasterFile::open_handle() const {
  if (auto there = crs_database(); !there) return std::unexpected(there.error());
  const Complaints complaints;
  const RemoteFailures failures;
  auto real = target();
  if (!real) return std::unexpected(real.error());
  auto handle = std::make_unique<IdleHandles::Handle>();
  std::string target = *real;
  if (is_zip(path_) && !remote_) {
    auto memory = unpacked();
    if (!memory) return std::unexpected(memory.error());
    handle->memory = std::move(*memory);
    target = handle->memory->path;
  }
  if (!remote_ && !handle->memory)
    if (auto ok = can_be_looked_through(target); !ok) return std::unexpected(ok.error());
  const auto opened = [&] {
    return static_cast<GDALDataset*>(
        GDALOpenEx(target.c_str(), GDAL_OF_RASTER | GDAL_OF_READONLY | GDAL_OF_VERBOSE_ERROR,
                   remote_ ? kOnlyGeoTiff : raster_drivers(allow_vrt_, target), nullptr, nullptr));
  };
  handle->set = opened();
  // In GDAL's words a read that failed is a damaged file, or a stranger's. What goes on is found
  // below; what was so for a moment must not be held against a good raster.
  if (!handle->set && !remote_ && !handle->memory) handle->set = opened();
  if (failures.first()) return fail(Errc::io, failures.first()->what);
  if (!handle->set && !allow_vrt_ && lower_case(path_).ends_with(".vrt"))
    return fail(Errc::unsupported, path_ +
                                       ": a VRT can name any other file, so it is read only with "
                                       "--allow-vrt");
  if (!handle->set && !remote_ && !handle->memory)
    if (const auto head = read_beginning(target, 1 << 16); !head)
      return std::unexpected(head.error());
  if (!handle->set)
    return fail(complaints.code(),
                path_ +
                    ": not a raster tind reads (GeoTIFF, SRTM HGT, DTED, USGS "
                    "DEM, Arc/Info ASCII, Erdas .img, BIL, FLT, PNG; others become a GeoTIFF with "
                    "gdal_translate), or damaged: " +
                    complaints.text("no driver recognises it"));
  if (auto ok = check_spilled(*handle->set, target, path_); !ok) return std::unexpected(ok.error());
  return handle;
}

/// Where its posts are.
Result<void> RasterFile::learn_place(IdleHandles::Handle& handle, const DemOptions& options) {
  GDALDataset& set = *handle.set;
  const auto place = pixel_to_crs(set);
  if (!place) return fail(path_, place.error());
  facts_.has_geotransform = place->has_value();
  const bool may_have_world_file =
      !remote_ && !handle.memory && (facts_.driver == "GTiff" || facts_.driver == "PNG");
  if (!facts_.has_geotransform && may_have_world_file)
    if (auto none = no_world_file(path_); !none) return fail(path_, none.error());
  if (!facts_.has_geotransform && !options.crs.empty())
    return fail(Errc::invalid_argument,
                path_ + ": has no geotransform, so a CRS (" + options.crs +
                    ") gives it no place; add a world file, or leave --crs out");
  if (!facts_.has_geotransform && set.GetGCPCount() > 0)
    return fail(Errc::unsupported,
                path_ +
                    ": is placed by ground control points, between which nobody says where its "
                    "posts are; make a grid of it with gdalwarp");
  if (!facts_.has_geotransform) return {};
  facts_.post_to_crs = **place;
  auto own = describe(set.GetSpatialRef());
  if (options.crs.empty()) {
    if (!own) return fail(path_, own.error());
    facts_.crs = std::move(*own);
    return {};
  }
  auto named = crs_named(options.crs);
  if (!named) return fail(path_ + ": --crs", named.error());
  facts_.crs = std::move(*named);
  if (!own || own->kind == CrsKind::none) return {};
  if (!same_crs(own->wkt, facts_.crs.wkt)) facts_.own_crs = own->name;
  if (facts_.crs.vertical.empty() && facts_.crs.datum == VerticalDatum::unknown) {
    facts_.crs.datum = own->datum;
    facts_.crs.vertical = own->vertical;
    facts_.crs.vertical_unit_m = own->vertical_unit_m;
    facts_.crs.downwards = own->downwards;
  }
  return {};
}

Result<void> RasterFile::learn(IdleHandles::Handle& handle, const DemOptions& options) {
  const Complaints complaints;
  GDALDataset& set = *handle.set;
  facts_.path = path_;
  facts_.driver = set.GetDriverName();
  facts_.cols = set.GetRasterXSize();
  facts_.rows = set.GetRasterYSize();
  if (auto ok = learn_place(handle, options); !ok) return ok;
  if (facts_.crs.downwards && !options.scale)
    return fail(Errc::invalid_argument,
                path_ + ": its vertical CRS '" + facts_.crs.vertical +
                    "' counts downwards; say --scale -1 and, with --from-datum, what the heights "
                    "are above then; or --scale 1 where they are heights already");
  // A CRS that was named for the heights names their unit, too, where the file names none.
  const bool names_none = facts_.crs.vertical_unit_m == 0;
  const double named_unit = names_none && options.from_datum.kind() == VerticalDatum::crs
                                ? unit_of(options.from_datum)
                                : facts_.crs.vertical_unit_m;
  auto heights = HeightBand::of(path_, set, named_unit, handle.memory != nullptr, options);
  if (!heights) return std::unexpected(heights.error());
  heights_ = std::move(*heights);
  facts_.z_unit_m = heights_->z_unit_m();
  facts_.exact = heights_->exact();
  facts_.content = heights_->content();
  if (facts_.driver == "AAIGrid") {
    if (facts_.post_to_crs.x_col < 0 || facts_.post_to_crs.y_row > 0)
      return fail(Errc::bad_data, path_ + ": its cellsize is below 0");
    if (auto ok = check_ascii_grid(path_, facts_.cols * facts_.rows,
                                   set.GetRasterBand(1)->GetRasterDataType() == GDT_Int32);
        !ok)
      return fail(path_, ok.error());
  }
  if (facts_.driver == "HFA")
    if (auto ok = check_spill(set); !ok) return ok;
  if (complaints.failed()) return fail(complaints.code(), path_ + ": " + complaints.text(""));
  return {};
}

Result<std::unique_ptr<RasterFile>> RasterFile::open(const std::string& path,
                                                     const DemOptions& options,
                                                     std::shared_ptr<IdleHandles> idle) {
  set_up();
  if (options.allow_vrt) register_vrt();
  std::unique_ptr<RasterFile> file(new RasterFile(path, options, std::move(idle)));
  if (remote::is_remote(path)) {
    auto opened = remote::RemoteFile::open(remote::Objects::of_environment(), path);
    if (!opened) return std::unexpected(opened.error());
    file->remote_ = std::make_unique<const RemoteMount>(std::move(*opened));
  }
  if (auto real = file->target(); !real) return std::unexpected(real.error());
  for (const std::string& beside : may_come_beside(path)) file->states_.expect_none(beside);
  if (!file->remote_) {
    if (auto ok = file->states_.add(path); !ok) return std::unexpected(ok.error());
    if (options.allow_vrt)
      if (auto ok = check_vrt_nesting(path); !ok) return std::unexpected(ok.error());
  }
  auto handle = file->open_handle();
  if (!handle) return std::unexpected(handle.error());
  // Which other files there are is known only now, when they have been looked into already.
  const auto others = file->files_of(**handle);
  if (!others) return std::unexpected(others.error());
  for (const std::string& other : *others)
    if (auto ok = file->states_.add(other); !ok) return std::unexpected(ok.error());
  if (!others->empty()) handle = file->open_handle();
  if (!handle) return std::unexpected(handle.error());
  const RemoteFailures failures;
  auto learnt = file->learn(**handle, options);
  if (failures.first()) learnt = fail(Errc::io, failures.first()->what);
  if (auto ok = file->if_unchanged(std::move(learnt)); !ok) return std::unexpected(ok.error());
  file->idle_->give(file.get(), std::move(*handle));
  return file;
}

void RasterFile::count_customary(std::span<const double> raw) const {
  const auto posts = std::int64_t(raw.size());
  if (looked_at_.fetch_add(posts, std::memory_order_relaxed) + posts > facts_.cols * facts_.rows)
    return;
  for (const double z : raw) {
    if (z > -9999 && z < 32767) continue;
    for (std::size_t k = 0; k < customary_.size(); ++k)
      if (z == kCustomaryNodata[k] && !heights_->is_void(z))
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
  if (remote_ || is_vrt(*(*handle)->set)) return handle;
  const auto others = files_of(**handle);
  if (!others) return std::unexpected(others.error());
  if (others->size() + 1 != states_.entries().size())
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
  const Complaints complaints;
  const RemoteFailures failures;
  const Result<void> done =
      heights_->read_raw(*handle.set, remote_ ? remote_->name() : path_, col, row, cols, rows, out);
  if (failures.first()) return fail(Errc::io, failures.first()->what);
  if (!done && !done.error().what.empty()) return fail(path_, done.error());
  if (!done || complaints.failed())
    return fail(complaints.code(),
                fmt::format("{}: cannot read posts at column {}, row {}: {}", path_, col, row,
                            complaints.text("the file is truncated or damaged")));
  count_customary(out);
  for (double& z : out) z = heights_->height(z);
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

Result<std::vector<std::string>> RasterFile::files_of(IdleHandles::Handle& handle) const {
  if (is_zip(path_) || remote_) return std::vector<std::string>();
  return other_files(*handle.set, path_, allow_vrt_);
}

Result<std::string> RasterFile::fingerprint() const {
  if (!remote_) return HeightFile::fingerprint();
  const remote::ObjectState& version = remote_->file().version();
  return fmt::format("{} {} {}\n", version.size, version.etag, version.modified);
}

Result<std::string> HeightFile::fingerprint() const {
  const Complaints silence;
  std::string text;
  for (const auto& [path, state] : states().entries()) {
    const auto ends = hash_of_ends(path, state.size);
    if (!ends) return std::unexpected(ends.error());
    text += fmt::format("{} {} {} {} {}\n", state.size, state.inode, state.written_ns,
                        state.changed_ns, *ends);
  }
  if (auto same = unchanged(); !same) return std::unexpected(same.error());
  return text;
}

}  // namespace tind::gdal

namespace tind {

bool is_raster(const std::string& path) {
  if (!check_is_file(path)) return false;
  gdal::set_up();
  const gdal::Complaints silence;
  return GDALIdentifyDriverEx(path.c_str(), GDAL_OF_RASTER, gdal::raster_drivers(false, path),
                              nullptr) != nullptr;
}

Result<RasterContent> raster_content(const std::string& path, const DemOptions& options) {
  auto file =
      gdal::RasterFile::open(path, options, std::make_shared<gdal::IdleHandles>(std::size_t(0), 1));
  if (!file) return std::unexpected(file.error());
  return (*file)->facts().content;
}

std::vector<std::string> files_of_vrt(const std::string& path) {
  gdal::register_vrt();
  const gdal::Complaints silence;
  const auto real = gdal::real_file(path);
  if (!real) return {};
  constexpr const char* kOnlyVrt[] = {"VRT", nullptr};
  const std::unique_ptr<GDALDataset> set{static_cast<GDALDataset*>(
      GDALOpenEx(real->c_str(), GDAL_OF_RASTER, kOnlyVrt, nullptr, nullptr))};
  if (!set) return {};
  return gdal::other_files(*set, path, true).value_or(std::vector<std::string>());
}

}  // namespace tind
