#include "server/api/ogc/error_page.h"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "server/api/ogc/document.h"
#include "server/api/ogc/page.h"
#include "server/api/tiles/web_map.h"
#include "server/http/message/uri.h"

namespace tind::api::ogc {
namespace {

/// What the path begins with, "/collections" of "/collections/alps"; empty: it is no address of
/// OGC API.
std::string_view above(std::string_view path) {
  constexpr std::string_view kAll[] = {"/collections", "/processes", "/jobs", "/tileMatrixSets",
                                       "/conformance"};
  const std::string_view first = path.substr(0, path.find('/', 1));
  return std::ranges::find(kAll, first) == std::end(kAll) ? std::string_view() : first;
}

/// "f" as it was sent, also beside what is wrong.
std::string asked_form(std::string_view query) {
  const auto parameters = http::parse_query(query);
  if (!parameters) return {};
  const auto f = std::ranges::find(*parameters, "f", &http::Parameter::name);
  return f == parameters->end() || (f->value != "json" && f->value != "html") ? "" : f->value;
}

/// All fields of a reply but those that its body decides, and those that every reply gets.
std::vector<http::Header> kept_fields(std::string_view head) {
  constexpr std::string_view kOthers[] = {"Content-Type", "Content-Length",
                                          "X-Content-Type-Options"};
  std::vector<http::Header> fields;
  for (; !head.empty(); head.remove_prefix(std::min(head.find('\n') + 1, head.size()))) {
    const std::string_view line = head.substr(0, head.find("\r\n"));
    const std::size_t colon = line.find(": ");
    if (colon == line.npos) break;
    if (std::ranges::find(kOthers, line.substr(0, colon)) == std::end(kOthers))
      fields.push_back({line.substr(0, colon), line.substr(colon + 2)});
  }
  return fields;
}

http::Reply page_reply(const http::Reply& reply, const PagePlace& place) {
  Ordered problem = Ordered::parse(reply.payload->body(), nullptr, false);
  if (!problem.is_object() || !problem.contains("title")) return reply;
  problem["description"] = problem.value("detail", "");
  for (const char* const name : {"type", "detail"}) problem.erase(name);
  const std::string_view head =
      std::string_view(reply.payload->bytes).substr(0, reply.payload->head);
  std::vector<http::Header> fields = kept_fields(head);
  fields.push_back({"Vary", "Accept"});
  http::Reply page =
      http::make_reply(reply.status, "text/html; charset=utf-8", page_of(problem, place), fields);
  page.close = reply.close;
  page.request_id = reply.request_id;
  return page;
}

}  // namespace

http::Router::ErrorForm error_form(const http::Request& request) {
  const http::Method method = request.head.method;
  if (method != http::Method::get && method != http::Method::head) return {};
  const std::string_view first = above(request.path);
  if (first.empty()) return {};
  if (form_of(asked_form(request.head.query), request.head.fields) != Form::html) return {};
  // The way on the page ends at what is there for certain.
  return [place = PagePlace{std::string(first), origin_of(request)}](const http::Reply& reply) {
    return page_reply(reply, place);
  };
}

}  // namespace tind::api::ogc
