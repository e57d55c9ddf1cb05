// Greedy insertion grows the frame; all other methods get the frame with every sample inserted, and
// collapse it under the exact check over the samples. The collapse engine knows a vertex that may
// not move (VertexKind::fixed): the frame's are that. Two such vertices never merge, so an edge
// between two of them stays, too, and with it the border and every line.

#include "terrain/pyramid/make/tile_methods.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <vector>

#include "terrain/mesh/triangle_plane.h"
#include "terrain/simplify/common/held_mesh.h"
#include "terrain/simplify/insertion/delaunay_insertion.h"
#include "terrain/simplify/methods.h"

namespace tind {

namespace {

/// The levels of lakes are brought to the steps of borders, 1 m at most.
constexpr double kLevelStep = 0.51;

/// The bound, a hair tighter: rounding may not break it.
double inner_bound(const MesherOptions& o) { return o.eps - 1e-9 * (o.eps + o.relief); }

InsertionOptions insertion_options(const MesherOptions& o) {
  InsertionOptions i;
  i.limit = inner_bound(o);
  i.x_scale = o.x_scale;
  i.locked_border = i.integer_lattice = true;
  i.lattice_max = o.lattice_max;
  i.height_step = o.height_step;
  return i;
}

/// Calls f(sample, number) for all that are valid, in an order in which neighbours follow each
/// other.
template <class F>
void each_sample(const GridSamples& s, F&& f) {
  for (int row = 0; row < s.rows; ++row) {
    for (int k = 0; k < s.cols; ++k) {
      const int col = row % 2 ? s.cols - 1 - k : k;  // there and back
      const std::size_t i = std::size_t(row) * s.row_length() + std::size_t(col);
      const Vec3 p = s.sample(i);
      if (!std::isnan(p.z)) f(p, i);
    }
  }
}
template <class F>
void each_sample(const ScatteredSamples& s, F&& f) {
  for (std::size_t i = 0; i < s.size(); ++i) f(s.sample(i), i);
}

/// Which samples the frame is level with: those of its level triangles that have no other samples.
/// In a lake, that is: a vertex there could only leave the level.
template <class Samples>
std::vector<bool> level_samples(const HalfedgeMesh& frame, const Samples& samples, double bound) {
  const double hair = std::min(bound / 4, kLevelStep);
  std::vector<bool> level(samples.size(), false);
  std::vector<std::size_t> inside;
  for (HalfedgeMesh::Index t = 0; t < frame.triangle_slots(); ++t) {
    if (!frame.alive_triangle(t)) continue;
    const Vec3 &a = frame.position(frame.origin(3 * t)), &b = frame.position(frame.dest(3 * t)),
               &c = frame.position(frame.apex(3 * t));
    if (a.z != b.z || a.z != c.z) continue;
    inside.clear();
    bool all = true;
    samples.scan(a, b, c, [&](double, double, double z, std::size_t i) {
      inside.push_back(i);
      return all = std::abs(z - a.z) <= hair;
    });
    if (!all) continue;
    for (const std::size_t i : inside) level[i] = true;
  }
  return level;
}

/// Makes every sample inside the frame a vertex; not where there is one already, or a line has no
/// room beside it, nor in the lakes of `kept`. They are samples all the same.
template <class Samples>
void insert_all(HalfedgeMesh& mesh, const Samples& samples, const MesherOptions& o,
                LinePoints* kept) {
  DelaunayInsertion<Samples> insertion(mesh, samples, insertion_options(o));
  if (kept) insertion.keep(kept);
  const std::vector<bool> level = kept ? level_samples(mesh, samples, inner_bound(o))
                                       : std::vector<bool>(samples.size(), false);
  HalfedgeMesh::Index near = 0;
  each_sample(samples, [&](const Vec3& sample, std::size_t i) {
    if (level[i]) return;
    const Vec3 p{std::nearbyint(sample.x), std::nearbyint(sample.y),
                 std::clamp(snap_height(sample.z, o.height_step), o.height_min, o.height_max)};
    if (!(p.x > 0 && p.y > 0 && p.x < o.lattice_max && p.y < o.lattice_max)) return;
    const std::size_t before = mesh.vertex_slots();
    if (insertion.insert_point(p, near)) near = HalfedgeMesh::Index(before);
  });
}

/// The exact check behind every collapse. Posts on the border are the border's business: nothing
/// inside can help them.
template <class Samples>
auto within_bound(const Samples& samples, const MesherOptions& o) {
  return [&samples, bound = inner_bound(o), last = o.lattice_max](const Vec3& a, const Vec3& b,
                                                                  const Vec3& c) {
    const TrianglePlane plane(a, b, c);
    const auto [gx, gy] = plane.slope;
    const double size = std::max(std::abs(b.z - a.z), std::abs(c.z - a.z)) + bound;
    const Band band{a.x, a.y, a.z, bound, gx, gy, -bound, gx, gy, size};
    return samples.scan_outside(a, b, c, band, [&](double x, double y, double z, std::size_t) {
      constexpr double kHair = 1e-6;
      return std::abs(plane.at(x, y) - z) <= bound || x < kHair || y < kHair || x > last - kHair ||
             y > last - kHair;
    });
  };
}

template <class Samples>
HalfedgeMesh collapsed(const MethodOptions& method, HalfedgeMesh mesh, LinePoints* kept,
                       const Samples& samples, const MesherOptions& o, double metres_per_unit,
                       const Progress& progress, std::shared_ptr<const HeldColours> colours) {
  insert_all(mesh, samples, o, kept);
  HeldMesh held;
  held.terrain.mesh = std::move(mesh);
  held.terrain.kind.assign(held.terrain.mesh.vertex_slots(), VertexKind::interior);
  std::fill_n(held.terrain.kind.begin(), o.pinned, VertexKind::fixed);
  held.terrain.metres_x = metres_per_unit * o.x_scale;
  held.terrain.metres_y = metres_per_unit;
  held.place_step = o.lattice_step;
  held.height_step = o.height_step;
  held.height_min = o.height_min, held.height_max = o.height_max;
  held.within = within_bound(samples, o);
  held.fit = fit_samples(samples);
  held.colours = std::move(colours);
  // What it can fail with is a stop, which callers see themselves.
  static_cast<void>(simplify_held(held, method, progress));
  return std::move(held.terrain.mesh);
}

}  // namespace

template <class Samples>
Tin mesh_by_method(const MethodOptions& method, HalfedgeMesh frame, LinePoints* kept,
                   const Samples& samples, const MesherOptions& o, double metres_per_unit,
                   const Progress& progress, std::shared_ptr<const HeldColours> colours) {
  if (!std::holds_alternative<GreedyOptions>(method))
    return collapsed(method, std::move(frame), kept, samples, o, metres_per_unit, progress,
                     std::move(colours))
        .to_tin();
  DelaunayInsertion<Samples> insertion(frame, samples, insertion_options(o));
  if (kept) insertion.keep(kept);
  insertion.run_worst_first(~std::uint64_t(0), progress);
  return frame.to_tin();
}

template Tin mesh_by_method(const MethodOptions&, HalfedgeMesh, LinePoints*, const GridSamples&,
                            const MesherOptions&, double, const Progress&,
                            std::shared_ptr<const HeldColours>);
template Tin mesh_by_method(const MethodOptions&, HalfedgeMesh, LinePoints*,
                            const ScatteredSamples&, const MesherOptions&, double, const Progress&,
                            std::shared_ptr<const HeldColours>);

}  // namespace tind
