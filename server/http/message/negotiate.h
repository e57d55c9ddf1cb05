#pragma once
// What a client can read, and what it already has (RFC 9110, sections 12 and 13).

#include <string>
#include <string_view>

#include "server/http/message/request_parser.h"

namespace tind::http {

/// What decides between the forms of a representation; a copy, so it may outlive the request.
struct Conditions {
  Conditions() = default;
  explicit Conditions(const Fields&);
  explicit Conditions(const RequestHead&);  // of a GET; parts of what HEAD asks for are not there

  /// If-Match names none of a resource's tags: 412, before all else.
  bool excludes(std::string_view etag, std::string_view gzip_etag = {}) const;

  bool gzip = false;       // see wants_gzip
  std::string match;       // If-Match, empty where the request has none
  std::string none_match;  // If-None-Match, empty where the request has none
  std::string range;       // Range, of a GET; empty where there is none, or more than one
  std::string if_range;    // If-Range
};

/// True when Accept-Encoding allows gzip (q > 0, by name or by *) and does not prefer identity.
/// No such field: false, because clients that say nothing often cannot.
bool wants_gzip(const Fields&);

/// True when `none_match` is "*" or lists `etag` (with its quotes); weak comparison. What is
/// malformed lists nothing.
bool lists_etag(std::string_view none_match, std::string_view etag);
/// The same by strong comparison, as If-Match asks for: weak tags are like none.
bool lists_strong_etag(std::string_view match, std::string_view etag);

}  // namespace tind::http
