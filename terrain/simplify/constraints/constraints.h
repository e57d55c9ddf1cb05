#pragma once
// Lines that stay edges, polygons that become level, a polygon that the mesh is cut to: the user's
// shapes, built into one full-resolution mesh from which every method starts.
//
// GUARANTEES, in post coordinates: each straight part of the repaired network is a chain of edges
// of the result, and their vertices lie exactly on the part (integer arithmetic; see
// check_constraints). Lines are first rounded to a lattice of 2^-24 post. Where lines cross, the
// crossing is a vertex, rounded to the lattice. Where they come within 1/1024 post of each other
// without meeting, they are joined. report.moved_posts is the largest distance by which any of this
// moved a line.

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "terrain/base/result.h"
#include "terrain/mesh/constrained_delaunay.h"
#include "terrain/mesh/polygon_set.h"
#include "terrain/raster/gdal/vectors/vector_source.h"
#include "terrain/raster/terrain.h"

namespace tind {

struct ConstraintShapes {
  std::vector<VectorLine> breaklines;  // polygons given as breaklines: their rings
  std::vector<VectorPolygon> flatten, boundary;
};

/// A straight stretch between two vertices of `Constraints::mesh`; inner[first..last) lie on it
/// exactly, in order from a to b.
struct LinePart {
  std::uint32_t a, b;
  std::size_t first, last;
};

struct ConstraintReport {
  std::size_t breaklines = 0, flattened = 0, boundaries = 0;  // shapes given
  std::size_t not_finite = 0, without_length = 0;             // points, segments left out
  std::size_t outside = 0;   // parts beyond the DEM, in its voids or outside the boundary
  std::size_t overlaps = 0;  // parts that several segments share
  LineRepairs repairs;
  std::size_t parts = 0;
  double moved_posts = 0;
  std::size_t posts_flattened = 0, posts_outside = 0;
};

struct Constraints {
  enum Hold : std::uint8_t { loose, slides, stays };

  Terrain dem;  // polygons level, void outside the boundary: the truth for every error
  Tin mesh;     // post coordinates; vertex row * cols + col is that post, lines' come after
  std::vector<Hold> hold;             // of each vertex: free, only along its line, not at all
  std::vector<LinePart> parts;        // all lines within the mesh
  std::vector<LinePart> elsewhere;    // in voids of the DEM or outside the boundary
  std::vector<std::uint32_t> inner;   // vertices of parts
  std::vector<std::uint32_t> beside;  // posts too near a line to be vertices
  PolygonSet flat, boundary;
  std::vector<double> level;  // of each polygon of `flat`
  ConstraintReport report;
};

/// Heights of lines that bring none are the DEM's (bilinear), at the ends of each part and at
/// points at most 1.42 posts apart between them. A polygon's level is the median of its own
/// heights if it has any, else of the posts in it, else of the DEM along its outline; polygons
/// that touch or lie in one another share the lowest of theirs. Fails (unsupported) without CGAL,
/// (bad_data) when nothing is left.
Result<Constraints> constrain(const Terrain& dem, const ConstraintShapes& shapes);

/// Why a mesh has more triangles than wanted: its lines, and rims where voids stay open.
std::string edges_alone_note(std::size_t triangles);

struct ConstraintCheck {
  std::size_t parts = 0, missing = 0;  // parts that are not wholly edges of the mesh
  std::size_t not_level = 0;           // triangles inside a flattened polygon that are not level
};

/// Checks exactly that a mesh in post coordinates keeps its constraints. O(n log n).
ConstraintCheck check_constraints(const Tin&, const Constraints&);

/// Vertices inside flattened polygons get their level to the last bit (methods leave rounding).
void set_level(Tin&, const Constraints&);

}  // namespace tind
