#pragma once
// Everything that goes wrong, on the wire: RFC 9457 problem documents, made in this one place.

#include <string>
#include <string_view>
#include <vector>

#include "server/http/message/reply.h"
#include "terrain/base/result.h"

namespace tind::http {

/// Which parameter is wrong, and how.
struct ParameterProblem {
  std::string parameter, detail;
};

struct Problem {
  int status = 500;
  std::string detail;              // one line for a person
  std::string_view instance = {};  // the request target it is about; bytes as sent
  std::vector<ParameterProblem> errors = {};
  std::vector<Header> headers = {};       // e.g. Allow, Retry-After
  std::string_view type = "about:blank";  // a URI that a standard has for it
};

/// application/problem+json {type, title, status, detail, instance, errors, requestId}, not to be
/// cached. The request id is new with each call, and logged with 5xx.
Reply problem_reply(const Problem&);
/// The same of a 5xx with its cause, which is for the log.
Reply problem_reply(const Problem&, std::string_view cause);
/// 400: parameters are wrong. REQUIRES: one or more.
Reply problem_reply(const std::vector<ParameterProblem>&, std::string_view instance);

/// The one table from what went wrong in the library to what HTTP calls it.
int status_of(Errc);

/// The problem for an error of the library. Its words (paths, drivers) are for the log; a client is
/// told them only of its own mistakes. A full queue says when to try again.
Reply problem_reply(const Error&, std::string_view instance);

}  // namespace tind::http
