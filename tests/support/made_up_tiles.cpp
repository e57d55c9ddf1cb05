#include "tests/support/made_up_tiles.h"

#include "proto/tile/quantized_mesh.h"
#include "terrain/geo/ellipsoid.h"

namespace tind::test {

MadeUpTiles::MadeUpTiles(int max_level) {
  layer_.name = "made up";
  layer_.maxzoom = max_level;
  layer_.extensions = {"octvertexnormals", "metadata"};
  for (int z = 0; z <= max_level; ++z)
    layer_.available.push_back({{0, 0, tiling::columns(z) - 1, tiling::rows(z) - 1}});
}

bool MadeUpTiles::available(TileId id) const { return layer_.contains(id.level, id.x, id.y); }

Result<TileBytes> MadeUpTiles::tile(TileId id, std::stop_token) const {
  ++built;
  if (before)
    if (auto error = before(id)) return std::unexpected(*error);
  proto::QuantizedMesh mesh;
  constexpr int kSide = 12;
  for (int v = 0; v < kSide; ++v)
    for (int u = 0; u < kSide; ++u) {
      mesh.u.push_back(std::uint16_t(u * 32767 / (kSide - 1)));
      mesh.v.push_back(std::uint16_t(v * 32767 / (kSide - 1)));
      mesh.h.push_back(std::uint16_t(id.x));
    }
  for (std::uint32_t v = 0; v + 1 < kSide; ++v)
    for (std::uint32_t u = 0; u + 1 < kSide; ++u) {
      const std::uint32_t corner = v * kSide + u;
      mesh.triangles.push_back({corner, corner + 1, corner + kSide});
      mesh.triangles.push_back({corner + 1, corner + kSide + 1, corner + kSide});
    }
  mesh.max_height = 1;
  const GeoRect r = tiling::rect(id);
  const Vec3 middle = wgs84::to_ecef({(r.west + r.east) / 2, (r.south + r.north) / 2}, 0);
  mesh.center = {middle.x, middle.y, middle.z};
  mesh.oct_normals.assign(mesh.u.size(), {127, 127});
  mesh.metadata = "{\"tile\":\"" + id.text() + "\"}";
  proto::arrange(mesh);
  return TileBytes{.bytes = proto::encode(mesh), .cost = {}, .max_error_m = 1};
}

}  // namespace tind::test
