#pragma once
// Answers that many operations describe alike.

#include <string>
#include <utility>
#include <vector>

#include "server/http/operation.h"

namespace tind::api {

/// Of a resource with an ETag: its bytes, or that the client has them already.
inline std::vector<http::Response> resource(std::string about, std::string type,
                                            std::string schema = {}) {
  return {{200, std::move(about), {{std::move(type), std::move(schema)}}},
          {304, "The client has it already (If-None-Match)."}};
}

inline std::vector<http::Response> json_answer(std::string about, std::string schema) {
  return {{200, std::move(about), {{"application/json", std::move(schema)}}}};
}

}  // namespace tind::api
