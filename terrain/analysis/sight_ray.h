#pragma once
// A ray from an eye to a target over posts, and how far above the ground it stays: what lines of
// sight and viewsheds both ask.
//
// The ray is the straight line in space between two points above the ellipsoid, lifted by
// refraction: light bends towards the earth with k times its curvature, so in the middle of its way
// it is k s (D - s) / 2R above the straight line. Its height above the ellipsoid is a parabola
// within a micrometre over some kilometres, the ground below it one a cell (grid_walk.h), so the
// least clearance of a cell is the vertex of a parabola, not a sample.
//
// What an error e of the posts does. Posts that are within e of the true ones are a surface within
// e of the true one (level_dem.h), so the ground is off by at most e, and the ray, which stands on
// the ground at both ends, by a mean of both ends' errors: together 2 e. Less close to an end: the
// error of a bilinear surface changes by at most 2 e a post along columns and along rows, and at
// the end itself ray and ground are off by the same. So after a share u of the way, d posts from
// the target in columns and rows, the margin is 2 e min(1, 1 - u + d), and likewise from the eye.
// What the way over the posts is off by is nothing at both ends, either: without that no target on
// the ground would ever be surely seen.
// Where the true surface is not bilinear among these posts, but within f of it everywhere (a TIN
// that was taken to posts, mesh/tin_posts.h), nothing is less close to an end: the margin is 2 f.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <span>
#include <utility>
#include <vector>

#include "terrain/analysis/grid_walk.h"
#include "terrain/analysis/post_way.h"
#include "terrain/base/result.h"
#include "terrain/geo/ellipsoid.h"

namespace tind {

struct SightRules {
  double refraction = 0.13;       // k; 0: none. Optical, over land, by day
  double uncertainty_m = 0;       // e, of the posts
  double anywhere_m = 0;          // f, of the surface at any place
  double tolerance_posts = 1e-4;  // by which the ray's way over the posts may be off

  double all_m() const { return uncertainty_m + anywhere_m; }
};

/// A ray that comes no nearer to the ground than this passes: what is rounding.
inline constexpr double kTouch_m = 1e-5;
/// No eye on earth sees farther.
inline constexpr double kLongestSight_m = 2e6;

class SightRay {
 public:
  /// Heights above the ellipsoid.
  SightRay(Geographic eye, double eye_m, Geographic target, double target_m, double refraction)
      : from_(wgs84::to_ecef(eye, eye_m)), way_(wgs84::to_ecef(target, target_m) - from_) {
    const Vec2 degree = wgs84::metres_per_degree((eye.lat + target.lat) / 2);
    const double radians = 3.14159265358979323846 / 180;
    const double lat = (eye.lat + target.lat) / 2 * radians;
    // Euler's radius of the globe's curvature, the mean of all directions.
    const double across = degree.x / (radians * std::max(std::cos(lat), 1e-9));
    radius_m_ = std::sqrt(across * degree.y / radians);
    lift_ = refraction * dot(way_, way_) / (2 * radius_m_);
  }
  double length_m() const { return length(way_); }
  double radius_m() const { return radius_m_; }
  Geographic place(double share) const { return wgs84::from_ecef(from_ + way_ * share).p; }
  /// Above the ellipsoid, over place(share).
  double height_m(double share) const {
    return wgs84::from_ecef(from_ + way_ * share).height_m + lift_ * share * (1 - share);
  }

 private:
  Vec3 from_, way_;
  double radius_m_ = 0, lift_ = 0;
};

/// How the ray passes over the ground.
struct Clearance {
  double least_m = std::numeric_limits<double>::infinity();  // of the ray above the ground
  double share = 0;                                          // of the way, where that is
  double ground_m = 0;                                       // there
  double first_hidden = -1;                                  // share; -1: nowhere below the ground
  /// The least by which the ray is above the ground whatever the errors are, and the least by which
  /// it may be.
  double surely_m = std::numeric_limits<double>::infinity();
  double perhaps_m = std::numeric_limits<double>::infinity();
  bool unknown = false;  // there are voids below the ray, or the DEM ends
};

namespace sight {

/// One straight piece of the way: the ray as a parabola in its t, and what its ends are.
struct Part {
  WayPiece way;
  Parabola ray;
  bool first = false, last = false;

  double share(double t) const { return way.from_share + t * (way.to_share - way.from_share); }
  double span() const { return std::abs(way.to.x - way.from.x) + std::abs(way.to.y - way.from.y); }
};

/// A margin that is a share of `full`: min(1, line), with the line in t.
struct Ramp {
  double full = 0;
  Parabola line;

  /// Where the line is 1, within [from, to].
  double turn(double from, double to) const {
    return line.b == 0 ? from : std::clamp((1 - line.a) / line.b, from, to);
  }
};
using Ramps = std::array<Ramp, 2>;

/// Close to the eye, and to the target. The second ramp is of what moves the way: a piece is exact
/// at its ends and a parabola is off it by up to `shift`, so at t by 4 t (1 - t) of that.
inline Ramps near_eye(const Part& part, double twice_e, double shift) {
  const double share = part.way.to_share - part.way.from_share;
  return {{{twice_e, {part.way.from_share, share + part.span(), 0}}, {shift, {0, 4, 0}}}};
}
inline Ramps near_target(const Part& part, double twice_e, double shift) {
  const double share = part.way.to_share - part.way.from_share;
  return {{{twice_e, {1 - part.way.from_share + part.span(), -share - part.span(), 0}},
           {shift, {4, -4, 0}}}};
}

/// The least of clearance less (plus, with `sign` -1: more) margin.
inline double least_with(const Parabola& c, const Ramps& margin, double from, double to,
                         double sign) {
  double ends[] = {from, margin[0].turn(from, to), margin[1].turn(from, to), to};
  if (ends[1] > ends[2]) std::swap(ends[1], ends[2]);
  double least = std::numeric_limits<double>::infinity();
  for (int k = 0; k < 3; ++k) {
    Parabola d = c;
    for (const Ramp& ramp : margin) {
      const bool close = ramp.line.at((ends[k] + ends[k + 1]) / 2) < 1;
      d.a -= sign * ramp.full * (close ? ramp.line.a : 1);
      d.b -= sign * ramp.full * (close ? ramp.line.b : 0);
    }
    least = std::min(least, d.at(d.lowest_in(ends[k], ends[k + 1])));
  }
  return least;
}

inline void take(const Part& part, const WalkPiece& piece, const SightRules& rules,
                 double shift_posts, Clearance& out) {
  const Parabola c = part.ray - piece.height;
  const double t = c.lowest_in(piece.from, piece.to), least = c.at(t);
  if (least < out.least_m)
    out.least_m = least, out.share = part.share(t), out.ground_m = piece.height.at(t);
  if (least < -kTouch_m && out.first_hidden < 0)
    out.first_hidden = part.share(c.first_below_in(piece.from, t));
  if (rules.all_m() == 0) return;
  const double twice_e = 2 * rules.uncertainty_m, twice_f = 2 * rules.anywhere_m;
  const double shift = shift_posts * (piece.steepest + 3 * rules.uncertainty_m);
  double surely = least - twice_e - shift, perhaps = least + twice_e + shift;
  const auto nearer = [&](const Ramps& margin) {
    surely = std::max(surely, least_with(c, margin, piece.from, piece.to, 1));
    perhaps = std::min(perhaps, least_with(c, margin, piece.from, piece.to, -1));
  };
  if (part.first) nearer(near_eye(part, twice_e, shift));
  if (part.last) nearer(near_target(part, twice_e, shift));
  out.surely_m = std::min(out.surely_m, surely - twice_f);
  out.perhaps_m = std::min(out.perhaps_m, perhaps + twice_f);
}

}  // namespace sight

/// `post(col, row)` as walk_grid() has it. `only_verdict`: stops at the first place that is surely
/// below the ground. Fails as straight_pieces() does. O(cells on the way).
template <class Post>
Result<Clearance> clearance_along(const DemSource& dem, const SightRay& ray,
                                  const SightRules& rules, Post&& post, bool only_verdict = false) {
  constexpr double kPiece_m = 5000;
  const Curve curve = [&ray](std::span<const double> shares, std::span<Geographic> places) {
    for (std::size_t i = 0; i < shares.size(); ++i) places[i] = ray.place(shares[i]);
  };
  const auto pieces =
      straight_pieces(dem, curve, rules.tolerance_posts,
                      std::size_t(std::max(1.0, std::ceil(ray.length_m() / kPiece_m))));
  if (!pieces) return std::unexpected(pieces.error());
  const DemInfo& info = dem.info();
  // Eye and target that stand e higher move the places below the ray along it.
  const double moved_m = rules.all_m() * ray.length_m() / (2 * ray.radius_m());
  const double shift =
      rules.tolerance_posts + moved_m / std::min(info.spacing_x_m, info.spacing_y_m);
  Clearance out;
  double reached = 0, height = ray.height_m(0);
  for (const WayPiece& way : *pieces) {
    sight::Part part{way, {}, way.from_share == 0, way.to_share == 1};
    if (way.from_share != reached) height = ray.height_m(way.from_share);
    const double end = ray.height_m(way.to_share);
    part.ray = parabola_through(height, ray.height_m(part.share(0.5)), end);
    reached = way.to_share, height = end;
    const bool on = walk_grid(way.from, way.to, post, [&](const WalkPiece& piece) {
      if (piece.is_void)
        out.unknown = true;
      else
        sight::take(part, piece, rules, shift, out);
      const double worst = rules.all_m() > 0 ? out.perhaps_m : out.least_m;
      return !(only_verdict && worst < -kTouch_m);
    });
    if (!on) break;
  }
  return out;
}

enum class Visibility { hidden, visible, depends };

/// What follows, of surfaces that are within the rules' all_m(). Over what is unknown nothing is
/// certain but that a ray is hidden elsewhere.
inline Visibility visibility_of(const Clearance& c, double uncertainty_m) {
  const double surely = uncertainty_m > 0 ? c.surely_m : c.least_m;
  const double perhaps = uncertainty_m > 0 ? c.perhaps_m : c.least_m;
  if (perhaps < -kTouch_m) return Visibility::hidden;
  return surely >= -kTouch_m && !c.unknown ? Visibility::visible : Visibility::depends;
}

}  // namespace tind
