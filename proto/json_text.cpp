#include "proto/json_text.h"

#include <algorithm>
#include <array>
#include <nlohmann/json.hpp>
#include <span>
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

/// How a text is built, by its brackets and colons; of what is no JSON, anything.
struct Shape {
  int deepest = 0;  // kDeepest + 1: deeper than it may be, and not looked at further
  std::size_t most_members = 0;
};
Shape shape_of(std::string_view text) {
  Shape shape;
  std::array<std::size_t, kDeepest + 2> members{};  // so far, of what is open, by its depth
  int depth = 0;
  each_outside_strings(text, [&](char c) {
    if (c == '[' || c == '{') {
      shape.deepest = std::max(shape.deepest, ++depth);
      if (depth > kDeepest) return false;
      members[std::size_t(std::max(depth, 0))] = 0;
    }
    if (c == ']' || c == '}') --depth;
    if (c == ':' && depth > 0)
      shape.most_members = std::max(shape.most_members, ++members[std::size_t(depth)]);
    return true;
  });
  return shape;
}

/// Keeps the names of the objects that are open, one behind the other.
class Names : public nlohmann::json_sax<nlohmann::json> {
 public:
  std::optional<std::string> twice;

  bool key(string_t& name) override {
    names_.push_back(std::move(name));
    return true;
  }
  bool start_object(std::size_t) override {
    first_.push_back(names_.size());
    return true;
  }
  bool end_object() override {
    const std::span own = std::span(names_).subspan(first_.back());
    std::ranges::sort(own);
    if (const auto same = std::ranges::adjacent_find(own); same != own.end()) twice = *same;
    names_.resize(first_.back());
    first_.pop_back();
    return !twice;
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
  std::vector<std::string> names_;
  std::vector<std::size_t> first_;  // of each object's
};

template <class Json>
std::string text_of(const Json& value, int indent) {
  return value.dump(indent, ' ', false, Json::error_handler_t::replace);
}

}  // namespace

bool too_deep(std::string_view text) { return shape_of(text).deepest > kDeepest; }

std::size_t most_members(std::string_view text) { return shape_of(text).most_members; }

template <class Json>
Json parse(std::string_view text) {
  // To its lexer a NUL is the end, whatever follows.
  const Shape shape = shape_of(text);
  const bool ordered = std::is_same_v<Json, nlohmann::ordered_json>;
  if (text.contains('\0') || shape.deepest > kDeepest ||
      (ordered && shape.most_members > kMostOrderedMembers))
    return Json(Json::value_t::discarded);
  return Json::parse(text, nullptr, false);
}

std::optional<std::string> name_said_twice(std::string_view text) {
  Names names;
  nlohmann::json::sax_parse(text, &names);
  return names.twice;
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

template <class Json>
std::size_t values_of(const Json& json) {
  std::size_t count = 1;
  if (json.is_structured())
    for (const Json& part : json) count += values_of(part);
  return count;
}

template nlohmann::json parse(std::string_view);
template nlohmann::ordered_json parse(std::string_view);
template std::size_t values_of(const nlohmann::json&);
template std::size_t values_of(const nlohmann::ordered_json&);

std::string to_text(const nlohmann::json& value, int indent) { return text_of(value, indent); }
std::string to_text(const nlohmann::ordered_json& value, int indent) {
  return text_of(value, indent);
}

}  // namespace tind::json
