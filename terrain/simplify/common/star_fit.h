#pragma once
// Moving the apex of a star to where its samples are fitted best: one Gauss-Newton step of the sum
// of their squared errors.
//
// One scan of a triangle gives three sums over its samples: of b b, b r and r r, where b is the
// weight that the apex has at the sample and r the sample's height above the triangle. Moving the
// apex by (dx, dy, dz) raises the triangle there by b (dz - gx dx - gy dy), (gx, gy) being its
// slope. So the sums of a star are all that is needed for the Gauss-Newton step of its apex, and
// for the exact optimum of its height.

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <functional>

#include "terrain/mesh/triangle_plane.h"

namespace tind {

/// What the samples of a star say about its apex.
struct StarFit {
  /// As good as a sample of this weight at the apex's present height: keeps an apex that its
  /// samples say little about from flying off.
  static constexpr double kPrior = 0.02;

  double xx = 0, xy = 0, xz = 0, yy = 0, yz = 0, zz = 0;  // the normal matrix
  double x = 0, y = 0, z = 0;                             // and its right-hand side
  double sum = 0;                                         // of squared errors, the apex as it is
  double prior = kPrior;                                  // what zz does not hold of it yet
  double reach = 0;  // the largest |dx| or |dy| from the apex to a vertex of the ring

  /// For the step alone: the prior comes first, not last. (The bytes of tiles rest on this order;
  /// sums of squares would count the prior as a sample.)
  static StarFit for_step() {
    StarFit fit;
    fit.zz = kPrior, fit.prior = 0;
    return fit;
  }

  /// Adds the samples of triangle (w, a, b), w being the apex. REQUIRES: counter-clockwise.
  /// COST: one scan.
  template <class Samples>
  void add(const Samples& samples, const Vec3& w, const Vec3& a, const Vec3& b) {
    const Vec3 p = a - w, q = b - w;
    const double per_area = 1 / (p.x * q.y - p.y * q.x);
    const double lx = (p.y - q.y) * per_area, ly = (q.x - p.x) * per_area;
    const Vec2 slope = slope_times_area({}, p, q);
    const double gx = slope.x * per_area, gy = slope.y * per_area;
    double bb = 0, br = 0, rr = 0;
    samples.scan(w, a, b, [&](double sx, double sy, double sz, std::size_t) {
      const double u = sx - w.x, v = sy - w.y;
      const double weight = 1 + (lx * u + ly * v), r = sz - (w.z + (gx * u + gy * v));
      bb += weight * weight, br += weight * r, rr += r * r;
      return true;
    });
    xx += bb * gx * gx, xy += bb * gx * gy, yy += bb * gy * gy;
    xz -= bb * gx, yz -= bb * gy, zz += bb;
    x -= br * gx, y -= br * gy, z += br;
    sum += rr;
    reach = std::max({reach, std::abs(p.x), std::abs(p.y)});
  }

  /// The best change of the height alone, and the sum of squares after it.
  double rise() const { return z / (zz + prior); }
  double sum_after_rise() const {
    const double up = rise();
    return std::max(0.0, sum - up * (2 * z - zz * up));
  }

  /// Where to move the apex in the plane, its height following; a little damped. {0, 0} where the
  /// samples do not say.
  Vec2 step() const {
    const Planar m = planar();
    const double damp = 1e-2 * (xx + yy) + 1e-9;
    const double a = m.a + damp, d = m.d + damp, det = a * d - m.b * m.b;
    if (!(det > 0)) return {0, 0};
    return {(d * m.p - m.b * m.q) / det, (a * m.q - m.b * m.p) / det};
  }
  /// The same, shortened to half of the way to the ring at most.
  Vec2 step_inside() const {
    const Vec2 s = step();
    const double share = std::min(1.0, reach / 2 / std::max(std::abs(s.x), std::abs(s.y)));
    return {s.x * share, s.y * share};
  }
  /// What the sum would be after step(), were no sample to change triangles.
  double sum_after_step() const {
    const Planar m = planar();
    const Vec2 s = step();
    return std::max(0.0, sum_after_rise() - 2 * (m.p * s.x + m.q * s.y) + m.a * s.x * s.x +
                             2 * m.b * s.x * s.y + m.d * s.y * s.y);
  }

 private:
  struct Planar {
    double a, b, d, p, q;  // [a b; b d] (x y) = (p q), after z is eliminated
  };
  Planar planar() const {
    const double w = 1 / (zz + prior);
    return {xx - xz * xz * w, xy - xz * yz * w, yy - yz * yz * w, x - xz * z * w, y - yz * z * w};
  }
};

/// StarFit::add for samples that the caller need not know.
using FitSamples = std::function<void(StarFit&, const Vec3& w, const Vec3& a, const Vec3& b)>;

/// Of samples that live as long as it does.
template <class Samples>
FitSamples fit_samples(const Samples& samples) {
  return [&samples](StarFit& fit, const Vec3& w, const Vec3& a, const Vec3& b) {
    fit.add(samples, w, a, b);
  };
}

}  // namespace tind
