#include "terrain/simplify/simplify_mesh.h"

#include "terrain/base/progress.h"
#include "terrain/base/result.h"
#include "terrain/mesh/manifold.h"
#include "terrain/simplify/collapse/attribute_quadric.h"
#include "terrain/simplify/collapse/placement.h"
#include "terrain/simplify/collapse/triangle_collapse.h"

namespace tind {

namespace {

/// The shape alone: attributes are carried along.
Result<Simplified> run(const Tin& tin, const QemOptions&, const RunOptions& options,
                       const Progress& progress) {
  return attribute_qem_mesh(tin, {.metric = AttributeMetric::ignored, .drape = {}}, options,
                            progress);
}

Result<Simplified> run(const Tin& tin, const AttributeQemOptions& method, const RunOptions& options,
                       const Progress& progress) {
  return attribute_qem_mesh(tin, method, options, progress);
}

Result<Simplified> run(const Tin& tin, const TriangleCollapseOptions& method,
                       const RunOptions& options, const Progress& progress) {
  return triangle_collapse_mesh(tin, method, options, progress);
}

template <class Other>
Result<Simplified> run(const Tin&, const Other&, const RunOptions&, const Progress&) {
  return fail(Errc::invalid_argument, std::string("'") + Other::kName +
                                          "' is for terrain; a general mesh takes qem, "
                                          "attribute-qem or triangle-collapse");
}

}  // namespace

bool takes_meshes(const MethodOptions& method) {
  return std::holds_alternative<QemOptions>(method) ||
         std::holds_alternative<AttributeQemOptions>(method) ||
         std::holds_alternative<TriangleCollapseOptions>(method);
}

Result<SimplifiedMesh> simplify_mesh(Tin tin, const SimplifyOptions& options,
                                     const Progress& progress) {
  if (const Result<void> ok = check_stop(options.stop); !ok) return std::unexpected(ok.error());
  if (options.stop.max_error_m) {
    return fail(Errc::invalid_argument,
                "a maximum error needs a DEM to measure against; give a general mesh a triangle "
                "count or a ratio");
  }
  if (std::holds_alternative<TriangleCollapseOptions>(options.method)) drop_attributes(tin);
  weld(tin);
  const ManifoldRepair repair = make_manifold(tin);
  drop_unused_vertices(tin);
  if (tin.triangles.empty()) return fail(Errc::bad_data, "the mesh has no triangle");
  Result<Simplified> made = std::visit(
      [&](const auto& method) { return run(tin, method, options, progress); }, options.method);
  if (!made) return std::unexpected(made.error());
  const auto seams = std::size_t(made->details.at(kSeamVertices));
  if (seams > 0 && !made->note.empty())
    made->note += "; vertices on seams, where attributes change, stay (triangle-collapse has none)";
  return SimplifiedMesh{std::move(*made), repair.split_vertices, repair.dropped_triangles, seams};
}

}  // namespace tind
