#pragma once
// What is decided before the first bucket is made, for all of them alike: which there are, how
// exact they are, what their heights are above.

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "terrain/base/result.h"
#include "terrain/flightgear/bucket_id.h"
#include "terrain/geo/environment.h"
#include "terrain/raster/datums.h"
#include "terrain/simplify/common/effort.h"
#include "terrain/surface/surface.h"

namespace tind::flightgear {

/// Raised when the bytes of buckets change, so that old ones are not mixed with new ones.
inline constexpr int kEpoch = 3;

struct BucketOptions {
  double max_error_m =
      0;  // of every bucket; 0: 1/32 of the post spacing, as tiles have at their end
  Effort effort = Effort::normal;
};

/// Does it share more than a side with an extent of the surface? Whether it has a valid post, only
/// reading says. Quick.
bool has_bucket(const Surface&, BucketId);

/// A value that is cheap to copy. Thread-safe.
class BucketPlan {
 public:
  /// FlightGear flies over heights above the sea as if they were above the ellipsoid. So buckets
  /// have heights above the sea: those of a surface above the ellipsoid are taken back by EGM96,
  /// all others stay as they are, also where nobody says what they are above. Far from all heights
  /// the ground is 0 m above that: the sea. Fails (unsupported)
  /// without a CRS, (invalid_argument) for a negative error, (not_found) without the geoid.
  static Result<BucketPlan> make(const Surface&, const BucketOptions&, const Environment&);

  const Surface& surface() const { return surface_; }
  Effort effort() const { return options_.effort; }

  /// All that has_bucket(), folder by folder.
  std::vector<BucketId> buckets() const;

  /// No post there may be farther than this from the mesh: as the strictest layer asks that has a
  /// say in the rectangle, which may be a line.
  double budget_m(const GeoRect&) const;
  /// Finest spacing of posts there.
  double spacing_m(const GeoRect&) const;

  /// A bucket is meshed in patches, which are parts of an eighth of a degree, the same for all
  /// buckets: so small that they have not too many posts, and a grid that is fine beside the error.
  int parts_of_eighth() const { return parts_; }

  /// What to take off heights of the surface, metres. One place has one number, from either side of
  /// the antimeridian, too.
  void take_to_sea(std::span<const Geographic>, std::span<double> heights) const;

  /// What heights of buckets are above.
  VerticalDatum datum() const { return sea_ ? VerticalDatum::egm96 : surface_.info().datum; }

  /// What a folder of these buckets may not be mixed with: 32 digits.
  const std::string& digest() const { return digest_; }

 private:
  explicit BucketPlan(const Surface& surface) : surface_(surface) {}
  double budget_of(const SurfaceLayer&) const;

  Surface surface_;
  BucketOptions options_;
  int parts_ = 1;
  std::shared_ptr<const DatumSurface> sea_;  // null: heights are above it already
  std::string digest_;
};

}  // namespace tind::flightgear
