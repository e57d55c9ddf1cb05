#pragma once
// A DEM on disk: one raster, or several that share a grid, seen as one array of posts in metres.
// The implementation, in raster/gdal/, is the only user of GDAL.

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "terrain/base/enum_names.h"
#include "terrain/base/result.h"
#include "terrain/geo/coordinates.h"
#include "terrain/geo/environment.h"
#include "terrain/geo/vertical_datum.h"
#include "terrain/raster/height_grid.h"

namespace tind {

/// How a raster's bands hold heights: one band of numbers, or three of colours (terrain-RGB).
enum class HeightEncoding { number, mapbox, terrarium };
template <>
struct EnumNames<HeightEncoding> {
  static constexpr const char* kWhat = "encoding";
  static constexpr std::pair<HeightEncoding, const char*> kAll[] = {
      {HeightEncoding::number, "number"},
      {HeightEncoding::mapbox, "mapbox"},
      {HeightEncoding::terrarium, "terrarium"}};
};

/// What the sources of one process may share: files that are open and not read from just now, and
/// decoded heights, each with one bound for all. Thread-safe; sources keep the pool they were
/// opened with.
class SourcePool {
 public:
  struct Limits {
    std::size_t heights_bytes = 64u << 20;    // decoded; at least one block is kept
    std::size_t unpacked_bytes = 256u << 20;  // of files that are unpacked in memory
    std::size_t open_files = 64;
  };
  static std::shared_ptr<SourcePool> make(const Limits&);
  virtual ~SourcePool() = default;
};

struct DemOptions {
  /// What the heights are above. `unknown`: take it from the file's compound CRS if it says so.
  VerticalDatum from_datum = VerticalDatum::unknown;
  /// For heights of unknown datum, anything but `same` and `ellipsoid_if_known` is an error.
  TargetDatum to_datum = TargetDatum::same;
  /// Values, as they stand in the file, that mean no data beside the one that the file declares.
  std::vector<double> nodata = {};
  /// What the file declares to mean no data is a height.
  bool ignore_declared_nodata = false;
  /// The CRS of the coordinates, whatever the file says: as PROJ knows it (EPSG:25832, WKT, a PROJ
  /// string). What the file says of its heights stays, where this says nothing of them. Empty: the
  /// file's.
  std::string crs = {};
  /// Which band has the heights, from 1; with colours the first of the three. 0: the only one.
  int band = 0;
  HeightEncoding encoding = HeightEncoding::number;
  /// Height = number * scale + offset, in the file's unit, in place of what the file says.
  std::optional<double> scale = {}, offset = {};
  /// How good the heights are by their maker's word: repeated beside them, changes none.
  std::optional<VerticalAccuracy> accuracy = {};
  /// VRT files can name any other file: only when the operator says so.
  bool allow_vrt = false;
  /// Heights in the raster's own unit instead of metres (only `tind simplify --units source`).
  bool keep_source_units = false;
  /// Bound of the block cache of one source, bytes.
  std::size_t cache_bytes = 64u << 20;
  /// Bound of the files that are unpacked in memory (x.hgt.zip) while nobody reads from
  /// them, bytes.
  std::size_t unpacked_bytes = 256u << 20;
  /// Shared with others, with its bounds instead of these two; null: a pool of its own.
  std::shared_ptr<SourcePool> pool = nullptr;
  /// Has the geoid; only where egm96 heights are to be brought to the ellipsoid.
  std::shared_ptr<const Environment> environment = nullptr;
};

/// A rectangle of posts, both ends included.
struct PostRect {
  std::int64_t col = 0, row = 0, last_col = 0, last_row = 0;
  friend bool operator==(const PostRect&, const PostRect&) = default;
};

enum class CrsKind { none, geographic, projected };

struct DemInfo {
  std::vector<std::string> files;  // those of folders and lists one by one
  std::string driver;              // of the first file, e.g. "GTiff"
  std::int64_t cols = 0, rows = 0;
  bool has_geotransform = false;
  Affine post_to_crs;  // identity with y = -row where the file has no geotransform
  CrsKind crs_kind = CrsKind::none;
  std::string crs_wkt, crs_name;  // WKT 2 of the horizontal part, full name; empty without a CRS
  double crs_unit_m = 1;          // metres per CRS unit (projected, local); 1 for geographic
  double z_unit_m = 1;            // metres per unit of the raster's heights (after scale/offset)
  VerticalDatum datum = VerticalDatum::unknown;  // of the heights that read() returns
  VerticalDatum source_datum = VerticalDatum::unknown;
  /// What the file says that heights are above where the options say something else, which counts;
  /// empty: they do not.
  std::string overruled_datum;
  std::string vertical_crs;  // as the file names it, "EGM2008 height"; empty where it does not
  std::optional<VerticalAccuracy> accuracy;  // as DemOptions has it
  std::string nodata_said;                   // as nodata_text() has it: what DemOptions name
  /// How heights were converted, "egm96-15.pgm, bilinear"; empty where they were not.
  std::string datum_way;
  /// How exactly PROJ states to know the CRS's places on WGS84, metres; 0: exactly; nothing: not.
  /// And the operation that it takes, by its name.
  std::optional<double> crs_accuracy_m;
  std::string crs_way;
  /// Bounding box of the posts. Longitudes are brought to -180..180; a source that crosses the
  /// antimeridian or goes around the globe gets west = -180, east = 180. Latitudes are clipped to
  /// +-90. Meaningless without a CRS.
  GeoRect bounds;
  /// Where posts can be: the files, and the ways across from one to the next where they touch. They
  /// may overlap. Empty: everywhere.
  std::vector<PostRect> covered;
  /// The bounding boxes of `covered` on the globe; one that crosses the antimeridian becomes two.
  /// Empty: the bounds.
  std::vector<GeoRect> extents;
  bool wraps_longitude = false;  // columns go around the globe: col and col + period are one place
  /// 360 degrees in columns; 0 where not geographic. Whole where the source wraps: a step that is
  /// rounded (0.05 columns around the globe at most) is corrected, in post_to_crs too.
  double period_cols = 0;
  double spacing_x_m = 1, spacing_y_m = 1;  // ground distance of neighbouring posts at the centre
  /// Bound of |stored float - true height|: 0 for integer and float32 metres, else (feet, float64,
  /// scaled or datum-shifted sources) half an ulp below 16384 m, 0.5 mm; greater heights of such a
  /// source are an error.
  double rounding_m = 0;
  /// Identifies the content (sizes, times and headers of all files and these options).
  std::string fingerprint;
  /// Warnings for the user about this DEM, one line each.
  std::vector<std::string> warnings;
};

/// A value that customarily means no data, but is not declared: its posts count as heights.
struct UndeclaredNodata {
  double value = 0;                // as it stands in the file
  std::uint64_t posts = 0;         // among those read
  std::vector<std::size_t> files;  // of DemInfo::files, those that have them
};

class DemSource {
 public:
  /// Opens one raster, or several that share CRS and grid (adjacent or overlapping: the first file
  /// that has a valid post wins). A folder stands for the rasters in it and "@list.txt" for those
  /// that it names (dem_files.h). Errors name the file and say what to do.
  static Result<std::shared_ptr<const DemSource>> open(std::span<const std::string> files,
                                                       const DemOptions& options = {});
  virtual ~DemSource() = default;

  virtual const DemInfo& info() const = 0;

  /// Posts [col, col + cols) x [row, row + rows); those outside the source are voids; columns wrap
  /// where the source does. A read error is an error, never a void. Thread-safe.
  virtual Result<HeightGrid> read(std::int64_t col, std::int64_t row, int cols, int rows) const = 0;

  /// Every `step`-th post: heights of posts (col + i * step, row + j * step). Reads no more memory
  /// than the result and a few blocks.
  virtual Result<HeightGrid> read_decimated(std::int64_t col, std::int64_t row, int cols, int rows,
                                            int step) const = 0;

  /// Geographic <-> post, exact (PROJ), batched, in place; a point that cannot be transformed
  /// becomes NaN. For a wrapping source, columns lie in [0, period). REQUIRES: a CRS. Thread-safe.
  virtual void to_post(std::span<const Geographic> in, std::span<Vec2> out) const = 0;
  virtual void to_geographic(std::span<const Vec2> in, std::span<Geographic> out) const = 0;

  /// Undeclared nodata among the posts read so far, the most frequent value first. When all posts
  /// have been read once, the numbers are exact, and later readings do not add to them.
  virtual std::vector<UndeclaredNodata> undeclared_nodata() const { return {}; }

  /// Errc::io, naming the file and what became of it, unless all files are as they were when the
  /// source was opened. Asks the system once a file. Thread-safe.
  virtual Result<void> unchanged() const { return {}; }

  /// True where post <-> geographic is one affine map without rotation (a WGS84 lon/lat raster).
  virtual bool is_plain_geographic() const = 0;
};

/// What a position query finds.
enum class Coverage { value, void_, outside };
struct HeightAt {
  Coverage coverage = Coverage::outside;
  double height_m = 0;
};

/// The height at a place (H of height_field.h): at a post its height; between posts bilinear over
/// the four around it; with one void among them linear over three, else void. Reads 2 x 2 posts.
Result<HeightAt> height_at(const DemSource&, Geographic);

}  // namespace tind
