#pragma once
// Terrain edge cost [Kim], the method `edge-cost`.
//
//   C(e) = L(e) + alpha h(e) + beta d(e)
//   L = length of e * smaller circumradius of its two triangles   (an area: equation 2)
//   h = |z_t - z_s|                                               (a length)
//   d = degree of the vertex that the collapse makes              (a number)
//
// Which edges may collapse:
//   border edge                                        never
//   chord (both ends on the border, but inside)        never
//   one end on the border                              to that end
//   inner edge                                         to its midpoint, or where `placement` says
//
// placement
//   midpoint  the paper's: m = (p_t + p_s) / 2
//   fit       where the samples (posts, a TIN's vertices) of the star that the collapse leaves want
//             it: from m one Gauss-Newton step of
//                 sum over samples i of (z_i - z_w - g_i . (x_i - w))^2,
//             the squared vertical distances from the star with its apex at (w, z_w), g_i being the
//             slope of the triangle over sample i; first w, at most half of the way to the ring and
//             only within the star, then z_w, for which the sum is least exactly:
//                 z_w += sum b_i r_i / (sum b_i^2 + 0.02),
//             b_i being the share (0..1) that the apex has of the surface at the sample and r_i how
//             far the sample is above it. The midpoint keeps its place, with the best height there,
//             where the step does not make the sum smaller. Which edge goes first is the cost's
//             business all the same. COST: reads the samples of each star, about twice per
//             collapse.
//
// alpha and beta are dimensionless: they are multiplied by mean L / mean h and mean L / mean d of
// the input mesh (details "alpha_scale", "beta_scale"), so a weight means the same on any terrain.

#include "terrain/base/enum_names.h"
#include "terrain/base/progress.h"
#include "terrain/base/result.h"
#include "terrain/raster/terrain.h"
#include "terrain/simplify/common/options.h"
#include "terrain/simplify/common/simplified.h"

namespace tind {

struct HeldMesh;

/// The default weights are the best pair of edge_cost_weights_bench. They matter little: of its
/// pairs none is 10 % better than no weights at all, and none 8 % worse.
/// All terms of the cost, or one alone.
enum class Term { all, length, height, degree };

template <>
struct EnumNames<Term> {
  static constexpr const char* kWhat = "term";
  static constexpr std::pair<Term, const char*> kAll[] = {{Term::all, "all"},
                                                          {Term::length, "length"},
                                                          {Term::height, "height"},
                                                          {Term::degree, "degree"}};
};

/// Where the merged vertex of an inner edge goes.
enum class EdgePlacement { midpoint, fit };

template <>
struct EnumNames<EdgePlacement> {
  static constexpr const char* kWhat = "placement of edge-cost";
  static constexpr std::pair<EdgePlacement, const char*> kAll[] = {
      {EdgePlacement::midpoint, "midpoint"}, {EdgePlacement::fit, "fit"}};
};

struct EdgeCostOptions {
  static constexpr const char* kName = "edge-cost";
  static constexpr bool kTellsCollapses = true;
  static constexpr const char* kVariant = "term";
  double alpha = 0.25, beta = 2;  // dimensionless
  Term term = Term::all;
  EdgePlacement placement = EdgePlacement::midpoint;

  template <class F>
  static void each_option(F&& option) {
    option("alpha", &EdgeCostOptions::alpha, "edge-cost: weight of the height difference");
    option("beta", &EdgeCostOptions::beta, "edge-cost: weight of the degree");
    option("term", &EdgeCostOptions::term, "edge-cost: all terms, or one alone");
    option(
        "placement", &EdgeCostOptions::placement,
        "edge-cost: where the merged vertex goes, the paper's midpoint or where the samples around "
        "it want it");
  }
};

Result<Simplified> simplify_edge_cost(const Terrain& dem, const EdgeCostOptions&, const RunOptions&,
                                      const Progress&);

/// Fails (invalid_argument) on weights that are no weights.
Result<void> check_method(const EdgeCostOptions&);

/// The same on a mesh whose border is held, as far as its bound and its count allow. Returns the
/// steps. The options have passed check_method.
Result<std::uint64_t> collapse_held(HeldMesh&, const EdgeCostOptions&, const Progress&);

}  // namespace tind
