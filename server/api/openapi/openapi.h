#pragma once
// The table of routes as an OpenAPI 3.1 document.

#include <nlohmann/json_fwd.hpp>
#include <string>

#include "server/http/router.h"

namespace tind::api {

/// Of every route that has an operation and is not hidden, in the order of the table.
nlohmann::ordered_json openapi_document(const http::Router&);

/// Any JSON as YAML 1.2, block style; texts that could be taken for something else are quoted.
std::string to_yaml(const nlohmann::ordered_json&);

}  // namespace tind::api
