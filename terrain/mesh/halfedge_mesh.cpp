// The half-edge mesh. Each edit is drawn with the vertices a -> b of the edited edge, its apexes c
// (left) and d (right); every other name follows from that picture:
//
//            c
//          /   \            h  = a->b   hn = b->c   hp = c->a      (left triangle)
//         a --- b           g  = b->a   gn = a->d   gp = d->b      (right triangle, if any)
//          \   /
//            d

#include "terrain/mesh/halfedge_mesh.h"

#include <algorithm>
#include <cassert>

namespace tind {

using Index = HalfedgeMesh::Index;

Index HalfedgeMesh::add_triangle(Index a, Index b, Index c) {
  const Index t = Index(triangle_slots());
  origin_.insert(origin_.end(), {a, b, c});
  twin_.insert(twin_.end(), {kNone, kNone, kNone});
  ++live_triangles_;
  return t;
}

void HalfedgeMesh::link(Index h, Index g) {
  if (h != kNone) twin_[h] = g;
  if (g != kNone) twin_[g] = h;
}

void HalfedgeMesh::remove_triangle(Index t) {
  for (Index h = 3 * t; h < 3 * t + 3; ++h) origin_[h] = twin_[h] = kNone;
  --live_triangles_;
}

Result<HalfedgeMesh> HalfedgeMesh::from_tin(const Tin& tin) {
  const std::size_t n = tin.vertices.size();
  HalfedgeMesh m;
  m.position_ = tin.vertices;
  m.origin_.reserve(3 * tin.triangles.size());
  for (const Triangle& t : tin.triangles) {
    for (const Index v : t) {
      if (v >= n) {
        return fail(Errc::bad_data,
                    "a triangle names vertex " + std::to_string(v) + " of " + std::to_string(n));
      }
    }
    if (t[0] == t[1] || t[1] == t[2] || t[2] == t[0])
      return fail(Errc::bad_data, "a triangle names one vertex twice");
    m.origin_.insert(m.origin_.end(), t.begin(), t.end());
  }
  m.live_triangles_ = tin.triangles.size();
  m.twin_.assign(m.origin_.size(), kNone);
  m.out_.assign(n, kNone);

  // Outgoing half-edges by vertex, as one flat list with an offset per vertex.
  std::vector<Index> offset(n + 1, 0), leaving(m.origin_.size());
  for (const Index v : m.origin_) ++offset[v + 1];
  for (std::size_t v = 0; v < n; ++v) offset[v + 1] += offset[v];
  {
    std::vector<Index> fill(offset.begin(), offset.end() - 1);
    for (Index h = 0; h < m.origin_.size(); ++h) leaving[fill[m.origin_[h]]++] = h;
  }
  std::vector<Index> to(n, kNone);  // by neighbour of the vertex at hand: the half-edge there
  for (Index v = 0; v < n; ++v) {
    const auto half_edge_to = [&](Index w) {
      return to[w] != kNone && m.origin(to[w]) == v ? to[w] : kNone;
    };
    for (Index i = offset[v]; i < offset[v + 1]; ++i) {
      const Index w = m.dest(leaving[i]);
      if (half_edge_to(w) != kNone) {
        return fail(Errc::bad_data, "edge " + std::to_string(v) + "-" + std::to_string(w) +
                                        " is used twice in one direction (not a manifold)");
      }
      to[w] = leaving[i];
    }
    for (Index i = offset[v]; i < offset[v + 1]; ++i) {
      const Index arriving = prev(leaving[i]);
      m.twin_[arriving] = half_edge_to(m.origin(arriving));
    }
  }
  for (Index v = 0; v < n; ++v) {
    const Index count = offset[v + 1] - offset[v];
    if (count == 0) continue;
    m.out_[v] = leaving[offset[v]];
    for (Index i = offset[v]; i < offset[v + 1]; ++i)
      if (m.twin_[leaving[i]] == kNone) m.out_[v] = leaving[i];
    Index reached = 0;
    m.for_each_out(v, [&](Index) { ++reached; });
    if (reached != count) {
      return fail(Errc::bad_data, "the triangles at vertex " + std::to_string(v) +
                                      " form more than one fan (not a manifold)");
    }
  }
  return m;
}

HalfedgeMesh HalfedgeMesh::from_grid(int cols, int rows, std::vector<Vec3> positions) {
  assert(cols >= 2 && rows >= 2 && positions.size() == std::size_t(cols) * rows);
  HalfedgeMesh m;
  m.position_ = std::move(positions);
  const std::size_t cells = std::size_t(cols - 1) * (rows - 1);
  m.origin_.resize(6 * cells);
  m.twin_.assign(6 * cells, kNone);
  m.out_.resize(m.position_.size());
  m.live_triangles_ = 2 * cells;
  const Index cell_cols = Index(cols - 1);
  // The cell at (c, r) owns half-edges 6 cell .. 6 cell + 5: (nw, sw, ne) and (se, ne, sw).
  for (Index r = 0; r + 1 < Index(rows); ++r) {
    for (Index c = 0; c < cell_cols; ++c) {
      const Index h = 6 * (r * cell_cols + c);
      const Index nw = r * Index(cols) + c, ne = nw + 1, sw = nw + Index(cols), se = sw + 1;
      m.origin_[h] = nw, m.origin_[h + 1] = sw, m.origin_[h + 2] = ne;
      m.origin_[h + 3] = se, m.origin_[h + 4] = ne, m.origin_[h + 5] = sw;
      m.link(h + 1, h + 4);
      if (c > 0) m.link(h, h - 6 + 3);
      if (r > 0) m.link(h + 2, h - 6 * cell_cols + 5);
      m.out_[nw] = h;
    }
  }
  auto cell = [&](Index c, Index r) { return 6 * (r * cell_cols + c); };
  for (Index r = 1; r < Index(rows); ++r)  // the east side runs north
    m.out_[r * Index(cols) + cell_cols] = cell(cell_cols - 1, r - 1) + 3;
  for (Index c = 0; c < cell_cols; ++c)  // the south side runs east
    m.out_[Index(rows - 1) * Index(cols) + c] = cell(c, Index(rows) - 2) + 5;
  for (Index c = 1; c < Index(cols); ++c)  // the north side runs west
    m.out_[c] = cell(c - 1, 0) + 2;
  return m;
}

bool HalfedgeMesh::link_ok(Index h) const {
  const Index g = twin_[h];
  const Index a = origin(h), b = dest(h), c = apex(h), d = g == kNone ? kNone : apex(g);
  if (live_triangles_ <= (g == kNone ? 1u : 2u)) return false;
  if (g != kNone && on_border(a) && on_border(b)) return false;  // a chord: would pinch
  // An edge ab whose left triangle hangs on it alone would leave c without a triangle.
  if (twin_[next(h)] == kNone && twin_[prev(h)] == kNone) return false;
  if (g != kNone && twin_[next(g)] == kNone && twin_[prev(g)] == kNone) return false;

  // A tetrahedron, or two triangles back to back: a whole part of the mesh would fold flat.
  if (g != kNone && c == d) return false;
  if (g != kNone && !on_border(a) && !on_border(b) && degree(a) == 3 && degree(b) == 3)
    return false;

  bool ok = true;
  for_each_neighbour(a, [&](Index n) {
    if (n == b || n == c || n == d || !ok) return;
    for_each_neighbour(b, [&](Index k) { ok = ok && k != n; });
  });
  return ok;
}

Index HalfedgeMesh::collapse(Index h) {
  const Index hn = next(h), hp = prev(h), g = twin_[h];
  const Index a = origin(h), b = dest(h), c = apex(h);
  const bool a_border = on_border(a), b_border = on_border(b);
  const Index a_out = out_[a];
  for (Index e = a_out, stop = a_out; e != kNone;) {
    origin_[e] = b;
    e = rotate_ccw(e);
    if (e == stop) break;
  }
  const Index bc = twin_[hp], cb = twin_[hn];  // what was a->c is b->c now
  link(bc, cb);
  Index db = kNone, bd = kNone, gn = kNone;
  if (g != kNone) {
    gn = next(g);
    const Index gp = prev(g), d = apex(g);
    db = twin_[gn], bd = twin_[gp];
    link(db, bd);
    if (out_[d] == gp) out_[d] = db;
  }
  if (out_[c] == hp) out_[c] = cb;

  if (a_border && !b_border)
    out_[b] = a_out == gn ? bd : a_out;
  else if (out_[b] == hn || out_[b] == g)
    out_[b] = bc;
  out_[a] = kNone;
  remove_triangle(triangle(h));
  if (g != kNone) remove_triangle(triangle(g));
  return b;
}

Index HalfedgeMesh::flip(Index h) {
  const Index g = twin_[h];
  const Index hn = next(h), hp = prev(h), gn = next(g), gp = prev(g);
  const Index a = origin(h), b = dest(h), c = origin(hp), d = origin(gp);
  const Index bc = twin_[hn], ca = twin_[hp], ad = twin_[gn], db = twin_[gp];
  origin_[h] = d, origin_[hn] = c, origin_[hp] = a;
  origin_[g] = c, origin_[gn] = d, origin_[gp] = b;
  link(hn, ca), link(hp, ad), link(gn, db), link(gp, bc);
  if (ca == kNone) twin_[hn] = kNone;
  if (ad == kNone) twin_[hp] = kNone;
  if (db == kNone) twin_[gn] = kNone;
  if (bc == kNone) twin_[gp] = kNone;
  if (out_[a] == h || out_[a] == gn) out_[a] = hp;
  if (out_[b] == g || out_[b] == hn) out_[b] = gp;
  if (out_[c] == hp) out_[c] = hn;
  if (out_[d] == gp) out_[d] = gn;
  return h;
}

Index HalfedgeMesh::split_triangle(Index t, const Vec3& p) {
  const Index ab = 3 * t, bc = ab + 1, ca = ab + 2;
  const Index a = origin(ab), b = origin(bc), c = origin(ca), v = Index(position_.size());
  position_.push_back(p);
  const Index u1 = 3 * add_triangle(b, c, v), u2 = 3 * add_triangle(c, a, v);
  link(u1, twin_[bc]);
  link(u2, twin_[ca]);
  origin_[ca] = v;       // slot t is now (a, b, v)
  link(bc, u1 + 2);      // b-v
  link(u1 + 1, u2 + 2);  // c-v
  link(u2 + 1, ca);      // a-v
  if (out_[b] == bc) out_[b] = u1;
  if (out_[c] == ca) out_[c] = u2;
  out_.push_back(ca);
  return v;
}

Index HalfedgeMesh::split_edge(Index h, const Vec3& p) {
  const Index g = twin_[h], hn = next(h), hp = prev(h);
  const Index a = origin(h), b = dest(h), c = origin(hp), v = Index(position_.size());
  position_.push_back(p);
  const Index u = 3 * add_triangle(v, b, c);
  link(u + 1, twin_[hn]);
  origin_[hn] = v;  // the left slot is now (a, v, c)
  link(hn, u + 2);
  if (out_[b] == hn) out_[b] = u + 1;
  if (g != kNone) {
    const Index gn = next(g), gp = prev(g), d = origin(gp);
    const Index w = 3 * add_triangle(v, a, d);
    link(w + 1, twin_[gn]);
    origin_[gn] = v;  // the right slot is now (b, v, d)
    link(gn, w + 2);
    link(h, w);
    link(g, u);
    if (out_[a] == gn) out_[a] = w + 1;
  }
  out_.push_back(u);
  return v;
}

Tin HalfedgeMesh::to_tin(std::vector<Index>* new_index) const {
  std::vector<Index> local;
  std::vector<Index>& map = new_index ? *new_index : local;
  map.assign(position_.size(), kNone);
  Tin tin;
  tin.triangles.reserve(live_triangles_);
  for (Index v = 0; v < position_.size(); ++v) {
    if (!alive_vertex(v)) continue;
    map[v] = Index(tin.vertices.size());
    tin.vertices.push_back(position_[v]);
  }
  for (Index t = 0; t < triangle_slots(); ++t) {
    if (!alive_triangle(t)) continue;
    tin.triangles.push_back(
        {map[origin_[3 * t]], map[origin_[3 * t + 1]], map[origin_[3 * t + 2]]});
  }
  return tin;
}

std::string HalfedgeMesh::check() const {
  std::size_t live = 0;
  std::vector<Index> leaving(position_.size(), 0);
  for (Index h = 0; h < origin_.size(); ++h) {
    const std::string at = "half-edge " + std::to_string(h) + ": ";
    if (origin_[h] == kNone) {
      if (twin_[h] != kNone) return at + "removed, but has a twin";
      continue;
    }
    live += h % 3 == 0;
    if (origin_[h] >= position_.size()) return at + "origin out of range";
    if (origin(h) == dest(h)) return at + "runs from a vertex to itself";
    ++leaving[origin_[h]];
    const Index g = twin_[h];
    if (g == kNone) continue;
    if (g >= origin_.size() || origin_[g] == kNone) return at + "twin is removed";
    if (twin_[g] != h) return at + "twin does not point back";
    if (origin(g) != dest(h) || dest(g) != origin(h)) return at + "twin joins other vertices";
  }
  if (live != live_triangles_) return "triangle count is off";
  for (Index v = 0; v < position_.size(); ++v) {
    const std::string at = "vertex " + std::to_string(v) + ": ";
    if (out_[v] == kNone) {
      if (leaving[v] != 0) return at + "removed, but triangles use it";
      continue;
    }
    if (out_[v] >= origin_.size() || origin_[out_[v]] != v) return at + "out does not leave it";
    Index reached = 0;
    bool border_inside = false;
    for_each_out(v, [&](Index e) {
      border_inside |= e != out_[v] && twin_[e] == kNone;
      if (++reached > leaving[v]) return;
    });
    if (reached != leaving[v]) return at + "its fan does not hold all its triangles";
    if (border_inside) return at + "out is not its border half-edge";
  }
  return {};
}

}  // namespace tind
