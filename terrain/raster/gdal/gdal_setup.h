#pragma once
// Sets up GDAL: which formats it may read, what it must not do, and who gets its messages.
// Used only by the files of this folder.

#include <string>
#include <string_view>

#include "terrain/base/result.h"

namespace tind::gdal {

/// Registers the allowed raster drivers and pins every option that matters, once per process.
/// Thread-safe; every entry to GDAL calls it first.
void set_up();

/// From then on GDAL fetches no URL, and opens no file of another machine, that a file names
/// (gdal_http.cpp). Part of set_up().
void refuse_fetches();

/// Adds the VRT driver. A VRT can name any file, and is opened only where the caller of
/// DemSource::open says so; its sources are limited to the same allow-list.
void register_vrt();

/// Adds the allowed vector drivers: only for programs whose user names the file.
void register_vectors();

/// A CRS by this name is GeoPackage's srs_id -1, lengths, to GDAL, which without a CRS writes 0,
/// degrees.
inline constexpr const char* kLengthsWithoutPlace = "Undefined Cartesian SRS";

/// Null-terminated lists of driver names for GDALOpenEx. `path`: what is to be opened, whose name
/// decides whether it may be raw numbers.
const char* const* raster_drivers(bool with_vrt, std::string_view path);
const char* const* vector_drivers();

/// While it lives, GDAL's messages of this thread come here instead of to stderr.
class Complaints {
 public:
  Complaints();
  ~Complaints();
  Complaints(const Complaints&) = delete;
  Complaints& operator=(const Complaints&) = delete;

  /// GDAL reported at least one failure (warnings do not count), whatever its calls returned.
  bool failed() const { return failed_; }
  /// What it is a failure of: io where the first says that the system failed, else bad_data.
  Errc code() const;
  /// The first failure in one line, or `otherwise` where GDAL had nothing to say.
  std::string text(const std::string& otherwise) const;
  /// The error (io) of a picture that opened and whose pixels then are not there.
  std::unexpected<Error> no_pixels() const;
  /// Called by the handler.
  void add(std::string message);

 private:
  bool failed_ = false;
  std::string first_;
};

}  // namespace tind::gdal
