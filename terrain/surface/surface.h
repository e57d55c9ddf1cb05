#pragma once
// What tiles are made of: one DEM, or layers of them, each where those above have no height. A
// tile, its borders and whoever checks them ask the surface; only here is it known how many DEMs
// there are.

#include <algorithm>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "terrain/base/result.h"
#include "terrain/raster/dem_source.h"
#include "terrain/shapes/shaped_dem.h"

namespace tind {

struct SurfaceLayer {
  std::string name;
  std::shared_ptr<const DemSource> source;
  /// How far beyond its valid posts, metres, the layer bends what lies below so that no step shows;
  /// 0: not at all; negative: as Surface::of_layers says.
  double blend_m = -1;
  /// Of the tiles at the end of its pyramid; 0: as the options of the tiles say.
  double max_error_m = 0;
  /// Ground distance of neighbouring posts along columns' x and rows' y, metres, as tiles go by it;
  /// a Surface sets it. Of a lone DEM of one file what it is; else rounded to steps of 19 %, so
  /// that a file more, which moves the middle of the grid, does not change every tile by a hair.
  Vec2 spacing_m = {};

  double finest_m() const { return std::min(spacing_m.x, spacing_m.y); }
  double coarsest_m() const { return std::max(spacing_m.x, spacing_m.y); }
};

/// A value that is cheap to copy; copies share their layers. Thread-safe.
class Surface {
 public:
  /// Of one DEM.
  template <std::derived_from<DemSource> Source>
  Surface(std::shared_ptr<Source> source)  // NOLINT: a DEM is a surface
      : Surface(std::shared_ptr<const DemSource>(std::move(source)), 0) {}
  template <std::derived_from<DemSource> Source>
  Surface(std::shared_ptr<const Source> source)  // NOLINT
      : Surface(std::shared_ptr<const DemSource>(std::move(source)), 0) {}
  /// The same of a DEM that somebody else holds, as long as that does.
  Surface(const DemSource& source)  // NOLINT
      : Surface(std::shared_ptr<const DemSource>(std::shared_ptr<void>(), &source), 0) {}

  /// The lowest first. One layer is its DEM. Blends become lengths: where they are negative, two
  /// spacings of the coarsest layer that lies below; at most VoidFill::kReach posts of the layer's
  /// own. Fails (unsupported) for a layer without CRS, (invalid_argument) where two are known to be
  /// above different datums, and names them; a datum that is not known beside one that is: a
  /// warning of info().
  static Result<Surface> of_layers(std::vector<SurfaceLayer>);

  /// The lowest first.
  std::span<const SurfaceLayer> layers() const { return parts_->layers; }
  /// The DEM of a surface that has only one; else null.
  const DemSource* only() const {
    return parts_->layers.size() == 1 ? parts_->layers[0].source.get() : nullptr;
  }

  /// The lines and the water that go with it, the same for all layers; null: none.
  const SurfaceShapes* shapes() const { return shapes_of(*layers().front().source); }

  /// What is known of it as a whole: of one DEM, what that says of itself. Of several: files,
  /// bounds, extents and warnings of all, spacing of the finest, the largest rounding, a
  /// fingerprint of all; no grid (0 columns and rows).
  const DemInfo& info() const { return parts_->info ? *parts_->info : only()->info(); }
  /// Of all layers.
  std::int64_t post_count() const;
  /// As DemSource::unchanged(), of all layers.
  Result<void> unchanged() const;
  /// Are all of its posts plain longitudes and latitudes?
  bool is_plain_geographic() const;

  /// Where layer k is a reason for tiles: over its files, and over what it bends of those below
  /// (there the surface is as fine as the layer).
  std::span<const GeoRect> area(std::size_t k) const;

  /// Could layer k have a say in a rectangle? Of the upper ones that is what they may bend, too.
  bool reaches(std::size_t k, const GeoRect&) const;

 private:
  struct Parts {
    std::vector<SurfaceLayer> layers;
    std::optional<DemInfo> info;                // of several
    std::vector<std::vector<GeoRect>> reaches;  // of several: by layer, extents and what is near
    std::vector<std::vector<GeoRect>> areas;    // of several
  };
  Surface(std::shared_ptr<const DemSource> source, int);
  explicit Surface(std::shared_ptr<const Parts> parts) : parts_(std::move(parts)) {}

  std::shared_ptr<const Parts> parts_;
};

/// Ground distance of neighbouring posts, metres, one number for both directions, as plans take it
/// of a layer among others: in steps of 19 %, as SurfaceLayer::spacing_m.
double rank_spacing_m(const DemInfo&);

}  // namespace tind
