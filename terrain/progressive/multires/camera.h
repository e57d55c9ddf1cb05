#pragma once
// What a camera makes of a triangle and its error: outside the picture, good enough, or not.
//
// The projection is the flat one of every renderer. A post p and the mesh's point q drawn for it
// differ by a vector d: the vertical error along the ellipsoid's normal, and what a flat triangle
// sags below the ellipsoid (at most 0.2 L^2 / (R cos lat) for a longest edge L). In the picture
// that is f / q_z * |d_xy - t d_z| pixels, t = p_xy / p_z: the bound is taken over the picture's
// part of the triangle's box. Seen from above an error hardly shows; at a silhouette it shows in
// full: both come out of this formula.

#include <array>

#include "terrain/geo/coordinates.h"

namespace tind {

struct Camera {
  Geographic position;
  double height_m = 0;                                  // above what the mesh's heights are above
  double heading_deg = 0, pitch_deg = 0, roll_deg = 0;  // from north by east, up, right wing down
  double fov_deg = 60;                                  // across the picture's width
  int width_px = 1920, height_px = 1080;
  double tolerance_px = 1;
  /// A finer tolerance where the terrain may turn its edge to the viewer: where a ray comes in
  /// flatter than the steepest slope under a triangle. 0: none.
  double silhouette_px = 0;
};

/// East, north, up in metres from a point of the ellipsoid.
struct LocalFrame {
  Vec3 origin, east, north, up;
  double lat_deg = 0;
  static LocalFrame at(Geographic);
  Vec3 from_ecef(const Vec3& p) const {
    const Vec3 d = p - origin;
    return {dot(d, east), dot(d, north), dot(d, up)};
  }
};

class View {
 public:
  /// `extent_m`: no vertex is farther than this from the frame's origin.
  View(const Camera&, const LocalFrame&, double extent_m);

  struct Verdict {
    bool too_coarse;  // some post in the picture might be off by more than the tolerance
    /// If not: the camera may move so far (metres; a turn by an angle counts as that times the
    /// distance of the farthest point) before it can be. If it is: a guess of the same.
    double slack_m;
  };
  /// Corners in the local frame, metres.
  Verdict judge(const std::array<float, 3>& a, const std::array<float, 3>& b,
                const std::array<float, 3>& c, double error_m, int steepest_deg) const;

  /// How far this view is from another, in the metres of `slack_m`.
  double motion_from(const View& other) const;
  /// Slack is about motion only: not when lens or tolerance change.
  bool same_lens(const View& other) const;

 private:
  Vec3 eye_, right_, down_, ahead_;
  Vec3 sides_[4];  // inward unit normals
  double focal_px_, tan_x_, tan_y_, tolerance_, silhouette_;
  double extent_m_, sag_per_m2_, up_margin_;
};

}  // namespace tind
