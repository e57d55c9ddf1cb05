#pragma once
// The part of `tind info` that is about lines and polygons.

#include <nlohmann/json_fwd.hpp>
#include <string>

#include "terrain/raster/gdal/vectors/vector_source.h"

namespace tind::cli {

/// {"kind": "lines and polygons", "driver": ..., "layers": [...]}.
nlohmann::ordered_json vectors_json(const VectorFacts&);

std::string vectors_text(const std::string& path, const VectorFacts&);

/// All of it in a line, from vectors_json()'s answer.
std::string vectors_line(const nlohmann::ordered_json&);

}  // namespace tind::cli
