#include "server/api/ogc/document.h"

#include <algorithm>
#include <array>
#include <nlohmann/json.hpp>

#include "proto/json_text.h"
#include "server/api/ogc/page.h"
#include "server/api/tiles/web_map.h"
#include "server/http/message/media_choice.h"
#include "server/http/message/problem.h"
#include "server/http/message/query_numbers.h"
#include "server/http/message/representation.h"

namespace tind::api::ogc {
namespace {

constexpr std::array<std::string_view, 2> kForms = {"application/json", "text/html"};

/// To itself and to the other form, before all others.
Ordered links_of(const Asked& asked, const Ordered& document) {
  const auto to = [&](Form form) {
    const bool html = form == Form::html;
    return link(asked, asked.path + (html ? "?f=html" : "?f=json"),
                form == asked.form ? "self" : "alternate", html ? kHtml : kJson,
                html ? "this document as a page" : "this document as JSON");
  };
  const Form other = asked.form == Form::json ? Form::html : Form::json;
  Ordered links = Ordered::array({to(asked.form), to(other)});
  if (const auto more = document.find("links"); more != document.end())
    for (const Ordered& one : *more) links.push_back(one);
  return links;
}

}  // namespace

std::string Asked::own_url() const {
  // It may have been sent whole: "http://127.0.0.1:8080/jobs?limit=2".
  const std::size_t host = target.starts_with('/') ? 0 : target.find("://") + 3;
  return url(target.substr(std::min(target.find('/', host), target.size())));
}

Form form_of(std::string_view f, const http::Fields& fields) {
  if (!f.empty()) return f == "html" ? Form::html : Form::json;
  // Who wants neither gets what programs read.
  return http::preferred_type(fields, kForms) == 1 ? Form::html : Form::json;
}

http::QueryWord form_word() {
  return {.name = "f", .words = {"json", "html"}, .about = "in place of Accept"};
}

http::Operation document_operation(const char* id, const char* summary, const char* schema) {
  return {.id = id,
          .tag = "OGC",
          .summary = summary,
          .heeds_access = true,
          .words = {form_word()},
          .responses = {{200, "The document.", {{kJson, schema}, {kHtml, R"({"type": "string"})"}}},
                        {304, "The client has it already (If-None-Match)."}}};
}

Asked asked_of(const http::Request& request, std::string_view f) {
  return {form_of(f, request.head.fields), origin_of(request), std::string(request.path),
          std::string(request.head.target), http::Conditions(request.head)};
}

std::expected<Asked, http::Reply> read_asked(const http::Request& request) {
  const auto query = http::read_query(request);
  if (!query.problems.empty())
    return std::unexpected(http::problem_reply(query.problems, request.head.target));
  return asked_of(request, query.words[0]);
}

Ordered link(const Asked& asked, std::string_view to, const char* rel, const char* type,
             const std::string& title) {
  return {{"href", asked.url(to)}, {"rel", rel}, {"type", type}, {"title", title}};
}

Ordered template_link(const Asked& asked, std::string_view to, const char* rel, const char* type,
                      const std::string& title) {
  Ordered json = link(asked, to, rel, type, title);
  json["templated"] = true;
  return json;
}

Shown shown(const Asked& asked, const Ordered& document) {
  if (asked.form == Form::html)
    return {"text/html; charset=utf-8", page_of(document, {asked.path, asked.origin})};
  return {kJson, json::to_text(document, 2) + "\n"};
}

http::Reply document_reply(const Asked& asked, Ordered document) {
  document["links"] = links_of(asked, document);
  const auto [type, text] = shown(asked, document);
  // Not compressed: it is made for each request, on whichever thread.
  return http::Representation::make(
             text,
             {.content_type = type, .vary = "Accept, Host, X-Forwarded-Proto", .compress = false})
      ->reply(asked.client);
}

}  // namespace tind::api::ogc
