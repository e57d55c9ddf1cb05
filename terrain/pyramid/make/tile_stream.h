#pragma once
// A finished tile as a progressive mesh: what /progressive sends.

#include <cstdint>
#include <span>
#include <stop_token>

#include "proto/stream/mesh_stream.h"
#include "terrain/base/result.h"
#include "terrain/geo/tiling_scheme.h"
#include "terrain/raster/dem_source.h"

namespace tind {

/// A stream that ends in exactly this quantized-mesh tile and begins with its border and few
/// vertices inside. A pure function of the tile's bytes, so it works for tiles of any maker that
/// are valid.
///
/// Frame: the tile's own grid as a DEM of 32768 x 32768 posts, one place a post: X = u,
/// Y = v - 32767, Z in steps of the tile's heights (a finer power of two, rounded, where its step
/// is none); longitude and latitude by the affine map.
///
/// GUARANTEES: in every state the border is the tile's, vertex by vertex, so any state of a tile
/// fits any state of its neighbours without a crack; so do the places that a coarse level keeps
/// against the earth's curvature. Every state is a valid mesh, and the error it states bounds all
/// posts: the tile's own `max_error_m` and the largest distance to the tile over the whole area.
/// For a tile that does not say its error, only the latter.
///
/// Fails (bad_data), naming the tile, when the bytes are no such tile.
Result<proto::MeshStream> tile_stream(TileId, std::span<const std::uint8_t> tile,
                                      const VerticalDatum&, std::stop_token = {});

}  // namespace tind
