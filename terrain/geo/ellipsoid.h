#pragma once
// The WGS84 ellipsoid: conversion between geographic and ecef coordinates, and what culling needs.

#include "terrain/geo/coordinates.h"

namespace tind::wgs84 {

inline constexpr double kSemiMajor = 6378137.0;             // a, metres
inline constexpr double kSemiMinor = 6356752.3142451793;    // b, metres
inline constexpr double kEccentricity2 = 6.69437999014e-3;  // e^2

/// Geographic with ellipsoidal height to ecef. Exact to rounding (1 nm at the surface).
Vec3 to_ecef(Geographic p, double height_m);

/// Ecef to geographic and ellipsoidal height (Bowring, iterated): 1e-9 degrees, 1 mm for any
/// point within 100 km of the surface.
struct GeographicHeight {
  Geographic p;
  double height_m;
};
GeographicHeight from_ecef(const Vec3& p);

/// The unit normal of the ellipsoid ("up") in ecef.
Vec3 up(Geographic p);

/// Metres per degree of longitude and of latitude at this latitude, on the ellipsoid.
Vec2 metres_per_degree(double lat_deg);

}  // namespace tind::wgs84
