#include "proto/json_text.h"

#include <nlohmann/json.hpp>

namespace tind::json {
namespace {

/// Counted without reading the rest: of what is no JSON, any answer will do.
bool too_deep(std::string_view text) {
  int depth = 0;
  bool in_string = false;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const char c = text[i];
    if (in_string) {
      if (c == '\\') ++i;
      if (c == '"') in_string = false;
    } else if (c == '"') {
      in_string = true;
    } else if (c == '[' || c == '{') {
      if (++depth > kDeepest) return true;
    } else if (c == ']' || c == '}') {
      --depth;
    }
  }
  return false;
}

template <class Json>
std::string text_of(const Json& value, int indent) {
  return value.dump(indent, ' ', false, Json::error_handler_t::replace);
}

}  // namespace

template <class Json>
Json parse(std::string_view text) {
  if (too_deep(text)) return Json(Json::value_t::discarded);
  return Json::parse(text, nullptr, false);
}

template nlohmann::json parse(std::string_view);
template nlohmann::ordered_json parse(std::string_view);

std::string to_text(const nlohmann::json& value, int indent) { return text_of(value, indent); }
std::string to_text(const nlohmann::ordered_json& value, int indent) {
  return text_of(value, indent);
}

}  // namespace tind::json
