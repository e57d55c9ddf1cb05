#pragma once
// A document of OGC API as a page for people: its members as tables, its links as links. One
// template for all of them: no script, nothing from another host, light or dark as the reader has
// it, from the width of a phone on.

#include <nlohmann/json_fwd.hpp>
#include <string>

namespace tind::api::ogc {

struct PagePlace {
  std::string path;    // "/collections/alps": the way that stands above
  std::string origin;  // only links that begin with it, or are paths, can be followed
};

/// UTF-8. Whatever the document says is text, never markup. Members that only programs have a use
/// for ("domainSet", "parameter_names", "data_queries", ...) are left out.
std::string page_of(const nlohmann::ordered_json& document, const PagePlace&);

}  // namespace tind::api::ogc
