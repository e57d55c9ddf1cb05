#pragma once
// How strongly a merged vertex is held near where it was, so that every sum of planes has one least
// point. Where planes vanish (flat land) the spring alone decides: short edges go first.
//
// Each method has its own value, for each is a share of something else; meshes' bytes rest on them.

namespace tind {

/// `qem`: of the area around the vertex as seen from above. Three unknowns, solved in closed form:
/// it need not be more than the rounding of a float.
inline constexpr double kQemSpring = 1e-5;

/// `memoryless`: of the square of that area, for it sums squared volumes; to the edge's midpoint.
inline constexpr double kVolumeSpring = 1e-5;

/// `attribute-qem` and `triangle-collapse`: of the area around the vertex. QuadricN::least solves
/// for up to nine unknowns in floats without pivoting, which asks for more than three do.
inline constexpr double kQuadricNSpring = 1e-3;

/// `cluster`: of the trace of the cell's planes, to the mean of its posts.
inline constexpr double kClusterSpring = 1e-4;

}  // namespace tind
