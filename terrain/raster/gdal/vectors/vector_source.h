#pragma once
// Lines and polygons from any vector file, in the post coordinates of a DEM.

#include <cstddef>
#include <cstdint>
#include <string>
#include <variant>
#include <vector>

#include "terrain/base/result.h"
#include "terrain/raster/dem_source.h"
#include "terrain/raster/file_state.h"
#include "terrain/raster/gdal/vectors/line_datum.h"

namespace tind {

/// x = col, y = -row. z: metres, or NaN where the file has no heights. A point that cannot be
/// reprojected has NaN for x and y.
using VectorLine = std::vector<Vec3>;

/// Rings as the file has them, closed or not; a place is inside when it is in an odd number.
struct VectorPolygon {
  std::vector<VectorLine> rings;
  std::size_t feature = 0;  // whose it is: of all layers, from 0 in the file's order
};

/// The heights that a polygon's corners have, in the rings' order; of a ring that says its first
/// corner again at its end, that one once.
std::vector<double> own_heights(const VectorPolygon& polygon);

struct VectorShapes {
  std::vector<VectorLine> lines;
  std::vector<VectorPolygon> polygons;
  std::size_t features = 0;
  std::size_t points = 0;           // point geometries, which are left out
  std::vector<StatedDatum> stated;  // each once, of layers that have heights
  FileStates files;                 // what it was read from, as that was
};

/// Reads all layers of `path`: ESRI Shapefile, GeoJSON (and its sequences, and TopoJSON),
/// GeoPackage, SQLite, FlatGeobuf, KML, GML, GPX, DXF, MapInfo, CSV with WKT. Multi-geometries and
/// collections are taken apart, curves become chains of segments. Vertices are reprojected to the
/// DEM's CRS; between them lines are straight there. A file or a DEM without CRS: coordinates are
/// taken to be the DEM's. On a DEM in degrees, lines and rings come wherever their longitudes do,
/// in any turn around the globe (-109 in a DEM from 0 to 360), and a step of more than 180 and less
/// than 360 degrees is taken for the shorter way around. Heights are in the vertical unit of the
/// file's CRS, metres if it has none, and are not converted between datums: whether they need be
/// says compare_datums(). Fails (not_found) for no file, (bad_data) for one that is unreadable, has
/// neither line nor polygon, or has nothing within the DEM's rectangle, (io) for one that the disk
/// does not give, or that is written to meanwhile.
Result<VectorShapes> read_vectors(const std::string& path, const DemSource& dem);

/// What a file says of its features beside their places. A value for each name, or none.
struct VectorAttributes {
  using Value = std::variant<std::monostate, bool, std::int64_t, double, std::string>;
  std::vector<std::string> names;              // of all layers, each once
  std::vector<std::vector<Value>> of_feature;  // as VectorPolygon::feature counts them
};

/// Of all features of a file that read_vectors() takes; what is no number and no truth is text.
/// Fails (not_found, bad_data, io).
Result<VectorAttributes> read_attributes(const std::string& path);

/// As read_vectors(), in longitudes and latitudes (x = lon, y = lat, degrees), wherever on the
/// globe. Between vertices lines are straight in longitude and latitude; those of another CRS get
/// vertices between theirs, so that they stay within a centimetre or so of where they are straight.
/// A line's longitudes go on beyond +-180 where it crosses the antimeridian: a step of more than
/// 180 and less than 360 degrees is taken for the shorter way around. A file without CRS has the
/// one of `dem`.
Result<VectorShapes> read_vectors_on_globe(const std::string& path, const DemInfo& dem);

/// One layer of a vector file, in its own coordinates.
struct VectorLayerFacts {
  std::string name, crs;  // crs: empty for none
  std::size_t features = 0, lines = 0, polygons = 0, points = 0;
  std::size_t vertices = 0, with_height = 0;        // of lines and polygons
  double west = 0, south = 0, east = 0, north = 0;  // of these; all 0 without any
  double lowest = 0, highest = 0;                   // of those with a height
};

struct VectorFacts {
  std::string driver;
  std::vector<VectorLayerFacts> layers;
};

/// What a file that read_vectors() takes has in it, read whole. Fails (not_found, bad_data, io).
Result<VectorFacts> vector_facts(const std::string& path);

}  // namespace tind
