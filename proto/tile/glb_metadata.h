#pragma once
// What a GLB says of places of its surface beyond how it looks: water as a property texture, kinds
// of ground as features with a property table (EXT_structural_metadata, EXT_mesh_features; the
// specifications are in CesiumGS/glTF).

#include <nlohmann/json.hpp>
#include <vector>

#include "proto/tile/glb.h"
#include "proto/tile/glb_buffer.h"

namespace tind::proto {

/// Names of the extensions, which a reader may leave out.
std::vector<const char*> metadata_extensions(const Glb&);

/// Puts it into the file and its primitives.
void add_metadata(nlohmann::ordered_json& gltf, nlohmann::ordered_json& primitives, GlbBuffer&,
                  const Glb&);

}  // namespace tind::proto
