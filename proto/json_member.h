#pragma once
// Members of JSON that somebody else wrote: this one, of this type, in this range, or nothing.
// The caller says what is wrong, in the words of its format. Costs nlohmann/json.hpp: for .cpp
// files.

#include <cstdint>
#include <limits>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>

namespace tind::json {

/// Null where it is not there, or `object` is none.
template <class Json>
const Json* member(const Json& object, const char* name) {
  if (!object.is_object()) return nullptr;
  const auto found = object.find(name);
  return found == object.end() ? nullptr : &*found;
}

template <class Json>
std::optional<double> as_number(const Json& value,
                                double low = -std::numeric_limits<double>::infinity(),
                                double high = std::numeric_limits<double>::infinity()) {
  if (!value.is_number()) return {};
  const double x = value.template get<double>();
  if (!(x >= low && x <= high)) return {};
  return x;
}

/// 3, not 3.0.
template <class Json>
std::optional<std::int64_t> as_whole(const Json& value,
                                     std::int64_t low = std::numeric_limits<std::int64_t>::min(),
                                     std::int64_t high = std::numeric_limits<std::int64_t>::max()) {
  if (!value.is_number_integer()) return {};
  const auto n = value.template get<std::int64_t>();
  const bool wrapped = value.is_number_unsigned() && n < 0;
  if (wrapped || n < low || n > high) return {};
  return n;
}

template <class Json>
std::optional<std::string> as_text(const Json& value) {
  if (!value.is_string()) return {};
  return value.template get<std::string>();
}

// The same of a member.

template <class Json>
std::optional<double> number(const Json& object, const char* name,
                             double low = -std::numeric_limits<double>::infinity(),
                             double high = std::numeric_limits<double>::infinity()) {
  const Json* const value = member(object, name);
  return value ? as_number(*value, low, high) : std::nullopt;
}

template <class Json>
std::optional<std::int64_t> whole(const Json& object, const char* name,
                                  std::int64_t low = std::numeric_limits<std::int64_t>::min(),
                                  std::int64_t high = std::numeric_limits<std::int64_t>::max()) {
  const Json* const value = member(object, name);
  return value ? as_whole(*value, low, high) : std::nullopt;
}

/// Of a member that may be left out: then `otherwise`. Nothing where it is there and is wrong.
template <class Json>
std::optional<std::int64_t> whole_or(const Json& object, const char* name, std::int64_t otherwise,
                                     std::int64_t low, std::int64_t high) {
  const Json* const value = member(object, name);
  return value ? as_whole(*value, low, high) : otherwise;
}

template <class Json>
std::optional<std::string> text(const Json& object, const char* name) {
  const Json* const value = member(object, name);
  return value ? as_text(*value) : std::nullopt;
}

}  // namespace tind::json
