#pragma once
// A dataset's lines and water, ready to be asked: which places are level, which do not count, which
// lines tiles have as edges, where water is. Made once, from the files and the posts in their
// polygons; nothing in it depends on tiles or threads.

#include <cstddef>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "terrain/base/result.h"
#include "terrain/geo/coordinates.h"
#include "terrain/raster/dem_source.h"
#include "terrain/raster/file_state.h"
#include "terrain/shapes/area_set.h"
#include "terrain/shapes/shape_files.h"
#include "terrain/shapes/shape_lines.h"
#include "terrain/shapes/shape_network.h"
#include "terrain/shapes/water_mask.h"

namespace tind {

/// To be raised with every change of the bytes that tiles with lines or water have, where those of
/// others stay (kTileEpoch of pyramid/plan/tile_version.h is for all): part of the digest, so that
/// a folder never mixes two of them. A test holds it against the bytes (ShapeEpoch).
inline constexpr int kShapeEpoch = 6;

/// What became of the files, for people.
struct ShapesReport {
  std::size_t breaklines = 0, flattened = 0, boundaries = 0, waters = 0;  // shapes given
  std::size_t chains = 0, points = 0;  // of the lines that tiles may have
  std::size_t not_finite = 0;          // points left out
  std::size_t without_level = 0;       // polygons in which nothing says how high they are: 0 m
  LineRepairs repairs;
  std::vector<std::string> warnings;  // one line each
};

class SurfaceShapes {
 public:
  /// `layers`: the DEMs, the lowest first. A polygon's level is the median of its own heights if it
  /// has any, else of the posts in it (those of the uppermost DEM that has some; of more than 16
  /// million every second, fourth, ...), else of that DEM along its outline; polygons that touch or
  /// lie in one another share the lowest of theirs. Levels are heights as the DEMs have them, above
  /// whatever those are above. Fails where a file cannot be read or has no polygon where some are
  /// needed, (invalid_argument) where it says that its heights, which count, are above something
  /// else, (unsupported) without CGAL, where posts cannot be read.
  static Result<std::shared_ptr<const SurfaceShapes>> make(
      std::span<const std::shared_ptr<const DemSource>> layers, const ShapeFiles&);

  const ShapeFiles& files() const { return files_; }
  const ShapesReport& report() const { return report_; }
  /// 32 digits each: for the shapes as the files have them, and for their levels.
  const std::string& digest() const { return digest_; }
  const std::string& level_digest() const { return level_digest_; }

  /// The level of the polygon that holds a place.
  std::optional<double> level_at(Geographic) const;
  /// Stretches of a parallel that are level, as AreaSet::spans() has them; the level of each.
  const AreaSet& level_areas() const { return level_areas_; }
  double level_of(std::uint32_t polygon) const { return levels_[polygon]; }

  /// The areas whose posts count; empty: all do.
  const AreaSet& boundary() const { return boundary_; }
  bool outside(Geographic) const;

  const ShapeLines& lines() const { return lines_; }
  const WaterSource& water() const { return water_; }

  /// Errc::io, naming the file, unless all of files() are as they were read. (Only rasters of water
  /// are read later; what was read of lines and polygons stays what it was.)
  Result<void> unchanged() const;

 private:
  friend class ShapesBuilder;
  SurfaceShapes() = default;

  ShapeFiles files_;
  ShapesReport report_;
  std::string digest_, level_digest_;
  AreaSet level_areas_, boundary_;
  std::vector<double> levels_;  // of level_areas_' polygons
  ShapeLines lines_;
  WaterSource water_;
  std::vector<FileStates> states_;
};

}  // namespace tind
