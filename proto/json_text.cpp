#include "proto/json_text.h"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <set>
#include <type_traits>

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

/// Keeps the names of the objects that are open.
class Names : public nlohmann::json_sax<nlohmann::json> {
 public:
  std::optional<std::string> twice;

  bool key(string_t& name) override {
    if (open_.back().insert(name).second) return true;
    twice = name;
    return false;
  }
  bool start_object(std::size_t) override {
    open_.emplace_back();
    return true;
  }
  bool end_object() override {
    open_.pop_back();
    return true;
  }
  bool null() override { return true; }
  bool boolean(bool) override { return true; }
  bool number_integer(number_integer_t) override { return true; }
  bool number_unsigned(number_unsigned_t) override { return true; }
  bool number_float(number_float_t, const string_t&) override { return true; }
  bool string(string_t&) override { return true; }
  bool binary(binary_t&) override { return true; }
  bool start_array(std::size_t) override { return true; }
  bool end_array() override { return true; }
  bool parse_error(std::size_t, const std::string&, const nlohmann::json::exception&) override {
    return false;
  }

 private:
  std::vector<std::set<std::string>> open_;
};

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
  if constexpr (std::is_same_v<Json, nlohmann::ordered_json>)
    if (most_members(text) > kMostOrderedMembers) return Json(Json::value_t::discarded);
  return Json::parse(text, nullptr, false);
}

std::optional<std::string> name_said_twice(std::string_view text) {
  Names names;
  nlohmann::json::sax_parse(text, &names);
  return names.twice;
}

std::size_t most_members(std::string_view text) {
  std::size_t most = 0;
  std::vector<std::size_t> open;  // of each object so far: a colon a member, and none in lists
  each_outside_strings(text, [&](char c) {
    if (c == '{') open.push_back(0);
    if (c == '}' && !open.empty()) open.pop_back();
    if (c == ':' && !open.empty()) most = std::max(most, ++open.back());
    return open.size() <= std::size_t(kDeepest);
  });
  return most;
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
