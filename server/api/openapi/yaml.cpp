// JSON as YAML 1.2 in block style. All texts but plain words are in double quotes as in JSON, which
// YAML reads alike: so no text is taken for a number, a date or a comment.

#include <algorithm>
#include <cctype>
#include <nlohmann/json.hpp>

#include "server/api/openapi/openapi.h"

namespace tind::api {
namespace {

using Ordered = nlohmann::ordered_json;

/// Letters alone, and no word that means something: true, null, yes, ~.
bool is_plain(const std::string& text) {
  static const char* const kMeaning[] = {"true", "false", "null", "yes", "no",
                                         "on",   "off",   "y",    "n"};
  std::string lower;
  for (const unsigned char c : text) {
    if (!std::isalpha(c) && !(c == '_' && !lower.empty())) return false;
    lower += char(std::tolower(c));
  }
  return !lower.empty() && std::ranges::find(kMeaning, lower) == std::end(kMeaning);
}

std::string scalar(const Ordered& json) {
  if (json.is_string() && is_plain(json.get_ref<const std::string&>()))
    return json.get<std::string>();
  return json.dump();
}

bool is_block(const Ordered& json) { return json.is_structured() && !json.empty(); }

void write(const Ordered& json, std::size_t indent, std::string& out);

/// After "key:" or "-".
void write_value(const Ordered& json, std::size_t indent, std::string& out) {
  if (!is_block(json)) {
    out += " " + scalar(json) + "\n";
    return;
  }
  out += "\n";
  write(json, indent, out);
}

void write(const Ordered& json, std::size_t indent, std::string& out) {
  const std::string margin(indent, ' ');
  if (json.is_array()) {
    for (const Ordered& item : json) {
      out += margin + "-";
      write_value(item, indent + 2, out);
    }
    return;
  }
  for (const auto& [key, value] : json.items()) {
    out += margin + scalar(key) + ":";
    write_value(value, indent + 2, out);
  }
}

}  // namespace

std::string to_yaml(const Ordered& json) {
  std::string out;
  if (is_block(json))
    write(json, 0, out);
  else
    out = scalar(json) + "\n";
  return out;
}

}  // namespace tind::api
