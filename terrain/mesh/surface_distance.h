#pragma once
// How far are two surfaces apart, in three dimensions, and how different do they look?
//
// As Metro [Cignoni98] defines it: each surface is sampled on its vertices, along its edges and
// over its faces, and each sample is measured to the nearest point of the other surface. The
// maximum of both directions estimates the Hausdorff distance from below; RMS and mean are over the
// faces' samples, which are spread by area. Attributes are compared between a sample and its
// nearest point, both interpolated ([Han04] and [Min], section 5).

#include <cstdint>
#include <optional>

#include "terrain/base/progress.h"
#include "terrain/mesh/tin.h"

namespace tind {

struct SurfaceSampling {
  std::uint64_t face_samples = 0;  // 0: ten for each triangle of the finer mesh, 100,000 at least
  int threads = 1;
  /// Triangles that all searches of one direction may look at, of a few nanoseconds each; always
  /// 200 a sample, of which a surface takes a dozen.
  double most_looks = 1e9;
};

/// Differences in the units of the meshes' coordinates.
struct OneSidedDistance {
  double max = 0, rms = 0, mean = 0;
  std::uint64_t samples = 0;   // measured
  std::uint64_t left_out = 0;  // evenly among them, for time's sake
};

/// Euclidean difference of two attributes: of colours with channels 0..1, of unit normals.
struct AttributeError {
  double max = 0, rms = 0;
};

struct SurfaceDistance {
  OneSidedDistance a_to_b, b_to_a;
  double max = 0, rms = 0;                                // the larger of the two
  double diagonal = 0;                                    // of the box around a
  std::optional<AttributeError> colour, normal, texture;  // where both meshes have them
};

/// REQUIRES: both have at least one triangle, finite coordinates and valid indices. The same result
/// for any number of threads. O((samples + triangles) log triangles) for surfaces; where triangles
/// go through each other every way and a search has to look at hundreds, only as many samples are
/// measured as take some 10 s of one core. Cannot be stopped.
SurfaceDistance surface_distance(const Tin& a, const Tin& b, const SurfaceSampling& = {},
                                 const Progress& = {});

}  // namespace tind
