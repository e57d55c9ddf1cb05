#include "terrain/pyramid/make/tile_transition.h"

#include "terrain/encode/quantized_mesh_tile.h"
#include "terrain/tile/parent_part.h"

namespace tind {

Result<proto::Transition> tile_transition(TileId tile, std::span<const std::uint8_t> fine,
                                          std::span<const std::uint8_t> parent,
                                          const std::stop_token& stop) {
  const auto fine_tile = decode_tile(tile, fine);
  const auto parent_tile = decode_tile(tile.parent(), parent);
  if (!fine_tile) return fail("tile " + tile.text(), fine_tile.error());
  if (!parent_tile) return fail("tile " + tile.parent().text(), parent_tile.error());
  const auto part = parent_part(parent_tile->mesh, tile);
  if (!part) return std::unexpected(part.error());
  const auto way = terrain_transition(fine_tile->mesh, *part, stop);
  if (!way) return fail("tile " + tile.text() + " to its parent", way.error());

  proto::Transition out;
  out.level = std::uint32_t(tile.level), out.x = tile.x, out.y = tile.y;
  if (parent_tile->certificate) out.coarse_error_m = parent_tile->certificate->max_error_m;
  if (fine_tile->certificate) out.fine_error_m = fine_tile->certificate->max_error_m;
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
