#pragma once
// Enums that people type and programs record: one table of names each, read and written here only.
//
//   template <>
//   struct EnumNames<Side> {
//     static constexpr const char* kWhat = "side";
//     static constexpr std::pair<Side, const char*> kAll[] = {{Side::both, "both"}, ...};
//   };
//
// The names are part of what users see (options, records, JSON): a value may be renamed, a name
// not.

#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "terrain/base/result.h"

namespace tind {

/// Specialised beside the enum; kAll has every value, in the order in which they are offered.
template <class E>
struct EnumNames;

template <class E>
concept NamedEnum = requires {
  EnumNames<E>::kAll;
};

template <NamedEnum E>
std::string name_of(E value) {
  for (const auto& [known, name] : EnumNames<E>::kAll)
    if (known == value) return name;
  return {};
}

/// Nothing when `text` is no name; for files that others wrote.
template <NamedEnum E>
std::optional<E> enum_named(std::string_view text) {
  for (const auto& [value, name] : EnumNames<E>::kAll)
    if (name == text) return value;
  return {};
}

template <NamedEnum E>
std::vector<std::string> enum_names() {
  std::vector<std::string> names;
  for (const auto& entry : EnumNames<E>::kAll) names.push_back(entry.second);
  return names;
}

/// Fails (invalid_argument), naming all choices: "there is no side 'left': choose both, above or
/// below".
template <NamedEnum E>
Result<E> parse_enum(std::string_view text) {
  if (const auto value = enum_named<E>(text)) return *value;
  const std::vector<std::string> names = enum_names<E>();
  std::string all = names[0];
  for (std::size_t i = 1; i < names.size(); ++i)
    all += (i + 1 < names.size() ? ", " : " or ") + names[i];
  return fail(Errc::invalid_argument, std::string("there is no ") + EnumNames<E>::kWhat + " '" +
                                          std::string(text) + "': choose " + all);
}

}  // namespace tind
