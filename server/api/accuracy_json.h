#pragma once
// How good a DEM's heights are said to be, as every answer repeats it.

#include <nlohmann/json_fwd.hpp>

#include "terrain/geo/vertical_datum.h"

namespace tind::api {

/// {"kind": "le90", "m": 4}
nlohmann::ordered_json accuracy_json(const VerticalAccuracy&);

}  // namespace tind::api
