#pragma once
// From a path to the handler that answers it.

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "server/http/request.h"

namespace tind::http {

/// A route's pattern is a path whose segments are literals or hold one {name} with an optional
/// suffix, "/terrain/{dataset}/{z}/{x}/{y}.terrain". A last segment "{name...}" takes the rest of
/// the path. The first route that fits wins. GET handlers also answer HEAD (the body is left out on
/// the way to the wire); OPTIONS is answered for every route.
class Router {
 public:
  void get(std::string pattern, Handler);
  /// Bodies up to max_body bytes, with a Content-Length.
  void post(std::string pattern, std::size_t max_body, Handler);

  struct Route {
    std::string pattern;
    std::vector<std::string> segments;
    Handler get, post;
    std::size_t max_body = 0;
    std::string allow;  // "GET, HEAD, OPTIONS"
  };
  struct Match {
    const Handler* handler;
    std::size_t max_body;
  };
  /// Fills request.matched. The reply is the final one: 404, 405 with Allow, or what OPTIONS gets.
  std::variant<Match, Reply> route(Request&) const;

 private:
  Route& at(const std::string& pattern);
  std::vector<Route> routes_;
};

}  // namespace tind::http
