#pragma once
// How good a DEM's heights are said to be, as every answer repeats it.

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "proto/tile/layer_json.h"
#include "terrain/geo/vertical_datum.h"

namespace tind::api {

/// {"kind": "le90", "m": 4}
nlohmann::ordered_json accuracy_json(const VerticalAccuracy&);

/// Of one DEM the same; of layers by their names: {"town": {"kind": "rmse", "m": 0.3}}.
nlohmann::ordered_json accuracies_json(const std::vector<proto::StatedAccuracy>&);

/// As it is said: "le90=4"; "4" of a kind that nobody named.
std::string accuracy_text(const VerticalAccuracy&);

}  // namespace tind::api
