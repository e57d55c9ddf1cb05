// The link condition [Dey99]: the two ends of an edge may have no common neighbour but
// the apexes of the edge's own triangles. Each fan is walked once into a small array on the stack;
// comparing all pairs of two rings of six is cheaper than any marking scheme.

#include "terrain/simplify/collapse/collapse_engine.h"

namespace tind {

namespace {

using Index = HalfedgeMesh::Index;
constexpr Index kNone = HalfedgeMesh::kNone;
constexpr int kRing = 48;

/// The neighbours of origin(h) after apex(h), counter-clockwise up to (not including) the apex of
/// twin(h) and dest(h); -1 when there are more than fit, or the fan is open.
int open_ring(const HalfedgeMesh& m, Index h, Index (&ring)[kRing]) {
  int n = 0;
  const Index last = HalfedgeMesh::next(m.twin(h));
  for (Index e = m.rotate_ccw(h); e != last; e = m.rotate_ccw(e)) {
    if (e == kNone || n == kRing) return -1;
    ring[n++] = m.dest(e);
  }
  return n;
}

}  // namespace

bool collapse_keeps_manifold(const HalfedgeMesh& m, Index h) {
  const Index g = m.twin(h);
  if (g == kNone) return m.link_ok(h);
  Index ring_a[kRing], ring_b[kRing];
  const int a = open_ring(m, h, ring_a), b = a < 0 ? -1 : open_ring(m, g, ring_b);
  if (a < 1 || b < 1) return m.link_ok(h);  // borders, degree 3, huge fans: the careful way
  if (a == 1 && b == 1) return false;       // a tetrahedron would fold flat
  // Of each ring the first is an apex that both share: apex(h) for a, apex(g) for b.
  for (int i = 1; i < a; ++i)
    for (int k = 1; k < b; ++k)
      if (ring_a[i] == ring_b[k]) return false;
  return m.triangle_count() > 4;
}

}  // namespace tind
