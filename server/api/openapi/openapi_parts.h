#pragma once
// What the OpenAPI document says once: of the daemon, and of what many operations share.

#include <nlohmann/json_fwd.hpp>
#include <string_view>

#include "server/http/operation.h"

namespace tind::api {

/// Schemas that operations refer to.
inline constexpr const char* kProblemRef = R"({"$ref": "#/components/schemas/Problem"})";
inline constexpr const char* kJobRef = R"({"$ref": "#/components/schemas/Job"})";
inline constexpr const char* kGeoJsonRef = R"({"$ref": "#/components/schemas/GeoJson"})";

/// A parameter of paths that means the same everywhere ("dataset", "z"); null: none of that name.
const http::PathParameter* common_path_parameter(std::string_view name);

/// {openapi, info, servers, tags}
nlohmann::ordered_json openapi_head();

/// {schemas, responses, securitySchemes}
nlohmann::ordered_json openapi_components();

}  // namespace tind::api
