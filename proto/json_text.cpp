#include "proto/json_text.h"

#include <nlohmann/json.hpp>

namespace tind::json {
namespace {

/// f(c) of each character outside of strings and of the quote before each, until that is false. Of
/// what is no JSON, any answer of those who look will do.
template <class F>
void each_outside_strings(std::string_view text, F&& f) {
  bool in_string = false;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const char c = text[i];
    if (in_string) {
      if (c == '\\') ++i;
      if (c == '"') in_string = false;
    } else {
      in_string = c == '"';
      if (!f(c)) return;
    }
  }
}

template <class Json>
std::string text_of(const Json& value, int indent) {
  return value.dump(indent, ' ', false, Json::error_handler_t::replace);
}

}  // namespace

bool too_deep(std::string_view text) {
  int depth = 0;
  each_outside_strings(text, [&](char c) {
    if (c == '[' || c == '{') ++depth;
    if (c == ']' || c == '}') --depth;
    return depth <= kDeepest;
  });
  return depth > kDeepest;
}

template <class Json>
Json parse(std::string_view text) {
  // To its lexer a NUL is the end, whatever follows.
  if (text.contains('\0') || too_deep(text)) return Json(Json::value_t::discarded);
  return Json::parse(text, nullptr, false);
}

std::size_t count_values(std::string_view text) {
  // Each list and each object has one more value than commas, or none.
  std::size_t count = 1;
  char before = 0;
  each_outside_strings(text, [&](char c) {
    if (c == ' ' || c == '\t' || c == '\n' || c == '\r') return true;
    if (c == ',' || c == '[' || c == '{') ++count;
    if ((c == ']' && before == '[') || (c == '}' && before == '{')) --count;
    before = c;
    return true;
  });
  return count;
}

template nlohmann::json parse(std::string_view);
template nlohmann::ordered_json parse(std::string_view);

std::string to_text(const nlohmann::json& value, int indent) { return text_of(value, indent); }
std::string to_text(const nlohmann::ordered_json& value, int indent) {
  return text_of(value, indent);
}

}  // namespace tind::json
