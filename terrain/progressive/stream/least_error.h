#pragma once
// The height of one vertex for which the posts around it are farthest off by the least: a linear
// minimax problem in one unknown. What `bounded` asks as "is there a height within eps", asked as
// "how small can eps be".

#include <vector>

#include "terrain/mesh/tin.h"
#include "terrain/raster/height_grid.h"

namespace tind {

/// max |triangle - post| over the valid posts in the closed triangle; 0 when there are none. The
/// referee's own arithmetic (scan_triangle.h). O(posts).
double triangle_error(const HeightGrid&, const Vec3& a, const Vec3& b, const Vec3& c);

/// The solver: knows neither posts nor triangles.
class LeastHeightError {
 public:
  void clear() { samples_.clear(); }
  /// At this sample the surface is off by weight * z - rest, z being the height that is sought.
  void add(double weight, double rest) { samples_.push_back({weight, rest}); }

  struct Fit {
    double z = 0, error = 0;
  };
  /// The best height, to about 2 % of its error, looking from `guess`.
  Fit best(double guess) const;
  double error_at(double z) const;

 private:
  struct Sample {
    double weight, rest;
  };
  struct Active {
    Sample up, down;  // above which, below which the surface is farthest
    double above, below;
  };
  std::vector<Sample> samples_;

  Active active_at(double z) const;
};

}  // namespace tind
