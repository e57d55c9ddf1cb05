#pragma once
// A finished tile before it is encoded: integers on its lattice, and the errors that are certified
// for them. All encodings are made from this model, so all have the same mesh and the same error.

#include <array>
#include <cmath>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "proto/tile/layer_json.h"
#include "terrain/geo/tiling_scheme.h"
#include "terrain/mesh/side.h"
#include "terrain/mesh/tin.h"
#include "terrain/surface/post_warp.h"
#include "terrain/tile/culling.h"

namespace tind {

/// A tile's heights are whole steps above its lowest: 32767 of them span every height it can hold.
struct HeightLattice {
  double min = 0, step = 1;
  double max() const { return min + kTileExtent * step; }
  std::uint16_t index(double h) const { return std::uint16_t(std::lround((h - min) / step)); }
};

/// What is promised of the tile as a client decodes it.
struct TileCertificate {
  double max_error_m = 0;   // no valid post of the tile is farther from the mesh, vertically
  double edge_error_m = 0;  // how far its border is from the DEM, voids filled, at most
  bool exact = true;        // max_error_m is the maximum over all posts, not only a bound of it
  Side side = Side::both;
};

struct TileModel {
  TileId id;
  /// x = u, y = v, integers 0..32767; z in metres above the ellipsoid, on `heights`. Vertices in
  /// the order in which the triangles first use them. No attributes.
  Tin mesh;
  HeightLattice heights;
  /// Of the surface, one a vertex, octahedral (normals.h): on a lattice, too, so that all
  /// encodings agree. Empty where a tile has none.
  std::vector<std::array<std::uint8_t, 2>> normals;
  /// As water_mask() makes it (water_mask.h): 1 or 256 x 256 bytes. Empty where the dataset has no
  /// water.
  std::vector<std::uint8_t> water_mask;
  CullingVolumes volumes;
  std::optional<TileCertificate> certificate;  // none: another maker's tile that states no error

  // What tind's own metadata say beside that.
  bool one_sided = false;            // every tile of the set was to lie on one side of its posts
  double displayed_error_m = 0;      // what clients take for the error of the level
  std::uint64_t posts = 0;           // valid ones in the closed rectangle
  std::optional<double> residual_m;  // of the index, where the error rests on it
  std::vector<std::vector<proto::TileRange>> descendants;  // TilePlan::descendants
};

/// Where a vertex of a tile's mesh lies; sides and corners to the last bit as its neighbours' do.
inline Geographic place_of(const GeoRect& rect, const Vec3& vertex) {
  const auto mix = [](double a, double b, double t) {
    return t == 0 ? a : t == kTileExtent ? b : a + t / kTileExtent * (b - a);
  };
  return {mix(rect.west, rect.east, vertex.x), mix(rect.south, rect.north, vertex.y)};
}

}  // namespace tind
