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
#include "server/http/operation.h"

namespace tind::http {

/// What a POST must bring. All of it is looked at before a byte of its body is read, so that who
/// asks for nothing that there is costs no memory.
struct BodyRules {
  std::size_t max_bytes = 0;  // with a Content-Length
  /// What Content-Type must say (else 415): one of these, with ", " between; empty: anything. A
  /// type that HTML forms can send would let any web page send the request without asking first
  /// (CORS).
  std::string_view type = "application/json";
  /// From the head alone: the reply that refuses it (404: no such dataset), or nothing.
  std::function<std::optional<Reply>(const Request&)> refuse = {};
};

/// The media type that a Content-Type says, without its parameters, in small letters.
std::string media_type(std::string_view content_type);

/// Who may ask, and how often. Of every request but OPTIONS, before its handler and its body.
class Gate {
 public:
  virtual ~Gate() = default;
  /// `operation`: null where no route takes the request. `dataset`: that the path names; empty: it
  /// names none. Fills request.access and request.fields; or the reply that refuses it.
  virtual std::optional<Reply> refuse(Request&, const Operation* operation,
                                      std::string_view dataset) const = 0;
};

/// A route's pattern is a path whose segments are literals or hold one {name} with an optional
/// suffix, "/terrain/{dataset}/{z}/{x}/{y}.terrain". A last segment "{name...}" takes the rest of
/// the path. The first route that fits wins. GET handlers also answer HEAD (the body is left out on
/// the way to the wire); OPTIONS is answered for every route.
class Router {
 public:
  /// Without an Operation a route works, is in no document, and needs the scope `read`.
  void get(const std::string& pattern, Handler);
  void get(const std::string& pattern, Operation, Handler);
  /// The same, and answered for clients that are refused everything else because there are too many
  /// of them: for whoever watches the server.
  void get_always(const std::string& pattern, Operation, Handler);
  void post(const std::string& pattern, BodyRules, Handler);
  void post(const std::string& pattern, Operation, BodyRules, Handler);
  void del(const std::string& pattern, Handler);
  void del(const std::string& pattern, Operation, Handler);
  /// Asked of every request, before anything else; its reply is the final one.
  void refuse_first(std::function<std::optional<Reply>(const Request&)> refuse) {
    refuse_first_ = std::move(refuse);
  }
  /// What is made of an error for who asked; empty: it stays as it is. Outlives the request.
  using ErrorForm = std::function<Reply(const Reply&)>;
  /// Asked of requests that are refused, by the router or by a handler, and of those that are
  /// answered later.
  void form_errors(std::function<ErrorForm(const Request&)> of) { error_form_ = std::move(of); }
  ErrorForm error_form(const Request& request) const {
    return error_form_ ? error_form_(request) : ErrorForm();
  }
  /// Outlives the router; null: everybody may ask everything.
  void guard(const Gate* gate) { gate_ = gate; }

  /// What a method of a route does.
  struct Action {
    Handler handler;
    std::shared_ptr<const Operation> operation;  // never null where there is a handler
    bool described = false;                      // the operation was given
    explicit operator bool() const { return bool(handler); }
  };
  struct Route {
    std::string pattern;
    std::vector<std::string> segments;
    Action get, post, del;
    bool always = false;
    std::size_t dataset = std::string::npos;  // which of what is matched names one; npos: none
    BodyRules body;
    std::string allow;  // "GET, HEAD, OPTIONS"
  };
  struct Match {
    const Handler* handler;
    std::size_t max_body;
    bool always;
  };
  /// Fills request.matched, and what the gate knows. The reply is the final one: 404, 405 with
  /// Allow, what OPTIONS gets, or what the rules for a body say.
  std::variant<Match, Reply> route(Request&) const;
  /// The table, in the order in which it is looked through.
  const std::vector<Route>& routes() const { return routes_; }

 private:
  Route& at(const std::string& pattern);
  static void allow(Route&);
  static const Action* action_of(const Route&, Method);
  std::optional<Reply> refuse(Request&, const Route&, const Action&) const;
  std::vector<Route> routes_;
  std::function<std::optional<Reply>(const Request&)> refuse_first_;
  std::function<ErrorForm(const Request&)> error_form_;
  const Gate* gate_ = nullptr;
};

}  // namespace tind::http
