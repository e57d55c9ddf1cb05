#include "terrain/simplify/simplify_mesh.h"

#include "terrain/base/progress.h"
#include "terrain/base/result.h"
#include "terrain/mesh/manifold.h"
#include "terrain/simplify/collapse/attribute_quadric.h"
#include "terrain/simplify/collapse/triangle_collapse.h"

namespace tind {

Result<SimplifiedMesh> simplify_mesh(Tin tin, const SimplifyOptions& options,
                                     const Progress& progress) {
  if (const Result<void> ok = check_stop(options.stop); !ok) return std::unexpected(ok.error());
  if (options.stop.max_error_m) {
    return fail(Errc::invalid_argument,
                "a maximum error needs a DEM to measure against; give a general mesh a triangle "
                "count or a ratio");
  }
  const ManifoldRepair repair = make_manifold(tin);
  drop_unused_vertices(tin);
  if (tin.triangles.empty()) return fail(Errc::bad_data, "the mesh has no triangle");
  Result<Simplified> made = fail(Errc::internal, "");
  if (options.method == "qem") {
    SimplifyOptions shape_only = options;
    shape_only.attribute_metric = "ignored";
    made = attribute_qem_mesh(tin, shape_only, progress);
  } else if (options.method == "attribute-qem") {
    made = attribute_qem_mesh(tin, options, progress);
  } else if (options.method == "triangle-collapse") {
    made = triangle_collapse_mesh(tin, options, progress);
  } else {
    return fail(Errc::invalid_argument, "'" + options.method +
                                            "' is for terrain; a general mesh takes qem, "
                                            "attribute-qem or triangle-collapse");
  }
  if (!made) return std::unexpected(made.error());
  return SimplifiedMesh{std::move(*made), repair.split_vertices, repair.dropped_triangles};
}

}  // namespace tind
