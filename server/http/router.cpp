#include "server/http/router.h"

#include <algorithm>
#include <cassert>

#include "server/http/message/problem.h"

namespace tind::http {
namespace {

constexpr std::string_view kRest = "...}";

/// The path after its leading '/', one segment at a time.
std::string_view next_segment(std::string_view& path) {
  const std::string_view segment = path.substr(0, path.find('/'));
  path.remove_prefix(std::min(segment.size() + 1, path.size()));
  return segment;
}

bool fits_segment(std::string_view pattern, std::string_view segment, Request& request,
                  std::size_t& count) {
  if (!pattern.starts_with('{')) return pattern == segment;
  const std::string_view suffix = pattern.substr(pattern.find('}') + 1);
  if (segment.size() <= suffix.size() || !segment.ends_with(suffix)) return false;
  request.matched[count++] = segment.substr(0, segment.size() - suffix.size());
  return true;
}

bool fits(const Router::Route& route, Request& request) {
  std::string_view rest = request.path.substr(1);
  std::size_t count = 0;
  bool ended = false;  // a path "/a/" has an empty last segment
  for (const std::string& pattern : route.segments) {
    if (pattern.ends_with(kRest)) {
      request.matched[count] = rest;
      return !ended;
    }
    if (ended) return false;
    const bool last = rest.find('/') == rest.npos;
    if (!fits_segment(pattern, next_segment(rest), request, count)) return false;
    ended = last;
  }
  return ended;
}

Reply options_reply(std::string_view allow, std::string_view accept_post) {
  std::vector<Header> headers = {{"Allow", allow},
                                 {"Access-Control-Allow-Methods", allow},
                                 {"Access-Control-Allow-Headers", "*, Authorization"},
                                 {"Access-Control-Max-Age", "86400"}};
  if (!accept_post.empty()) headers.push_back({"Accept-Post", accept_post});
  return make_reply(204, {}, {}, headers);
}

/// The media type of a Content-Type, without its parameters.
bool says_type(const Fields& fields, std::string_view type) {
  std::string_view said = fields.find("content-type").value_or("");
  said = said.substr(0, said.find(';'));
  while (said.ends_with(' ') || said.ends_with('\t')) said.remove_suffix(1);
  return std::ranges::equal(
      said, type, [](char a, char b) { return (a >= 'A' && a <= 'Z' ? char(a + 32) : a) == b; });
}

std::optional<Reply> refused(const Router::Route& route, const Request& request) {
  const BodyRules& rules = route.body;
  if (rules.refuse)
    if (auto reply = rules.refuse(request)) return reply;
  if (rules.type.empty() || says_type(request.head.fields, rules.type)) return std::nullopt;
  return problem_reply(
      {.status = 415,
       .detail = "The body must be sent as Content-Type: " + std::string(rules.type) + ".",
       .instance = request.head.target,
       .errors = {},
       .headers = {{"Accept-Post", rules.type}}});
}

}  // namespace

Router::Route& Router::at(const std::string& pattern) {
  for (Route& route : routes_)
    if (route.pattern == pattern) return route;
  assert(pattern.starts_with('/'));
  Route& route = routes_.emplace_back();
  route.pattern = pattern;
  std::string_view rest = std::string_view(route.pattern).substr(1);
  bool more = true;
  while (more) {
    more = rest.find('/') != rest.npos;
    route.segments.emplace_back(next_segment(rest));
  }
  return route;
}

void Router::get(std::string pattern, Handler handler) {
  Route& route = at(pattern);
  route.get = std::move(handler);
  route.allow = route.post ? "GET, HEAD, OPTIONS, POST" : "GET, HEAD, OPTIONS";
}

void Router::get_always(std::string pattern, Handler handler) {
  at(pattern).always = true;
  get(std::move(pattern), std::move(handler));
}

void Router::post(std::string pattern, BodyRules rules, Handler handler) {
  Route& route = at(pattern);
  route.post = std::move(handler);
  route.body = std::move(rules);
  route.allow = route.get ? "GET, HEAD, OPTIONS, POST" : "OPTIONS, POST";
}

std::variant<Router::Match, Reply> Router::route(Request& request) const {
  const Method method = request.head.method;
  if (refuse_first_)
    if (auto reply = refuse_first_(request)) return *std::move(reply);
  if (request.path == "*") return options_reply("GET, HEAD, OPTIONS", {});
  for (const Route& route : routes_) {
    if (!fits(route, request)) continue;
    if (method == Method::options)
      return options_reply(route.allow, route.post ? route.body.type : "");
    const bool reads = method == Method::get || method == Method::head;
    if (reads && route.get) return Match{&route.get, 0, route.always};
    if (method == Method::post && route.post) {
      if (auto reply = refused(route, request)) return *std::move(reply);
      return Match{&route.post, route.body.max_bytes, false};
    }
    return problem_reply({.status = 405,
                          .detail = "This resource takes " + route.allow + ".",
                          .instance = request.head.target,
                          .errors = {},
                          .headers = {{"Allow", route.allow}}});
  }
  return problem_reply(
      {.status = 404, .detail = "There is no such resource.", .instance = request.head.target});
}

}  // namespace tind::http
