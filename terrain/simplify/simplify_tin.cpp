// Methods count in posts: vertices that move go to 1/1024 of one, a hair is 1e-7 of one. So the TIN
// is brought to a frame in which its vertices are about 1 apart: a shift and a power of two, so
// chosen that both are exact in doubles. The way back is exact, too: what is counter-clockwise here
// is so in the file, and no vertex changes its last digits.

#include "terrain/simplify/simplify_tin.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "terrain/mesh/triangle_plane.h"
#include "terrain/simplify/bounded/bounded.h"
#include "terrain/simplify/collapse/collapse_method.h"
#include "terrain/simplify/common/held_mesh.h"
#include "terrain/simplify/common/samples.h"
#include "terrain/simplify/common/star_fit.h"
#include "terrain/simplify/common/terrain_mesh.h"
#include "terrain/simplify/insertion/coarse_outline.h"
#include "terrain/simplify/insertion/delaunay_insertion.h"
#include "terrain/simplify/insertion/greedy_insertion.h"
#include "terrain/simplify/methods.h"

namespace tind {

namespace {

/// From the TIN's x and y to x and y in vertices' distances, and back.
struct VertexFrame {
  double x0 = 0, y0 = 0, unit = 1;

  Vec3 in(const Vec3& p) const { return {(p.x - x0) / unit, (p.y - y0) / unit, p.z}; }
  Vec3 out(const Vec3& p) const { return {p.x * unit + x0, p.y * unit + y0, p.z}; }
};

/// Multiples of `unit` from which every value of [low, high] has an exact distance: where all are
/// far from zero on one side the end nearer to it, otherwise zero itself.
double exact_origin(double low, double high, double unit) {
  if (low > high - low) return std::floor(low / unit) * unit;
  if (-high > high - low) return std::ceil(high / unit) * unit;
  return 0;
}

struct Extent {
  Vec3 low{HUGE_VAL, HUGE_VAL, HUGE_VAL}, high{-HUGE_VAL, -HUGE_VAL, -HUGE_VAL};

  explicit Extent(const Tin& tin) {
    for (const Vec3& p : tin.vertices) {
      low = {std::min(low.x, p.x), std::min(low.y, p.y), std::min(low.z, p.z)};
      high = {std::max(high.x, p.x), std::max(high.y, p.y), std::max(high.z, p.z)};
    }
  }
  double side() const { return std::max(high.x - low.x, high.y - low.y); }
};

VertexFrame frame_of(const Tin& tin) {
  double area2 = 0;
  for (const Triangle& t : tin.triangles)
    area2 += orient2d(tin.vertices[t[0]], tin.vertices[t[1]], tin.vertices[t[2]]);
  const double apart = std::sqrt(area2 / 2 / double(tin.vertices.size()));
  const Extent e(tin);
  VertexFrame frame;
  frame.unit = std::exp2(std::round(std::log2(apart)));
  frame.x0 = exact_origin(e.low.x, e.high.x, frame.unit);
  frame.y0 = exact_origin(e.low.y, e.high.y, frame.unit);
  return frame;
}

/// A TIN in its frame, ready for any method.
struct Ground {
  TerrainMesh terrain;
  ScatteredSamples samples;
  std::size_t triangles = 0;
  RunOptions run;  // the bound in units of z

  double x_scale() const { return delaunay_x_scale(terrain.metres_x, terrain.metres_y); }
};

/// The exact check behind every collapse, a hair tighter than what is asked.
auto within_bound(const ScatteredSamples& samples, double bound) {
  return [&samples, limit = bound * (1 - 1e-9)](const Vec3& a, const Vec3& b, const Vec3& c) {
    return ScatteredSamples::takes(a, b, c) &&
           samples.scan(a, b, c, [&](double x, double y, double z, std::size_t) {
             return std::abs(height_in(a, b, c, x, y) - z) <= limit;
           });
  };
}

Result<Simplified> collapse(Ground& ground, const MethodOptions& method, const Progress& progress) {
  Simplified out;
  out.input_triangles = ground.triangles;
  HeldMesh held;
  held.terrain = std::move(ground.terrain);
  held.place_step = 0;
  held.triangles = target_triangles(ground.run.stop, ground.triangles);
  held.within = ScatteredSamples::takes;
  if (ground.run.stop.max_error_m)
    held.within = within_bound(ground.samples, *ground.run.stop.max_error_m);
  held.fit = fit_samples(ground.samples);
  const auto steps = simplify_held(held, method, progress);
  if (!steps) return std::unexpected(steps.error());
  out.steps = *steps;
  out.tin = held.terrain.mesh.to_tin();
  out.note = stop_note(ground.run.stop, ground.triangles, out.tin.triangles.size());
  return out;
}

Result<Simplified> run(Ground& ground, const MethodOptions& method, const Progress& progress) {
  const auto* const bounded = std::get_if<BoundedOptions>(&method);
  if (!bounded && !std::holds_alternative<GreedyOptions>(method))
    return collapse(ground, method, progress);
  const auto start = coarse_outline(ground.terrain);
  if (!start) return std::unexpected(start.error());
  if (!bounded)
    return simplify_greedy_samples(*start, ground.samples, ground.x_scale(), ground.triangles,
                                   ground.run, progress);
  return simplify_bounded_samples(*start, std::move(ground.samples), ground.x_scale(),
                                  ground.triangles, *bounded, ground.run, progress);
}

/// What of the request no TIN can be asked.
Result<void> check(const TerrainTin& terrain, const SimplifyOptions& options) {
  if (const auto ok = check_stop(options.stop); !ok) return ok;
  if (const auto ok = check_options(options.method); !ok) return ok;
  for (const double unit : {terrain.x_unit_m, terrain.y_unit_m, terrain.z_unit_m})
    if (!(unit > 0 && std::isfinite(unit)))
      return fail(Errc::invalid_argument, "a unit of the TIN must be a number of metres above 0");
  if (options.constraints || options.recorder)
    return fail(Errc::unsupported, "lines and steps are for DEMs, not for a TIN");
  if (const auto* const attributed = std::get_if<AttributeQemOptions>(&options.method);
      attributed && attributed->drape)
    return fail(Errc::unsupported, "a drape is for a DEM, not for a TIN");
  if (terrain.tin.triangles.empty()) return fail(Errc::bad_data, "the mesh has no triangle");
  std::string able;
  for (const MethodInfo& m : methods()) {
    if (m.tiles && m.name == method_name(options.method)) return {};
    if (m.tiles) able += (able.empty() ? "" : ", ") + m.name;
  }
  return fail(Errc::unsupported, "'" + method_name(options.method) +
                                     "' is for rasters, whose grid it goes by; a TIN takes " +
                                     able);
}

}  // namespace

Result<Simplified> simplify_tin(const TerrainTin& terrain, const SimplifyOptions& options,
                                const Progress& progress) {
  if (const auto ok = check(terrain, options); !ok) return std::unexpected(ok.error());
  const VertexFrame frame = frame_of(terrain.tin);
  Tin local = terrain.tin;
  for (Vec3& p : local.vertices) p = frame.in(p);
  auto mesh = terrain_mesh_of(local, frame.unit * terrain.x_unit_m / terrain.z_unit_m,
                              frame.unit * terrain.y_unit_m / terrain.z_unit_m);
  if (!mesh) return std::unexpected(mesh.error());
  const Extent extent(local);
  Ground ground{std::move(*mesh),
                ScatteredSamples(local.vertices, extent.side(), 2, {extent.low.x, extent.low.y}),
                local.triangles.size(), options};
  if (ground.run.stop.max_error_m) *ground.run.stop.max_error_m /= terrain.z_unit_m;
  Result<Simplified> made = run(ground, options.method, progress);
  if (!made) return made;
  for (Vec3& p : made->tin.vertices) p = frame.out(p);
  return made;
}

}  // namespace tind
