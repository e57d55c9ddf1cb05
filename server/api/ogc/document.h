#pragma once
// Documents of OGC API: the same as JSON for programs and as a plain page for people, by `f` or by
// Accept, with links to itself and to its other form.

#include <expected>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <string_view>

#include "server/http/message/negotiate.h"
#include "server/http/message/query_numbers.h"
#include "server/http/message/request.h"
#include "server/http/operation.h"

namespace tind::api::ogc {

using Ordered = nlohmann::ordered_json;

inline constexpr const char* kJson = "application/json";
inline constexpr const char* kHtml = "text/html";

/// Relations of OGC's register.
inline constexpr const char* kRelConformance = "http://www.opengis.net/def/rel/ogc/1.0/conformance";
inline constexpr const char* kRelCoverage = "http://www.opengis.net/def/rel/ogc/1.0/coverage";
inline constexpr const char* kRelJobs = "http://www.opengis.net/def/rel/ogc/1.0/job-list";
inline constexpr const char* kRelProcesses = "http://www.opengis.net/def/rel/ogc/1.0/processes";
inline constexpr const char* kRelTilesetsMap =
    "http://www.opengis.net/def/rel/ogc/1.0/tilesets-map";
inline constexpr const char* kRelTilesetsCoverage =
    "http://www.opengis.net/def/rel/ogc/1.0/tilesets-coverage";
inline constexpr const char* kRelTilingScheme =
    "http://www.opengis.net/def/rel/ogc/1.0/tiling-scheme";
inline constexpr const char* kRelTilingSchemes =
    "http://www.opengis.net/def/rel/ogc/1.0/tiling-schemes";

enum class Form { json, html };
/// As `f` says, or where it is empty Accept.
Form form_of(std::string_view f, const http::Fields&);

/// The parameter `f`, which says so.
http::QueryWord form_word();

/// What a document is for: a copy, so it may outlive the request.
struct Asked {
  Form form = Form::json;
  std::string origin;  // "http://127.0.0.1:8080", of all its links
  std::string path;    // "/collections/alps"
  std::string target;  // as it was sent
  http::Conditions client;

  std::string url(std::string_view to) const { return origin + std::string(to); }
  /// Of the document itself, with what its query asked for.
  std::string own_url() const;
};

/// What such a document's route says of itself. `schema`: of its JSON. A list of datasets shows
/// what the key is for.
http::Operation document_operation(const char* id, const char* summary, const char* schema);

/// REQUIRES: a route with a document_operation(). `f` (json, html), or Accept. The error is the 400
/// of any other parameter.
std::expected<Asked, http::Reply> read_asked(const http::Request&);
/// The same of a request whose parameters somebody else has read. `f`: json, html or empty.
Asked asked_of(const http::Request&, std::string_view f);

/// {href, rel, type, title}; the address absolute.
Ordered link(const Asked&, std::string_view to, const char* rel, const char* type,
             const std::string& title);
/// The same with {variables} in the address.
Ordered template_link(const Asked&, std::string_view to, const char* rel, const char* type,
                      const std::string& title);

/// The document as it was asked for, and its type: JSON, or its page.
struct Shown {
  const char* type;
  std::string text;
};
Shown shown(const Asked&, const Ordered& document);

/// A 200, or a 304. Its `links` begin with those to itself and to its other form.
http::Reply document_reply(const Asked&, Ordered document);

}  // namespace tind::api::ogc
