#pragma once
// The height between posts: everything in tind interpolates by this one rule.

#include <cmath>
#include <limits>

namespace tind {

/// Bilinear over the four posts around a place: z00 (col, row), z10 (col + 1, row), z01 (col,
/// row + 1), z11; fx, fy in [0, 1] from the first. Posts of zero weight do not matter, so a post
/// has its own height and an edge that of its two ends. With one void among posts that matter:
/// linear inside the triangle of the other three, void outside it. Void: NaN.
inline double height_between(double z00, double z10, double z01, double z11, double fx, double fy) {
  if (fx == 0) z10 = z00, z11 = z01;
  if (fx == 1) z00 = z10, z01 = z11;
  if (fy == 0) z01 = z00, z11 = z10;
  if (fy == 1) z00 = z01, z10 = z11;
  const double north = z00 + (z10 - z00) * fx, south = z01 + (z11 - z01) * fx;
  const double z = north + (south - north) * fy;
  if (!std::isnan(z)) return z;
  // At most one of these is a number with exactly one void; with more, all are NaN.
  if (fx + fy >= 1 && std::isnan(z00)) return z11 + (z01 - z11) * (1 - fx) + (z10 - z11) * (1 - fy);
  if (fx + fy <= 1 && std::isnan(z11)) return z00 + (z10 - z00) * fx + (z01 - z00) * fy;
  if (fx <= fy && std::isnan(z10)) return z01 + (z11 - z01) * fx + (z00 - z01) * (1 - fy);
  if (fx >= fy && std::isnan(z01)) return z10 + (z00 - z10) * (1 - fx) + (z11 - z10) * fy;
  return std::numeric_limits<double>::quiet_NaN();
}

}  // namespace tind
