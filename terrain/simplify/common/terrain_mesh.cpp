// From posts to triangles. A grid without voids is built directly (HalfedgeMesh::from_grid). With
// voids, cells contribute what their valid corners allow, posts where two fans meet are split, and
// the general constructor does the rest.

#include "terrain/simplify/common/terrain_mesh.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "terrain/mesh/manifold.h"
#include "terrain/simplify/constraints/constraints.h"
#include "terrain/simplify/constraints/voids.h"

namespace tind {

namespace {

using Index = HalfedgeMesh::Index;
constexpr Index kNone = HalfedgeMesh::kNone;

std::vector<Vec3> post_positions(const HeightGrid& grid) {
  std::vector<Vec3> positions(grid.size());
  auto p = positions.begin();
  for (int r = 0; r < grid.rows(); ++r)
    for (int c = 0; c < grid.cols(); ++c) *p++ = {double(c), -double(r), double(grid.at(c, r))};
  return positions;
}

/// The triangles of one cell, as posts; the diagonal runs from south-west to north-east unless one
/// of these two is the cell's only void.
void add_cell(const HeightGrid& grid, int c, int r, std::vector<Triangle>& out) {
  const auto at = [&](int dc, int dr) {
    return std::uint32_t(std::size_t(r + dr) * grid.cols() + c + dc);
  };
  const std::uint32_t nw = at(0, 0), ne = at(1, 0), sw = at(0, 1), se = at(1, 1);
  const bool v_nw = !grid.is_void(c, r), v_ne = !grid.is_void(c + 1, r);
  const bool v_sw = !grid.is_void(c, r + 1), v_se = !grid.is_void(c + 1, r + 1);
  if (v_nw && v_sw && v_ne) out.push_back({nw, sw, ne});
  if (v_se && v_ne && v_sw) out.push_back({se, ne, sw});
  if (!v_ne && v_nw && v_sw && v_se) out.push_back({nw, sw, se});
  if (!v_sw && v_nw && v_ne && v_se) out.push_back({nw, se, ne});
}

Tin tin_with_voids(const HeightGrid& grid) {
  Tin tin;
  tin.vertices = post_positions(grid);
  for (int r = 0; r + 1 < grid.rows(); ++r)
    for (int c = 0; c + 1 < grid.cols(); ++c) add_cell(grid, c, r, tin.triangles);
  split_fans(tin, CopyOrder::of_vertices);
  return tin;
}

/// The rectangle around a terrain; sides of a mesh on it stay on it.
struct Rectangle {
  double west, south, east, north;
};

/// A border vertex whose two border edges run along one side of the rectangle may move along it;
/// any other is fixed.
VertexKind border_kind(const HalfedgeMesh& m, Index v, const Rectangle& box) {
  const Vec3 &p = m.position(v), &a = m.position(m.dest(m.out(v))),
             &b = m.position(m.origin(m.border_in(v)));
  if (a.y == p.y && b.y == p.y && (p.y == box.north || p.y == box.south))
    return VertexKind::along_x;
  if (a.x == p.x && b.x == p.x && (p.x == box.west || p.x == box.east)) return VertexKind::along_y;
  return VertexKind::fixed;
}

void set_kinds(TerrainMesh& terrain, const Rectangle& box) {
  const HalfedgeMesh& m = terrain.mesh;
  terrain.kind.assign(m.vertex_slots(), VertexKind::interior);
  for (Index v = 0; v < m.vertex_slots(); ++v)
    if (m.alive_vertex(v) && m.on_border(v)) terrain.kind[v] = border_kind(m, v, box);
}

Rectangle of_grid(int cols, int rows) { return {0, -(rows - 1.0), cols - 1.0, 0}; }

Rectangle around(const Tin& tin) {
  Rectangle box{HUGE_VAL, HUGE_VAL, -HUGE_VAL, -HUGE_VAL};
  for (const Vec3& p : tin.vertices) {
    box.west = std::min(box.west, p.x), box.east = std::max(box.east, p.x);
    box.south = std::min(box.south, p.y), box.north = std::max(box.north, p.y);
  }
  return box;
}

/// Vertices on lines stay; in the middle of a straight stretch they may slide. On the border that
/// stretch must be the border itself.
void set_lines(TerrainMesh& terrain, const Constraints& constraints) {
  const HalfedgeMesh& m = terrain.mesh;
  for (const LinePart& part : constraints.parts) {
    Index last = part.a;
    for (std::size_t i = part.first; i < part.last; ++i) {
      terrain.lines.add(last, constraints.inner[i]);
      last = constraints.inner[i];
    }
    terrain.lines.add(last, part.b);
  }
  for (Index v = 0; v < m.vertex_slots(); ++v) {
    if (!m.alive_vertex(v) || !terrain.lines.on_line(v)) continue;
    bool slides = constraints.hold[v] == Constraints::slides;
    if (m.on_border(v))
      slides = slides && terrain.lines.contains(v, m.dest(m.out(v))) &&
               terrain.lines.contains(v, m.origin(m.border_in(v)));
    terrain.kind[v] = slides ? VertexKind::along_line : VertexKind::fixed;
  }
  for (Index v = 0; v < constraints.hold.size(); ++v)
    if (constraints.hold[v] == Constraints::stays) terrain.kind[v] = VertexKind::fixed;
}

}  // namespace

Result<TerrainMesh> terrain_mesh(const Terrain& dem, const Constraints* constraints) {
  const HeightGrid& grid = dem.grid;
  if (constraints) {
    Result<TerrainMesh> made = terrain_mesh_of(constraints->mesh, grid.cols(), grid.rows(),
                                               dem.spacing_x_m, dem.spacing_y_m);
    if (made) set_lines(*made, *constraints);
    return made;
  }
  if (grid.cols() < 2 || grid.rows() < 2) {
    return fail(Errc::bad_data, "a grid of " + std::to_string(grid.cols()) + " x " +
                                    std::to_string(grid.rows()) +
                                    " posts has no triangles; at least 2 x 2 are needed");
  }
  TerrainMesh terrain;
  terrain.metres_x = dem.spacing_x_m;
  terrain.metres_y = dem.spacing_y_m;
  if (std::ranges::none_of(grid.values(), [](float z) { return std::isnan(z); })) {
    terrain.mesh = HalfedgeMesh::from_grid(grid.cols(), grid.rows(), post_positions(grid));
  } else {
    Result<HalfedgeMesh> mesh = HalfedgeMesh::from_tin(tin_with_voids(grid));
    if (!mesh) return fail("the grid's mesh", mesh.error());
    terrain.mesh = std::move(*mesh);
  }
  if (terrain.mesh.triangle_count() == 0) return std::unexpected(no_triangle(grid));
  set_kinds(terrain, of_grid(grid.cols(), grid.rows()));
  return terrain;
}

Result<TerrainMesh> terrain_mesh_of(const Tin& tin, int cols, int rows, double metres_x,
                                    double metres_y) {
  Result<HalfedgeMesh> mesh = HalfedgeMesh::from_tin(tin);
  if (!mesh) return std::unexpected(mesh.error());
  TerrainMesh terrain{std::move(*mesh), {}, metres_x, metres_y};
  set_kinds(terrain, of_grid(cols, rows));
  return terrain;
}

Result<TerrainMesh> terrain_mesh_of(const Tin& tin, double metres_x, double metres_y) {
  Result<HalfedgeMesh> mesh = HalfedgeMesh::from_tin(tin);
  if (!mesh) return std::unexpected(mesh.error());
  TerrainMesh terrain{std::move(*mesh), {}, metres_x, metres_y};
  set_kinds(terrain, around(tin));
  return terrain;
}

Merge border_merge_rule(const TerrainMesh& t, Index h) {
  const Index a = t.mesh.origin(h), b = t.mesh.dest(h);
  const VertexKind ka = t.kind[a], kb = t.kind[b];
  if (ka == VertexKind::interior) return Merge::at_dest;
  if (kb == VertexKind::interior) return Merge::at_origin;
  if (t.lines.contains(a, b)) {
    if (ka == VertexKind::fixed) return kb == VertexKind::fixed ? Merge::never : Merge::at_origin;
    return kb == VertexKind::fixed ? Merge::at_dest : Merge::either;
  }
  if (t.mesh.twin(h) != kNone) return Merge::never;  // a chord
  const Vec3 &pa = t.mesh.position(a), &pb = t.mesh.position(b);
  const bool horizontal = pa.y == pb.y;
  const VertexKind side = horizontal ? VertexKind::along_x : VertexKind::along_y;
  if (!horizontal && pa.x != pb.x) return Merge::never;
  if (ka == side && kb == side) return horizontal ? Merge::along_x : Merge::along_y;
  if (ka == side && kb == VertexKind::fixed) return Merge::at_dest;
  if (kb == side && ka == VertexKind::fixed) return Merge::at_origin;
  return Merge::never;
}

void move_lines(TerrainMesh& t, Index a, Index b) {
  t.mesh.for_each_neighbour(a, [&](Index w) {
    if (!t.lines.contains(a, w)) return;
    t.lines.remove(a, w);
    if (w != b) t.lines.add(b, w);
  });
}

bool star_stays_ccw(const HalfedgeMesh& m, Index h, const Vec3& at) {
  const Index g = m.twin(h);
  // Walks from just behind the edge around to its other side; at a border, from there again.
  const auto fan_ok = [&](Index edge, Index twin) {
    const Index last = twin == kNone ? kNone : HalfedgeMesh::next(twin);
    Index e = m.rotate_ccw(edge);
    for (; e != kNone && e != last; e = m.rotate_ccw(e))
      if (!surely_ccw(at, m.position(m.dest(e)), m.position(m.apex(e)))) return false;
    if (e == last) return true;
    for (e = m.out(m.origin(edge)); e != edge && e != last; e = m.rotate_ccw(e))
      if (!surely_ccw(at, m.position(m.dest(e)), m.position(m.apex(e)))) return false;
    return true;
  };
  if (g == kNone) {  // dest's fan ends with this triangle; origin's begins with it
    for (Index e = m.out(m.dest(h)); e != HalfedgeMesh::next(h); e = m.rotate_ccw(e))
      if (!surely_ccw(at, m.position(m.dest(e)), m.position(m.apex(e)))) return false;
    return fan_ok(h, kNone);
  }
  return fan_ok(h, g) && fan_ok(g, h);
}

}  // namespace tind
