#include "server/api/extensions.h"

#include <algorithm>

namespace tind::api {
namespace {

constexpr std::string_view kKey = "extensions=";

/// "octvertexnormals-metadata", in quotes or not.
void add_names(std::string_view list, proto::Extensions& asked) {
  if (list.starts_with('"')) list.remove_prefix(1);
  while (!list.empty()) {
    const std::string_view name = list.substr(0, list.find('-'));
    list.remove_prefix(std::min(name.size() + 1, list.size()));
    asked.normals |= name == "octvertexnormals";
    asked.water_mask |= name == "watermask";
    asked.metadata |= name == "metadata";
  }
}

/// Every value of `extensions=` in text, which begins a word and ends at one of `ends`.
void add_all(std::string_view text, std::string_view ends, proto::Extensions& asked) {
  for (auto at = text.find(kKey); at != text.npos; at = text.find(kKey)) {
    const bool begins = at == 0 || ends.find(text[at - 1]) != ends.npos;
    text.remove_prefix(at + kKey.size());
    if (begins) add_names(text.substr(0, text.find_first_of(ends, 1)), asked);
  }
}

}  // namespace

proto::Extensions asked_extensions(const http::Fields& fields, std::string_view query) {
  proto::Extensions asked;
  add_all(query, "&", asked);
  fields.each("accept", [&](std::string_view value) { add_all(value, ";, \t\"", asked); });
  return asked;
}

}  // namespace tind::api
