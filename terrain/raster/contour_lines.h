#pragma once
// Lines of equal height, and areas in which a height may be, as vector files; written, and the
// lines found, by GDAL (raster/gdal/).

#include <span>
#include <string>
#include <vector>

#include "terrain/base/progress.h"
#include "terrain/base/result.h"
#include "terrain/raster/dem_source.h"
#include "terrain/raster/height_grid.h"

namespace tind {

enum class ContourFormat { geopackage, flatgeobuf, geojson };

/// By the extension, .gpkg, .fgb, .geojson or .json, any case. Fails (invalid_argument) with what
/// there is.
Result<ContourFormat> contour_format(const std::string& path);

struct ContourOptions {
  double interval_m = 0;            // 0: only `levels`
  double base_m = 0;                // one of the heights that are multiples of the interval away
  std::vector<double> levels = {};  // metres; then without the interval
};

/// Those of them that lie between two heights, in ascending order. Fails (invalid_argument) where
/// an interval makes more than 10,000.
Result<std::vector<double>> contour_heights(const ContourOptions&, double low_m, double high_m);

struct ContourFile {
  std::string bytes;
  std::size_t lines = 0;  // or areas
};

/// One layer "contours" of LineStringZ with a field `height_m`, in the DEM's CRS (GeoJSON: in
/// longitude and latitude, RFC 7946; MultiLineStringZ where the antimeridian cuts one; beside a
/// pole with more corners, so that sides stay within a hundredth of a post). A line is where the
/// linear interpolation along rows and columns, and GDAL's between them, has the height: within
/// cells with a void there is none, and in GeoJSON beyond the globe. The same posts are the same
/// bytes. `posts` are all of the DEM. Fails (invalid_argument) for a range of heights that makes
/// more than 10,000 levels, and GeoJSON of a DEM without CRS, (cancelled).
Result<ContourFile> encode_contours(ContourFormat, const DemInfo&, const HeightGrid& posts,
                                    const ContourOptions&, const Progress& = {});

/// An area that has no holes but its own. Rings are in post coordinates, x = column, y = row, not
/// closed; the first is the one around it.
struct ContourArea {
  double height_m = 0;
  std::vector<std::vector<Vec2>> rings;
};

/// One layer "bands" of Polygon with the fields `height_m` and `error_m`, in the DEM's CRS; in
/// GeoJSON in longitude and latitude with 9 decimals, sides that are straight in another CRS with
/// as many corners as it takes to stay within a millimetre at 45 degrees, and a centimetre at the
/// poles. There the antimeridian cuts areas, into MultiPolygons; one around a pole has the pole's
/// edge of the map as a side; what is narrower than a millimetre beside a cut is left out. The same
/// areas are the same bytes. Fails (invalid_argument) for GeoJSON of a DEM without CRS, (bad_data)
/// of one beyond the globe, and where an area is around both poles or cannot be cut.
Result<ContourFile> encode_contour_areas(ContourFormat, const DemInfo&,
                                         std::span<const ContourArea>, double error_m);

}  // namespace tind
