#pragma once
// JSON as text, from strangers and for them. nlohmann/json reads any depth, but copies, compares
// and writes by recursion, and throws at text that is not UTF-8: neither may end the program.

#include <cstddef>
#include <cstdint>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace tind::json {

/// Arrays and objects within each other, at most.
inline constexpr int kDeepest = 100;

/// Members of one object, at most, where their order is kept: ordered_json looks for each name
/// among all before it. 8 MiB of objects of a thousand take a second, of one of a million a quarter
/// of an hour.
inline constexpr std::size_t kMostOrderedMembers = 1000;

/// Discarded (is_discarded()) where the text is no JSON, or nested more deeply than kDeepest. Json:
/// nlohmann::json or nlohmann::ordered_json, that also where an object has more members than
/// kMostOrderedMembers.
template <class Json>
Json parse(std::string_view text);
template <class Json>
Json parse(const std::vector<std::uint8_t>& text) {
  return parse<Json>(std::string_view(reinterpret_cast<const char*>(text.data()), text.size()));
}

/// Is it for that alone that parse() takes no text, or would be?
bool too_deep(std::string_view text);

/// A name that some object has twice: one reader takes the first of its values, another the last
/// (RFC 8259, section 4). None, too, where the text is no JSON. Reads the text once.
std::optional<std::string> name_said_twice(std::string_view text);

/// Of the object with most of them, names said twice counted twice; of an object that is no deeper
/// than kDeepest. Reads the text once and builds nothing.
std::size_t most_members(std::string_view text);

/// So many values, those in others counted too, or a few more; exact where it is JSON. Reads the
/// text once and builds nothing: a tree of it takes up to 100 bytes a value, two dozen times what
/// the text of one does.
std::size_t count_values(std::string_view text);

/// The same of what was built: fewer where a name is said twice, of which one value counts.
template <class Json>
std::size_t values_of(const Json&);

/// `indent`: blanks a level; -1: one line. Bytes that are not UTF-8 become U+FFFD.
std::string to_text(const nlohmann::json&, int indent = -1);
std::string to_text(const nlohmann::ordered_json&, int indent = -1);

}  // namespace tind::json
