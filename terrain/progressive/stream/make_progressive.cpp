// The method collapses, a recorder listens (split_recorder.h) and measures the posts.

#include "terrain/progressive/stream/make_progressive.h"

#include <algorithm>
#include <cmath>

#include "terrain/progressive/stream/bounded_collapses.h"
#include "terrain/progressive/stream/least_error.h"
#include "terrain/progressive/stream/split_recorder.h"
#include "terrain/simplify/methods.h"
#include "terrain/simplify/simplify.h"

namespace tind {

namespace {

/// The vertical error over all posts.
class PostMeasure {
 public:
  using Index = HalfedgeMesh::Index;

  explicit PostMeasure(const HeightGrid& grid) : grid_(grid) {}

  bool other_way(const HalfedgeMesh& m, const Collapse& c) const {
    return other_way_from_above(m, c);
  }

  double fine(const HalfedgeMesh& m) const {
    double worst = 0;
    for (Index h = 0; h < m.halfedge_slots(); h += 3) {
      if (!m.alive_triangle(h / 3)) continue;
      worst = std::max(worst, triangle_error(grid_, m.position(m.origin(h)), m.position(m.dest(h)),
                                             m.position(m.apex(h))));
    }
    return worst;
  }

  /// The largest error of the triangles that the collapse leaves around the merged vertex.
  double after(const HalfedgeMesh& m, const Collapse& c) const {
    double worst = 0;
    m.for_each_kept(c.edge, [&](Index e) {
      const Vec3 &p = m.position(m.dest(e)), &q = m.position(m.apex(e));
      worst = std::max(worst, triangle_error(grid_, c.kept_after, p, q));
    });
    return worst;
  }

 private:
  const HeightGrid& grid_;
};

}  // namespace

bool makes_progressive(const MethodOptions& method) {
  // `bounded` has an order of its own (bounded_collapses.h).
  return std::holds_alternative<BoundedOptions>(method) || std::visit(
                                                               [](const auto& m) {
                                                                 return requires {
                                                                   m.kTellsCollapses;
                                                                 };
                                                               },
                                                               method);
}

Result<ProgressiveMesh> make_progressive(const Terrain& dem, const SimplifyOptions& method,
                                         std::size_t base_triangles, const Progress& progress,
                                         const Lattice& lattice) {
  if (!makes_progressive(method.method)) {
    return fail(Errc::invalid_argument,
                "'" + method_name(method.method) +
                    "' does not collapse edges, so it makes no progressive mesh; edge-cost, qem, "
                    "memoryless, attribute-qem, triangle-collapse and bounded do");
  }
  if (!(lattice.per_post >= 1 && lattice.per_post <= 1024 &&
        std::exp2(std::round(std::log2(lattice.per_post))) == lattice.per_post &&
        lattice.z_step_m >= 0 && std::isfinite(lattice.z_step_m))) {
    return fail(Errc::invalid_argument,
                "the lattice must be a power of two from 1 to 1024 for each post, and its step of "
                "height must not be negative");
  }
  PostMeasure measure(dem.grid);
  SplitRecorder splits(measure, lattice, base_triangles);
  SimplifyOptions options = method;
  options.recorder = &splits;
  if (!options.stop.triangles && !options.stop.ratio && !options.stop.max_error_m)
    options.stop.ratio = 1;
  const Result<Simplified> run = std::holds_alternative<BoundedOptions>(options.method)
                                     ? record_bounded_collapses(dem, options, progress)
                                     : simplify(dem, options, progress);
  if (!run) return std::unexpected(run.error());
  return std::move(splits.mesh);
}

void widen(ProgressiveMesh& mesh, double rounding_m) {
  if (rounding_m == 0) return;
  mesh.fine_error_m += rounding_m;
  for (VertexSplit& s : mesh.splits) s.error_m = rounded_up(double(s.error_m) + rounding_m);
}

}  // namespace tind
