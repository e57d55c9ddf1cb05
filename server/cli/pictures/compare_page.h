#pragma once
// The page of `tind compare --html`: one file that stands alone, for a report.

#include <optional>
#include <string>
#include <vector>

#include "server/cli/pictures/mesh_quality.h"
#include "server/cli/pictures/png.h"
#include "terrain/mesh/surface_distance.h"
#include "terrain/raster/height_grid.h"
#include "terrain/raster/terrain.h"
#include "terrain/simplify/common/simplified.h"

namespace tind::cli {

/// One method at one stop.
struct CompareRow {
  std::string method, stop;  // as the user wrote them
  Simplified made;           // `tin` in post coordinates
  MeshQuality quality;
  double seconds = 0, cpu_seconds = 0;
  double peak_mb = 0;  // of its process; 0 where the system does not say
  std::uint64_t page_faults = 0;
  std::optional<SurfaceDistance> attributes = {};  // of methods that carry some
  std::string failure = {};                        // why there is no result; empty otherwise
};

/// The mesh seen from above, lit from the north-west, with the DEM's heights as colour; voids and
/// what no triangle covers are paper white. `step`: posts per pixel.
Picture shaded(const Tin& posts_frame, const Terrain& dem, int step);

/// Mesh minus DEM: blue below, red above, white within a twentieth of `scale_m`, full at `scale_m`.
Picture error_picture(const Tin& posts_frame, const HeightGrid&, double scale_m, int step);

/// Curves (error and time against triangles), the table, and pictures of every row.
std::string compare_page(const std::string& title, const std::vector<CompareRow>&,
                         const Terrain& dem);

}  // namespace tind::cli
