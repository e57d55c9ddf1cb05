#pragma once
// Where a square of metres lies over a DEM, for engines: which sizes they take, and which place,
// spacing and size fit.

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>

#include "terrain/base/enum_names.h"
#include "terrain/base/result.h"
#include "terrain/geo/coordinates.h"
#include "terrain/heightmaps/height_lattice.h"
#include "terrain/raster/crs_points.h"
#include "terrain/surface/surface.h"

namespace tind {

enum class Engine { unreal, unity };

/// Posts along one side that the engine can import. Unreal: components of 7, 15, 31, 63, 127 or 255
/// quads, or of twice that, at most 32 of them a side. Unity: 2^n + 1, 33 to 4097.
bool engine_takes(Engine, int size);
/// Those that its makers recommend, in words: for who asked for another.
std::string engine_sizes(Engine);

/// Whether the map covers all of an area, or lies inside it.
enum class MapFit { cover, inside };
template <>
struct EnumNames<MapFit> {
  static constexpr const char* kWhat = "fit";
  static constexpr std::pair<MapFit, const char*> kAll[] = {{MapFit::cover, "cover"},
                                                            {MapFit::inside, "inside"}};
};

struct MapOptions {
  Engine engine = Engine::unreal;
  int cols = 0, rows = 0;  // 0: the size that fits best; both or none
  std::optional<double> spacing_m =
      {};  // none: by the size; without a size the finest of the surface
  /// None: all of the surface. Across the antimeridian east is beyond 180.
  std::optional<GeoRect> area = {};
  std::string crs = {};  // EPSG:n; empty: metres around the area's middle
  MapFit fit = MapFit::cover;
};

struct MapPlace {
  std::shared_ptr<const CrsPoints> crs;
  int cols = 0, rows = 0;
  double spacing_m = 1;  // of posts, in metres of the crs
  Vec2 middle;           // east and north, metres of the crs
  /// The most that a length in metres of the crs differs from the ground's, as a share.
  double scale_error = 0;

  /// East and north of a post, metres of the crs.
  Vec2 post(double col, double row) const {
    return {middle.x + (col - (cols - 1) / 2.) * spacing_m,
            middle.y - (row - (rows - 1) / 2.) * spacing_m};
  }
  Geographic place(double col, double row) const;
  void places(double row, double first_col, std::span<Geographic>) const;
  RasterLattice lattice() const;
};

/// The area is a rectangle of the globe, or the outline of a lone DEM's posts; the map lies around
/// its middle. With a size but no spacing, or with neither, the map's longer way is the area's
/// (inside: the shorter). invalid_argument: a size that the engine does not
/// take, a crs that has no metres, nothing inside.
Result<MapPlace> place_map(const Surface&, const MapOptions&);

}  // namespace tind
