#pragma once
// From a path to the handler that answers it.

#include <cstddef>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include "server/http/message/request.h"

namespace tind::http {

/// What a POST must bring. All of it is looked at before a byte of its body is read, so that who
/// asks for nothing that there is costs no memory.
struct BodyRules {
  std::size_t max_bytes = 0;  // with a Content-Length
  /// What Content-Type must say (else 415); empty: anything. A type that HTML forms can send would
  /// let any web page send the request without asking first (CORS).
  std::string_view type = "application/json";
  /// From the head alone: the reply that refuses it (404: no such dataset), or nothing.
  std::function<std::optional<Reply>(const Request&)> refuse = {};
};

/// A route's pattern is a path whose segments are literals or hold one {name} with an optional
/// suffix, "/terrain/{dataset}/{z}/{x}/{y}.terrain". A last segment "{name...}" takes the rest of
/// the path. The first route that fits wins. GET handlers also answer HEAD (the body is left out on
/// the way to the wire); OPTIONS is answered for every route.
class Router {
 public:
  void get(std::string pattern, Handler);
  /// The same, and answered for clients that are refused everything else because there are too many
  /// of them: for whoever watches the server.
  void get_always(std::string pattern, Handler);
  void post(std::string pattern, BodyRules, Handler);
  /// Asked of every request, before anything else; its reply is the final one.
  void refuse_first(std::function<std::optional<Reply>(const Request&)> refuse) {
    refuse_first_ = std::move(refuse);
  }

  struct Route {
    std::string pattern;
    std::vector<std::string> segments;
    Handler get, post;
    bool always = false;
    BodyRules body;
    std::string allow;  // "GET, HEAD, OPTIONS"
  };
  struct Match {
    const Handler* handler;
    std::size_t max_body;
    bool always;
  };
  /// Fills request.matched. The reply is the final one: 404, 405 with Allow, what OPTIONS gets, or
  /// what the rules for a body say.
  std::variant<Match, Reply> route(Request&) const;

 private:
  Route& at(const std::string& pattern);
  std::vector<Route> routes_;
  std::function<std::optional<Reply>(const Request&)> refuse_first_;
};

}  // namespace tind::http
