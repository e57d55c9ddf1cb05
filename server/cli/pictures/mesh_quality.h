#pragma once
// The referee's verdict on a mesh of a DEM, as `tind simplify` and `tind measure` report it.

#include <nlohmann/json_fwd.hpp>
#include <optional>

#include "terrain/base/result.h"
#include "terrain/mesh/between_posts.h"
#include "terrain/mesh/mesh_frame.h"
#include "terrain/mesh/vertical_error.h"
#include "terrain/raster/height_grid.h"
#include "terrain/simplify/simplify_tin.h"

namespace tind::cli {

struct MeshQuality {
  VerticalError error;
  std::optional<SurfaceError> surface;  // of a DEM in memory
  std::size_t triangles = 0, vertices = 0;
  std::size_t flipped = 0;  // in the mesh's own frame, as written
  std::size_t non_manifold = 0;
  std::uint64_t uncovered = 0;  // valid posts that no triangle covers; no error counts them
  /// Those of them that have no cell with three valid corners beside them: no triangle of posts
  /// holds them.
  std::uint64_t isolated = 0;
};

/// Measures `mesh`, in the frame of `map`, against all posts. `float_file`: its coordinates come
/// from 32-bit floats, so a post on the rim may lie outside the mesh by their rounding, and
/// still counts.
MeshQuality mesh_quality(const Tin& mesh, const MeshMap& map, const HeightGrid& posts, int threads,
                         bool float_file = false);

/// Its extremes as they are where posts lie up to `rounding_m` beside the heights that they were
/// measured at (height_rounding).
void widen(MeshQuality&, double rounding_m);

/// The same over the vertices of a TIN, in whose frame `mesh` is; there is no surface_error.
MeshQuality tin_quality(const Tin& mesh, const TerrainTin& of, int threads,
                        bool float_file = false);

/// The same for a source that is read in strips (vertical_error_in_strips).
Result<MeshQuality> mesh_quality_in_strips(const Tin& mesh, const MeshMap& map, int cols, int rows,
                                           const ReadStrip& read, int threads,
                                           bool float_file = false);

/// Valid posts that are in no cell with three valid corners: no triangle of neighbours holds them.
std::uint64_t isolated_posts(const HeightGrid&);

/// The space between the mesh and the DEM over the covered posts, cubic metres, both >= 0. A post
/// stands for a cell of the grid; cells of degrees become narrower with the cosine of
/// their latitude.
struct VolumeBetween {
  double above_m3 = 0, below_m3 = 0;  // where the mesh is above the DEM, and below it
};
VolumeBetween volume_between(const VerticalError&, const DemInfo&);

/// triangles, vertices, max_error_m ... p99_m, max_at, max_surface_error_m (null: not measured) and
/// its _at, bias_m, posts, flipped, posts_uncovered, posts_isolated.
nlohmann::ordered_json quality_json(const MeshQuality&);

/// Of a mesh over all of its DEM: volume_m3, posts_void; crs, epsg, crs_wkt, vertical_datum.
nlohmann::ordered_json ground_json(const MeshQuality&, const DemInfo&, int epsg);

/// Two or three lines for a person.
std::string quality_text(const MeshQuality&);

/// Of tin_quality: as quality_json, but max_at has x, y and z; vertices_measured and
/// vertices_uncovered stand where posts do.
nlohmann::ordered_json tin_quality_json(const MeshQuality&);
std::string tin_quality_text(const MeshQuality&);

}  // namespace tind::cli
