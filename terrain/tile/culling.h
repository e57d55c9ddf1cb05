#pragma once
// What a globe client needs to decide, without looking at the mesh, that a tile cannot be seen: a
// bounding sphere (outside the view?) and a horizon occlusion point (behind the earth?).
//
// The occlusion point represents the whole tile in the test of [Ring13], which clients run in
// *ellipsoid-scaled* space (ecef divided by a, a, b: the earth is the unit sphere). It lies on the
// ray through the tile's centre.

#include <span>

#include "terrain/geo/coordinates.h"

namespace tind {

struct CullingVolumes {
  Vec3 center;               // ecef: middle of the rectangle, halfway between lowest and highest
  Vec3 sphere_center;        // ecef
  double sphere_radius = 0;  // metres
  Vec3 horizon_occlusion;    // ellipsoid-scaled ecef; always finite
};

/// `vertices` are longitude and latitude in degrees and ellipsoidal height in metres, exactly as a
/// client dequantises them. REQUIRES: at least one.
///
/// GUARANTEES, for the mesh with these vertices:
/// - the sphere contains every vertex (and so every triangle), with 1 mm to spare for rounding
/// - a client that runs the test on the full ellipsoid, from any place above it, never calls
///   the tile hidden while some point of it can be seen past the ellipsoid lowered to the tile's
///   deepest vertex. (With heights below zero the plain formula would hide the far shore of the
///   Dead Sea.) A client that lowers the ellipsoid itself computes its own point.
/// - a tile so wide that no point can stand for it (the hemispheres of level 0) gets one at
///   `kUnbounded`, which the test never calls hidden.
///
/// Cost: about 40 ns per vertex.
CullingVolumes culling_volumes(const GeoRect&, std::span<const Vec3> vertices);

/// Distance of an occlusion point that must never be hidden. Its square overflows, so that the
/// test's quotient is inf/inf, which is not greater than anything; a merely large distance would
/// hide mountains that look over the terminator of their hemisphere.
inline constexpr double kUnbounded = 1e160;

/// The client's test: is the scaled point hidden by the unit sphere for a camera at `camera`
/// (both ellipsoid-scaled)?
bool hidden_by_horizon(const Vec3& point, const Vec3& camera);

/// Ecef to ellipsoid-scaled.
Vec3 ellipsoid_scaled(const Vec3& ecef);

}  // namespace tind
