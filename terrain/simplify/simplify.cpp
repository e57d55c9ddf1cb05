// The table of methods, and the one place where options are checked before a method sees them.

#include "terrain/simplify/simplify.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "terrain/mesh/vertical_error.h"
#include "terrain/simplify/attribute_quadric.h"
#include "terrain/simplify/bounded.h"
#include "terrain/simplify/clustering.h"
#include "terrain/simplify/constraints.h"
#include "terrain/simplify/edge_cost.h"
#include "terrain/simplify/greedy_insertion.h"
#include "terrain/simplify/memoryless.h"
#include "terrain/simplify/quadric.h"
#include "terrain/simplify/triangle_collapse.h"
#include "terrain/simplify/vertex_removal.h"

namespace tind {

namespace {

using Method = Result<Simplified> (*)(const HeightGrid&, double, double, const SimplifyOptions&,
                                      const Progress&);

constexpr const char* kWithLines = "0 flipped, 0 uncovered, lines stay edges";
constexpr const char* kAllStops = "triangles, ratio, max error";

struct Row {
  MethodInfo info;
  Method run;
};

const std::vector<Row>& table() {
  static const std::vector<Row> rows = {
      {{"edge-cost", "edge length x circumradius, height difference and degree", kAllStops,
        kWithLines, "Kim, Yu, Park, Cho: a terrain edge cost (papers/001)"},
       simplify_edge_cost},
      {{"qem", "squared distance to the planes of all merged triangles", kAllStops, kWithLines,
        "Garland and Heckbert 1997"},
       simplify_qem},
      {{"memoryless", "squared volume between the current mesh and the next", kAllStops, kWithLines,
        "Lindstrom and Turk 1998"},
       simplify_memoryless},
      {{"attribute-qem", "squared distance to planes of position, colour and normal (--drape)",
        kAllStops, kWithLines, "Han, Chun, Min: EQEM (papers/000, /004)"},
       simplify_attribute_qem},
      {{"vertex-removal",
        "distance to the ring's average plane, or the degree (--criterion plane|degree|k-degree)",
        kAllStops, kWithLines, "Schroeder, Zarge, Lorensen 1992; papers/001"},
       simplify_vertex_removal},
      {{"triangle-collapse", "squared distance to planes, six triangles a step (--placement)",
        kAllStops, kWithLines, "Sung and Park: PMTC (papers/003); Gieng et al. 1997"},
       simplify_triangle_collapse},
      {{"cluster", "squared distance to the planes of each cell of a uniform grid", kAllStops,
        kWithLines, "Rossignac and Borrel 1993; Lindstrom 2000"},
       simplify_cluster},
      {{"greedy", "the largest vertical error, vertices on posts", kAllStops, kWithLines,
        "Garland and Heckbert 1995, greedy insertion"},
       simplify_greedy},
      {{"bounded",
        "triangles within a strict vertical error, or squared error at a count (--effort, --side)",
        kAllStops, "0 flipped, 0 uncovered, every post within the error, lines stay edges",
        "ours: floating heights"},
       simplify_bounded},
  };
  return rows;
}

std::string names() {
  std::string all;
  for (const Row& row : table()) all += (all.empty() ? "" : ", ") + row.info.name;
  return all;
}

/// What only lines need: their grid, polygons level to the last bit, and a word where heights that
/// the lines bring cannot be had together with the error bound.
Result<Simplified> with_lines(Method run, double sx, double sy, const SimplifyOptions& options,
                              const Progress& progress) {
  const Constraints& constraints = *options.constraints;
  Result<Simplified> made = run(constraints.grid, sx, sy, options, progress);
  if (!made) return made;
  set_level(made->tin, constraints);
  if (options.stop.max_error_m &&
      vertical_error(made->tin, constraints.grid, options.threads).max_m >
          *options.stop.max_error_m) {
    made->note = "the heights of the lines themselves are farther from the DEM than the bound";
  }
  return made;
}

}  // namespace

Result<void> check_stop(const StopAt& stop) {
  if (int(stop.triangles.has_value()) + stop.ratio.has_value() + stop.max_error_m.has_value() !=
      1) {
    return fail(Errc::invalid_argument,
                "give exactly one of a triangle count, a ratio and a maximum error");
  }
  if (stop.triangles && *stop.triangles == 0)
    return fail(Errc::invalid_argument, "the triangle count must be at least 1");
  if (stop.ratio && !(*stop.ratio > 0 && *stop.ratio <= 1))
    return fail(Errc::invalid_argument, "the ratio must be above 0 and at most 1");
  if (stop.max_error_m && !(*stop.max_error_m >= 0 && std::isfinite(*stop.max_error_m)))
    return fail(Errc::invalid_argument, "the maximum error must be a number of metres >= 0");
  return {};
}

std::span<const MethodInfo> methods() {
  static const std::vector<MethodInfo> infos = [] {
    std::vector<MethodInfo> all;
    for (const Row& row : table()) all.push_back(row.info);
    return all;
  }();
  return infos;
}

Result<Simplified> simplify(const HeightGrid& grid, double spacing_x_m, double spacing_y_m,
                            const SimplifyOptions& options, const Progress& progress) {
  const auto row =
      std::ranges::find_if(table(), [&](const Row& r) { return r.info.name == options.method; });
  if (row == table().end()) {
    return fail(Errc::invalid_argument,
                "there is no method '" + options.method + "'; there are " + names());
  }
  if (const Result<void> ok = check_stop(options.stop); !ok) return std::unexpected(ok.error());
  if (!(spacing_x_m > 0 && spacing_y_m > 0 && std::isfinite(spacing_x_m * spacing_y_m)))
    return fail(Errc::invalid_argument, "the post spacing must be positive");
  if (grid.cols() < 2 || grid.rows() < 2) {
    return fail(Errc::invalid_argument, "a grid of " + std::to_string(grid.cols()) + " x " +
                                            std::to_string(grid.rows()) +
                                            " posts has no triangles; at least 2 x 2 are needed");
  }
  if (options.constraints) return with_lines(row->run, spacing_x_m, spacing_y_m, options, progress);
  return row->run(grid, spacing_x_m, spacing_y_m, options, progress);
}

}  // namespace tind
