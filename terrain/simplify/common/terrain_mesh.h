#pragma once
// The full-resolution mesh of a height grid, from which methods collapse edges. Positions are post
// coordinates. Each vertex knows how it may move without uncovering anything.

#include <cstdint>
#include <vector>

#include "terrain/base/result.h"
#include "terrain/mesh/halfedge_mesh.h"
#include "terrain/mesh/line_edges.h"
#include "terrain/raster/terrain.h"

namespace tind {

struct Constraints;

/// How a vertex may move. A vertex at a void never moves; on the rectangle's sides only along them;
/// on a line not at all, but along_line may vanish into one of its two neighbours there. Those on
/// lines keep their heights too.
enum class VertexKind : std::uint8_t { interior, along_x, along_y, along_line, fixed };

struct TerrainMesh {
  HalfedgeMesh mesh;                  // x = col, y = -row, z metres
  std::vector<VertexKind> kind;       // per vertex slot
  double metres_x = 1, metres_y = 1;  // per post; scales x and y to the metric frame
  LineEdges lines = {};               // edges that stay, or merge along their line

  Vec3 metric(const Vec3& p) const { return {p.x * metres_x, p.y * metres_y, p.z}; }
};

/// Two triangles for each cell without a void, one for a cell with one void corner, else none.
/// Where voids leave two fans at one post, the post becomes two vertices. Fails (bad_data) when no
/// triangle is left, (invalid_argument) for a grid of less than 2 x 2 posts.
/// With `constraints` it is their mesh, which knows the grid already.
Result<TerrainMesh> terrain_mesh(const Terrain& dem, const Constraints* constraints = nullptr);

/// The same for a mesh that exists already, in post coordinates over a grid of cols x rows posts.
Result<TerrainMesh> terrain_mesh_of(const Tin&, int cols, int rows, double metres_x,
                                    double metres_y);

/// The same for a TIN in a frame of its own, whose sides are those of the rectangle around it. A
/// border that runs elsewhere stays.
Result<TerrainMesh> terrain_mesh_of(const Tin&, double metres_x, double metres_y);

/// Where the two ends of edge h allow the merged vertex to be.
enum class Merge : std::uint8_t {
  never,      // a chord, two fixed ends, two different sides
  free,       // both ends interior
  at_dest,    // only the position of dest(h)
  at_origin,  // only the position of origin(h)
  either,     // one of the two positions: an edge along a line
  along_x,    // a border edge on a side: anywhere between the ends
  along_y,
};
Merge border_merge_rule(const TerrainMesh&, HalfedgeMesh::Index h);
inline Merge merge_rule(const TerrainMesh& t, HalfedgeMesh::Index h) {
  const VertexKind a = t.kind[t.mesh.origin(h)], b = t.kind[t.mesh.dest(h)];
  if (a == VertexKind::interior && b == VertexKind::interior) return Merge::free;
  return border_merge_rule(t, h);
}

/// What the merged vertex may do afterwards.
inline VertexKind merged_kind(VertexKind a, VertexKind b) { return a > b ? a : b; }
inline bool height_is_fixed(VertexKind k) { return k >= VertexKind::along_line; }

/// Before a is collapsed into b: what b may do afterwards, and which of its edges are lines.
void move_lines(TerrainMesh&, HalfedgeMesh::Index a, HalfedgeMesh::Index b);
inline void merge_vertices(TerrainMesh& t, HalfedgeMesh::Index a, HalfedgeMesh::Index b) {
  if (!t.lines.empty() && t.kind[a] >= VertexKind::along_line) move_lines(t, a, b);
  t.kind[b] = merged_kind(t.kind[a], t.kind[b]);
}

/// True when moving both ends of h to `at` leaves every surviving triangle of the star surely
/// counter-clockwise seen from above.
bool star_stays_ccw(const HalfedgeMesh&, HalfedgeMesh::Index h, const Vec3& at);

/// Positions of merged vertices are multiples of 1/1024 of a post: small triangles then keep a
/// signed area far above the rounding of any later change of frame.
inline double snap_to_lattice(double v) {
  constexpr double kLattice = 1024, kRound = 6755399441055744.0;  // 1.5 * 2^52
  return (v * kLattice + kRound - kRound) / kLattice;
}

/// The filter of every terrain method: nothing flips.
struct NoFlip {
  bool allows(const HalfedgeMesh& mesh, HalfedgeMesh::Index h, const Vec3& at) const {
    return star_stays_ccw(mesh, h, at);
  }
};

}  // namespace tind
