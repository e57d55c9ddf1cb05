#pragma once
// Several raster files on one grid, as one array of posts.

#include <memory>
#include <span>
#include <string>
#include <vector>

#include "terrain/base/result.h"
#include "terrain/raster/dem_source.h"
#include "terrain/raster/gdal/heights/height_file.h"

namespace tind::gdal {

struct Pool;

class Mosaic {
 public:
  /// The files must share CRS, vertical datum and grid: steps equal to 1e-6, offsets whole posts to
  /// within 0.01. They may lie apart, touch or overlap. Read in processes of their own where the
  /// pool has them.
  static Result<Mosaic> open(std::span<const std::string> paths, const DemOptions&, const Pool&);
  /// Of one file that is open already.
  static Mosaic of(std::unique_ptr<HeightFile>);

  std::int64_t cols() const { return cols_; }
  std::int64_t rows() const { return rows_; }
  const Affine& post_to_crs() const { return post_to_crs_; }
  /// Of the first file.
  const FileFacts& facts() const { return parts_[0].file->facts(); }
  /// Says that column `period` is column 0 again: posts of files that reach beyond it are taken
  /// there, where no other file has a valid one.
  void close_around(std::int64_t period);

  /// Where its files are, as DemInfo has it.
  std::vector<PostRect> covered() const;
  /// What is odd about its files, as DemInfo has it.
  std::vector<std::string> warnings() const;
  /// Every file stores floats as they are.
  bool exact() const;

  /// Heights of a window inside [0, cols) x [0, rows): the first file with a valid post wins, NaN
  /// where none has. Thread-safe.
  Result<void> read(std::int64_t col, std::int64_t row, int cols, int rows,
                    std::span<double> out) const;

  /// The same for the posts (cols[i], rows[j]) of a lattice, out[j * cols.size() + i]; file by
  /// file, so that each is opened once. Columns and rows outside are allowed: NaN.
  Result<void> read_lattice(std::span<const std::int64_t> cols, std::span<const std::int64_t> rows,
                            std::span<double> out) const;

  Result<std::string> fingerprint() const;

  /// As DemSource has them.
  Result<void> unchanged() const;
  std::vector<UndeclaredNodata> undeclared_nodata() const;
  /// Of the first file that has that post; of the first of all where none has.
  const FileFacts& facts_at(std::int64_t col, std::int64_t row) const;

 private:
  struct Part {
    std::unique_ptr<HeightFile> file;
    std::int64_t col = 0, row = 0;  // of its first post
  };
  /// A part where it counts in reading, also a second time.
  struct Place {
    const HeightFile* file;
    std::int64_t col, row;
  };
  Result<void> add(std::unique_ptr<HeightFile>, const DemOptions&);
  void move_origin();
  void place_parts();

  std::vector<Part> parts_;
  std::vector<Place> places_;  // of the parts, in their order; then what closes the globe
  std::int64_t cols_ = 0, rows_ = 0;
  Affine post_to_crs_;
};

}  // namespace tind::gdal
