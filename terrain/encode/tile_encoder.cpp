#include "terrain/encode/tile_encoder.h"

#include <algorithm>

#include "terrain/encode/glb_tile.h"
#include "terrain/encode/quantized_mesh_tile.h"

namespace tind {

std::span<const TileEncoder> tile_encoders() {
  static constexpr TileEncoder kTable[] = {
      {"quantized-mesh", "application/vnd.quantized-mesh", "terrain", encode_quantized_mesh},
      {"glb", "model/gltf-binary", "glb", encode_glb},
  };
  return kTable;
}

const TileEncoder* encoder_of_extension(std::string_view extension) {
  const auto table = tile_encoders();
  const auto found = std::ranges::find(table, extension, &TileEncoder::extension);
  return found == table.end() ? nullptr : &*found;
}

}  // namespace tind
