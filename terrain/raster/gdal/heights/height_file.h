#pragma once
// One file of heights, whoever reads it.

#include <cstdint>
#include <span>
#include <string>

#include "terrain/base/result.h"
#include "terrain/raster/dem_source.h"
#include "terrain/raster/file_state.h"
#include "terrain/raster/gdal/crs/gdal_crs.h"
#include "terrain/raster/raster_content.h"

namespace tind::gdal {

struct FileFacts {
  std::string path, driver;
  std::int64_t cols = 0, rows = 0;
  bool has_geotransform = false;
  Affine post_to_crs;   // posts are pixel centres
  CrsFacts crs;         // none without a geotransform
  std::string own_crs;  // what the file calls its CRS, where --crs says that it is another
  double z_unit_m = 1;  // metres per unit, as stated by band or vertical CRS
  bool exact = true;    // what read() gives is a float as it is (32-bit integers: up to 2^24)
  RasterContent content;
};

/// From its opening on everything is read of the content that was opened: where the file, or one
/// that it refers to, has changed since, reading fails (Errc::io) until it is as it was.
class HeightFile {
 public:
  HeightFile() = default;
  virtual ~HeightFile() = default;
  HeightFile(const HeightFile&) = delete;
  HeightFile& operator=(const HeightFile&) = delete;

  virtual const FileFacts& facts() const = 0;
  /// This file, first, and those that it refers to.
  virtual const FileStates& states() const = 0;

  /// Heights of a window inside the file, in metres (or the file's unit): `NaN` is a void. Any
  /// failure that GDAL reports is an error, even where it returns data. Thread-safe.
  virtual Result<void> read(int col, int row, int cols, int rows, std::span<double> out) const = 0;

  /// Single posts inside the file, with one handle for all.
  struct Post {
    int col, row;
    double* height;  // where it goes
  };
  virtual Result<void> read_posts(std::span<const Post>) const = 0;

  /// How many of the posts read so far have a value of kCustomaryNodata and pass as heights; no
  /// more posts are looked at than the file has.
  virtual std::uint64_t customary(std::size_t k) const = 0;

  /// As DemSource has it.
  virtual Result<void> unchanged() const { return states().unchanged(); }
  /// Text that changes when the content does: sizes, inodes, times, hashes of first and last 64 KiB
  /// of this file and of those it refers to.
  virtual Result<std::string> fingerprint() const;
};

}  // namespace tind::gdal
