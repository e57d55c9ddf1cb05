#pragma once
// One raster file: its facts and its heights. It may be malicious, so everything is checked.

#include <array>
#include <atomic>
#include <cstdint>
#include <list>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "terrain/base/result.h"
#include "terrain/raster/dem_source.h"
#include "terrain/raster/file_state.h"
#include "terrain/raster/gdal/heights/height_band.h"
#include "terrain/raster/gdal/heights/height_file.h"
#include "terrain/raster/gdal/heights/vsi_remote.h"
#include "terrain/raster/nodata.h"

namespace tind::gdal {

class RasterFile;

/// Open datasets that nobody reads from just now, of all files of a pool. The longest unused is
/// closed when they are more than `max_open`, or unpacked files among them more than so many bytes.
/// Thread-safe.
class IdleHandles {
 public:
  struct Unpacked;  // a file in memory
  struct Handle;    // a GDAL dataset and the memory it may live in
  IdleHandles(std::size_t max_bytes, std::size_t max_open);
  ~IdleHandles();
  std::unique_ptr<Handle> take(const RasterFile* owner);
  void give(const RasterFile* owner, std::unique_ptr<Handle>);
  /// Closes those of one that goes: another may come to have its address.
  void forget(const RasterFile* owner);

 private:
  struct Entry;
  std::mutex mutex_;
  std::list<Entry> idle_;  // most recently used first
  std::size_t bytes_ = 0;
  const std::size_t max_bytes_, max_open_;
};

class RasterFile final : public HeightFile {
 public:
  /// Opens and judges the file: driver, sizes, bands, CRS. `path` may be "x.hgt.zip" or
  /// "x.tif.zip". From here on everything is read of the content that was opened: where the file,
  /// or one that it refers to, has changed since, reading fails (Errc::io) until it is as it was.
  /// Or a GeoTIFF on another machine, read by ranges (dem_files.h): one file, with nothing beside.
  static Result<std::unique_ptr<RasterFile>> open(const std::string& path, const DemOptions&,
                                                  std::shared_ptr<IdleHandles> idle);
  ~RasterFile() override;

  const FileFacts& facts() const override { return facts_; }
  const FileStates& states() const override { return states_; }

  Result<void> read(int col, int row, int cols, int rows, std::span<double> out) const override;
  std::uint64_t customary(std::size_t k) const override { return customary_[k]; }
  Result<void> read_posts(std::span<const Post>) const override;
  Result<void> unchanged() const override {
    return remote_ ? remote_->file().unchanged() : states_.unchanged();
  }
  Result<std::string> fingerprint() const override;

 private:
  RasterFile(std::string path, const DemOptions&, std::shared_ptr<IdleHandles> idle);
  Result<std::unique_ptr<IdleHandles::Handle>> open_handle() const;
  /// What is in the zip: one copy for all handles, gone with the last of them.
  Result<std::shared_ptr<const IdleHandles::Unpacked>> unpacked() const;
  /// This file and those that it refers to, as the handle knows them.
  Result<std::vector<std::string>> files_of(IdleHandles::Handle&) const;
  /// An idle handle, or a new one.
  Result<std::unique_ptr<IdleHandles::Handle>> borrow() const;
  /// What came of reading, unless the files have changed meanwhile: then that.
  Result<void> if_unchanged(Result<void> done) const;
  /// The path for GDAL, of what is not unpacked.
  Result<std::string> target() const;
  Result<void> learn(IdleHandles::Handle&, const DemOptions&);
  Result<void> learn_place(IdleHandles::Handle&, const DemOptions&);
  Result<void> read_with(IdleHandles::Handle&, int col, int row, int cols, int rows,
                         std::span<double> out) const;
  void count_customary(std::span<const double> raw) const;

  std::string path_;
  bool allow_vrt_;
  std::unique_ptr<const RemoteMount> remote_;  // null: of this machine
  std::shared_ptr<IdleHandles> idle_;
  FileStates states_;
  FileFacts facts_;
  std::optional<HeightBand> heights_;
  mutable std::mutex unpacking_;
  mutable std::weak_ptr<const IdleHandles::Unpacked> unpacked_;
  mutable std::array<std::atomic<std::uint64_t>, std::size(kCustomaryNodata)> customary_{};
  mutable std::atomic<std::int64_t> looked_at_ = 0;
};

}  // namespace tind::gdal
