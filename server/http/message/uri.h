#pragma once
// The two halves of a request target, decoded once and never again.

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace tind::http {

/// "a%20b" -> "a b". Nothing for a '%' without two hex digits, and for an encoded control byte or
/// slash: neither can be part of any name here, and both are how paths are smuggled past a check.
std::optional<std::string> percent_decode(std::string_view);

struct Parameter {
  std::string name, value;
};

/// "lon=7.5&lat=46" in order. '+' is a plus sign, and %2F a slash: a query is no path, and URIs in
/// it are sent like that. Nothing when an escape is bad, and for more
/// parameters than anything here has (of a form of megabytes they would take 30 times as much
/// memory): kBadQuery. Empty parts ("a=1&&b=2") are skipped; "a" is a name with an empty value.
inline constexpr std::size_t kMostParameters = 100;
inline constexpr const char* kBadQuery = "holds a bad percent-escape, or more than 100 parameters";
std::optional<std::vector<Parameter>> parse_query(std::string_view);

}  // namespace tind::http
