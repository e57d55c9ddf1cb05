#pragma once
// The parts of OGC API, one file each.

#include "server/api/app.h"

namespace tind::api::ogc {

/// Common, Part 1: / and /conformance.
void add_landing_routes(http::Router&, const App&);
/// Common, Part 2: /collections and /collections/{id}.
void add_collection_routes(http::Router&, const App&);
/// Two Dimensional Tile Matrix Set: /tileMatrixSets.
void add_tile_matrix_set_routes(http::Router&);
/// Tiles: /collections/{id}/tiles.
void add_tileset_routes(http::Router&, const App&);
/// Environmental Data Retrieval: /collections/{id}/position and its like.
void add_edr_routes(http::Router&, const App&);
/// Coverages, as far as its draft has settled: /collections/{id}/coverage.
void add_coverage_routes(http::Router&, const App&);

}  // namespace tind::api::ogc
