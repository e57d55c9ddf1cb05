#include "terrain/pyramid/tile_transition.h"

#include "proto/quantized_mesh.h"
#include "terrain/tile/parent_part.h"
#include "terrain/tile/post_warp.h"

namespace tind {

namespace {

/// The tile as a client decodes it: u, v and metres.
Result<Tin> tin_of(const TileBytes& tile) {
  std::string reason;
  const auto q = proto::decode(tile.bytes, reason);
  if (!q) return fail(Errc::bad_data, reason);
  Tin tin;
  const double low = q->min_height, range = double(q->max_height) - low;
  for (std::size_t i = 0; i < q->u.size(); ++i)
    tin.vertices.push_back({double(q->u[i]), double(q->v[i]), low + q->h[i] * range / kTileExtent});
  tin.triangles = q->triangles;
  return tin;
}

}  // namespace

Result<proto::Transition> tile_transition(TileId tile, const TileBytes& fine,
                                          const TileBytes& parent) {
  const auto fine_tin = tin_of(fine), parent_tin = tin_of(parent);
  if (!fine_tin) return fail("tile " + tile.text(), fine_tin.error());
  if (!parent_tin) return fail("tile " + tile.parent().text(), parent_tin.error());
  const auto part = parent_part(*parent_tin, tile);
  if (!part) return std::unexpected(part.error());
  const auto way = terrain_transition(*fine_tin, *part);
  if (!way) return fail("tile " + tile.text() + " to its parent", way.error());

  proto::Transition out;
  out.level = std::uint32_t(tile.level), out.x = tile.x, out.y = tile.y;
  out.coarse_error_m = parent.max_error_m, out.fine_error_m = fine.max_error_m;
  out.border_splits = std::uint32_t(way->border_splits);
  out.fine_vertices = std::uint32_t(way->fine_vertices);
  for (const auto& v : way->vertices) {
    out.u.push_back(v.x), out.v.push_back(v.y);
    out.coarse_z.push_back(v.coarse_z), out.fine_z.push_back(v.fine_z);
  }
  out.triangles = way->base;
  for (const auto& s : way->splits) out.splits.push_back({s.vertex, s.left, s.right});
  return out;
}

TerrainTransition from_wire(const proto::Transition& t) {
  TerrainTransition out;
  for (std::size_t i = 0; i < t.u.size(); ++i)
    out.vertices.push_back({t.u[i], t.v[i], t.coarse_z[i], t.fine_z[i]});
  out.base = t.triangles;
  for (const auto& [vertex, left, right] : t.splits) out.splits.push_back({vertex, left, right});
  out.border_splits = t.border_splits;
  out.fine_vertices = t.fine_vertices;
  return out;
}

}  // namespace tind
