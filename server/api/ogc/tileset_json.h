#pragma once
// What a collection's tiles in one tile matrix set say of themselves, and which there are.

#include <cstdint>
#include <optional>
#include <vector>

#include "server/api/ogc/document.h"
#include "server/api/ogc/tile_matrix_sets.h"
#include "server/services/datasets/catalog.h"

namespace tind::api::ogc {

/// A level's tiles lie within; rows from the north, both ends included.
struct TileLimits {
  int level = 0;
  std::uint32_t min_row = 0, max_row = 0, min_col = 0, max_col = 0;

  bool hold(std::uint32_t col, std::uint32_t row) const {
    return col >= min_col && col <= max_col && row >= min_row && row <= max_row;
  }
};

/// Tiles of meshes, in WorldCRS84Quad; or maps of the DEM, in WebMercatorQuad. Empty where the
/// dataset has none of these.
std::vector<TileLimits> tile_limits(const services::ServedDataset&, const TileMatrixSet&);

/// {title, dataType, crs, tileMatrixSetURI, tileMatrixSetLimits, boundingBox, links}.
/// REQUIRES: it has such tiles.
Ordered tileset_json(const Asked&, const services::ServedDataset&, const TileMatrixSet&);
/// As a list of tilesets has it.
Ordered tileset_item_json(const Asked&, const services::ServedDataset&, const TileMatrixSet&);

}  // namespace tind::api::ogc
