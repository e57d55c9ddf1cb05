#pragma once
// Triangles as polygons for GIS: GeoPackage and FlatGeobuf, written by GDAL (raster/gdal/).

#include <array>
#include <cstdint>
#include <span>
#include <string>

#include "terrain/base/result.h"

namespace tind {

enum class VectorFormat { geopackage, flatgeobuf };

struct TriangleFeatures {
  std::span<const std::array<double, 3>> positions;
  std::span<const std::array<std::uint32_t, 3>> triangles;
  std::string crs_wkt;      // of x and y, longitude or easting first; empty: lengths
  std::string description;  // of the layer, where the format has room
};

/// The bytes of a file with one layer "mesh": each triangle is a PolygonZ, in its own order;
/// FlatGeobuf orders them along a curve for its index. The same triangles are the same bytes. Takes
/// about 300 bytes of memory a triangle. Fails (io) with what GDAL says.
Result<std::string> encode_triangles(VectorFormat, const TriangleFeatures&);

}  // namespace tind
