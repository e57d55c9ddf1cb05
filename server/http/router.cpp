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

/// What a page from elsewhere may do: where that is every page there is, none removes anything.
std::string_view allow_pages(std::string_view allow, bool any_origin) {
  constexpr std::string_view kDelete = "DELETE, ";  // the first of the alphabet
  if (any_origin && allow.starts_with(kDelete)) allow.remove_prefix(kDelete.size());
  return allow;
}

Reply options_reply(const Request& request, std::string_view allow, std::string_view accept_post) {
  std::vector<Header> headers = {
      {"Allow", allow},
      {"Access-Control-Allow-Methods", allow_pages(allow, request.any_origin)},
      {"Access-Control-Allow-Headers", "*, Authorization"},
      {"Access-Control-Max-Age", "86400"}};
  if (!accept_post.empty()) headers.push_back({"Accept-Post", accept_post});
  return make_reply(204, {}, {}, headers);
}

/// Is the media type of the Content-Type, without its parameters, one of `types`?
bool says_type(const Fields& fields, std::string_view types) {
  const std::string said = media_type(fields.find("content-type").value_or(""));
  while (!types.empty()) {
    const std::size_t end = std::min(types.find(", "), types.size());
    if (types.substr(0, end) == said) return true;
    types.remove_prefix(std::min(end + 2, types.size()));
  }
  return false;
}

/// "a, b" as "a or b".
std::string alternatives(std::string_view types) {
  std::string text;
  for (; !types.empty(); types.remove_prefix(std::min(types.find(' '), types.size()))) {
    if (types.starts_with(' ')) types.remove_prefix(1);
    const std::string_view type = types.substr(0, types.find(','));
    text += (text.empty() ? "" : " or ") + std::string(type);
  }
  return text;
}

std::optional<Reply> refused(const Router::Route& route, const Request& request) {
  const BodyRules& rules = route.body;
  if (rules.refuse)
    if (auto reply = rules.refuse(request)) return reply;
  if (rules.type.empty() || says_type(request.head.fields, rules.type)) return std::nullopt;
  return problem_reply(
      {.status = 415,
       .detail = "The body must be sent as Content-Type: " + alternatives(rules.type) + ".",
       .instance = request.head.target,
       .errors = {},
       .headers = {{"Accept-Post", rules.type}}});
}

const std::shared_ptr<const Operation> kUndescribed = std::make_shared<const Operation>();

Router::Action undescribed(Handler handler) { return {std::move(handler), kUndescribed, false}; }

Router::Action described(Operation operation, Handler handler) {
  return {std::move(handler), std::make_shared<const Operation>(std::move(operation)), true};
}

}  // namespace

std::string media_type(std::string_view said) {
  said = said.substr(0, said.find(';'));
  while (said.ends_with(' ') || said.ends_with('\t')) said.remove_suffix(1);
  std::string type(said);
  for (char& c : type)
    if (c >= 'A' && c <= 'Z') c = char(c + 32);
  return type;
}

Router::Route& Router::at(const std::string& pattern) {
  for (Route& route : routes_)
    if (route.pattern == pattern) return route;
  assert(pattern.starts_with('/'));
  Route& route = routes_.emplace_back();
  route.pattern = pattern;
  std::string_view rest = std::string_view(route.pattern).substr(1);
  bool more = true;
  std::size_t names = 0;
  while (more) {
    more = rest.find('/') != rest.npos;
    const std::string& segment = route.segments.emplace_back(next_segment(rest));
    if (!segment.starts_with('{')) continue;
    if (segment.starts_with("{dataset}") || segment.starts_with("{collection"))
      route.dataset = names;
    ++names;
  }
  return route;
}

/// In the order of the alphabet, as it is said in Allow.
void Router::allow(Route& route) {
  route.allow.clear();
  const auto add = [&](bool there, std::string_view methods) {
    if (there) (route.allow += route.allow.empty() ? "" : ", ") += methods;
  };
  add(bool(route.del), "DELETE");
  add(bool(route.get), "GET, HEAD");
  add(true, "OPTIONS");
  add(bool(route.post), "POST");
}

void Router::get(const std::string& pattern, Handler handler) {
  Route& route = at(pattern);
  route.get = undescribed(std::move(handler));
  allow(route);
}

void Router::get(const std::string& pattern, Operation operation, Handler handler) {
  Route& route = at(pattern);
  route.get = described(std::move(operation), std::move(handler));
  allow(route);
}

void Router::get_always(const std::string& pattern, Operation operation, Handler handler) {
  at(pattern).always = true;
  get(pattern, std::move(operation), std::move(handler));
}

void Router::post(const std::string& pattern, BodyRules rules, Handler handler) {
  Route& route = at(pattern);
  route.post = undescribed(std::move(handler));
  route.body = std::move(rules);
  allow(route);
}

void Router::post(const std::string& pattern, Operation operation, BodyRules rules,
                  Handler handler) {
  Route& route = at(pattern);
  route.post = described(std::move(operation), std::move(handler));
  route.body = std::move(rules);
  allow(route);
}

void Router::del(const std::string& pattern, Handler handler) {
  Route& route = at(pattern);
  route.del = undescribed(std::move(handler));
  allow(route);
}

void Router::del(const std::string& pattern, Operation operation, Handler handler) {
  Route& route = at(pattern);
  route.del = described(std::move(operation), std::move(handler));
  allow(route);
}

const Router::Action* Router::action_of(const Route& route, Method method) {
  switch (method) {
    case Method::get:
    case Method::head:
      return route.get ? &route.get : nullptr;
    case Method::post:
      return route.post ? &route.post : nullptr;
    case Method::delete_:
      return route.del ? &route.del : nullptr;
    default:
      return nullptr;
  }
}

std::optional<Reply> Router::refuse(Request& request, const Route& route,
                                    const Action& action) const {
  request.operation = action.operation.get();
  if (gate_) {
    const std::string_view dataset =
        route.dataset == std::string::npos ? std::string_view() : request.matched[route.dataset];
    if (auto reply = gate_->refuse(request, request.operation, dataset)) return reply;
  }
  if (&action == &route.post) return refused(route, request);
  return std::nullopt;
}

std::variant<Router::Match, Reply> Router::route(Request& request) const {
  const Method method = request.head.method;
  if (refuse_first_)
    if (auto reply = refuse_first_(request)) return *std::move(reply);
  if (request.path == "*") return options_reply(request, "GET, HEAD, OPTIONS", {});
  const auto route =
      std::ranges::find_if(routes_, [&](const Route& one) { return fits(one, request); });
  const bool found = route != routes_.end();
  if (found && method == Method::options)
    return options_reply(request, route->allow, route->post ? route->body.type : "");
  if (const Action* const asked = found ? action_of(*route, method) : nullptr) {
    if (auto reply = refuse(request, *route, *asked)) return *std::move(reply);
    const bool posted = asked == &route->post;
    return Match{&asked->handler, posted ? route->body.max_bytes : 0, route->always && !posted};
  }
  if (gate_)
    if (auto reply = gate_->refuse(request, nullptr, {})) return *std::move(reply);
  if (!found)
    return problem_reply(
        {.status = 404, .detail = "There is no such resource.", .instance = request.head.target});
  return problem_reply({.status = 405,
                        .detail = "This resource takes " + route->allow + ".",
                        .instance = request.head.target,
                        .errors = {},
                        .headers = {{"Allow", route->allow}}});
}

}  // namespace tind::http
