#pragma once
// What is wrong with a body that json::parse() does not take.

#include <string_view>

#include "proto/json_text.h"

namespace tind::api {

inline const char* why_no_json(std::string_view text) {
  return json::too_deep(text) ? "has more than 100 objects and lists in one another"
                              : "is not JSON";
}

}  // namespace tind::api
