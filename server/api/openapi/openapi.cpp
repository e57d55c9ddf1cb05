// /openapi.json, /openapi.yaml: what all routes take and answer, from the table that routes them;
// /api: the same for people.

#include "server/api/openapi/openapi.h"

#include <algorithm>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>

#include "server/api/app.h"
#include "server/api/openapi/openapi_parts.h"
#include "server/http/message/problem.h"

namespace tind::api {
namespace {

using Ordered = nlohmann::ordered_json;
using http::Operation;
using http::Scope;

/// Of a literal of ours.
Ordered parsed(std::string_view text) { return Ordered::parse(text); }

/// "/viewer/{path...}" as OpenAPI writes it; the names in it, in order.
std::string path_of(std::string pattern, std::vector<std::string>& names) {
  if (const auto rest = pattern.find("...}"); rest != pattern.npos) pattern.erase(rest, 3);
  for (auto open = pattern.find('{'); open != pattern.npos; open = pattern.find('{', open + 1))
    names.push_back(pattern.substr(open + 1, pattern.find('}', open) - open - 1));
  return pattern;
}

Ordered path_parameter(const std::string& name, const Operation& operation) {
  const auto own = std::ranges::find(operation.path, name, &http::PathParameter::name);
  const http::PathParameter* const known =
      own != operation.path.end() ? &*own : common_path_parameter(name);
  Ordered json = {{"name", name}, {"in", "path"}, {"required", true}};
  if (!known) {
    json["schema"] = {{"type", "string"}};
    return json;
  }
  json["description"] = known->about;
  json["schema"] = parsed(known->schema);
  if (!known->example.empty()) json["example"] = parsed(known->example);
  return json;
}

Ordered number_parameter(const http::QueryNumber& number) {
  Ordered json = {{"name", number.name}, {"in", "query"}};
  json["description"] =
      std::string(number.about) + (number.about.empty() ? "" : "; ") + std::string(number.unit);
  json["schema"] = {{"type", number.whole ? "integer" : "number"},
                    {"minimum", number.least},
                    {"maximum", number.most}};
  if (!number.example.empty()) json["example"] = parsed(number.example);
  return json;
}

Ordered word_parameter(const http::QueryWord& word) {
  Ordered json = {{"name", word.name}, {"in", "query"}};
  const std::string_view about = word.about.empty() ? word.form : word.about;
  if (!about.empty()) json["description"] = about;
  Ordered words = {{"type", "string"}, {"enum", word.words}}, form = {{"type", "string"}};
  if (!word.form.empty()) form["description"] = word.form;
  if (!word.pattern.empty()) form["pattern"] = word.pattern;
  const bool open = word.fits || !word.pattern.empty();
  if (word.words.empty())
    json["schema"] = std::move(form);
  else if (!open)
    json["schema"] = std::move(words);
  else
    json["schema"] = {{"anyOf", {std::move(words), std::move(form)}}};
  if (word.pattern == "^$") json["allowEmptyValue"] = true;
  if (!word.example.empty()) json["example"] = word.example;
  return json;
}

Ordered content_json(const std::vector<http::Content>& forms) {
  Ordered json = Ordered::object();
  for (const http::Content& form : forms) {
    Ordered& one = json[form.type] = Ordered::object();
    if (!form.schema.empty()) one["schema"] = parsed(form.schema);
    if (!form.example.empty()) one["example"] = parsed(form.example);
  }
  return json;
}

Ordered body_json(const Operation& operation, const http::BodyRules& rules) {
  const std::size_t kib = rules.max_bytes >> 10;
  return {
      {"description",
       "At most " +
           (kib >= 1024 ? std::to_string(kib >> 10) + " MiB" : std::to_string(kib) + " KiB") + "."},
      {"required", true},
      {"content", content_json(operation.body)}};
}

/// What every operation may answer, unless it says something of its own.
void add_common_responses(Ordered& responses, const Operation& operation, bool has_path,
                          const http::BodyRules* rules) {
  const auto add = [&](const char* status) {
    if (!responses.contains(status))
      responses[status] = {{"$ref", std::string("#/components/responses/") + status}};
  };
  add("400");
  if (operation.scope != Scope::open)
    for (const char* const status : {"401", "403"}) add(status);
  if (has_path) add("404");
  if (rules)
    for (const char* const status : {"411", "413"}) add(status);
  if (rules && !rules->type.empty()) add("415");
  if (responses.contains("304")) add("412");  // what has a validator
  for (const char* const status : {"429", "500", "503"}) add(status);
}

Ordered security_of(Scope scope) {
  if (scope == Scope::open) return Ordered::array();
  Ordered all = Ordered::array({Ordered::object()});  // a daemon may have no keys
  for (const char* const scheme : {"bearer", "header", "query"})
    all.push_back({{scheme, Ordered::array({std::string(name(scope))})}});
  return all;
}

Ordered operation_json(const Operation& operation, const std::vector<std::string>& names,
                       const http::BodyRules* rules) {
  Ordered json = {
      {"operationId", operation.id}, {"tags", {operation.tag}}, {"summary", operation.summary}};
  if (!operation.about.empty()) json["description"] = operation.about;
  Ordered parameters = Ordered::array();
  for (const std::string& name : names) parameters.push_back(path_parameter(name, operation));
  for (const auto& number : operation.numbers) parameters.push_back(number_parameter(number));
  for (const auto& word : operation.words) parameters.push_back(word_parameter(word));
  if (!parameters.empty()) json["parameters"] = std::move(parameters);
  if (rules && !operation.body.empty()) json["requestBody"] = body_json(operation, *rules);
  Ordered responses = Ordered::object();
  for (const http::Response& response : operation.responses) {
    Ordered& one = responses[std::to_string(response.status)];
    one = {{"description", response.about}};
    if (!response.content.empty()) one["content"] = content_json(response.content);
    if (response.status >= 400)  // what HTTP itself refuses has one form everywhere
      one["content"]["application/problem+json"] = {{"schema", parsed(kProblemRef)}};
  }
  add_common_responses(responses, operation, !names.empty(), rules);
  json["responses"] = std::move(responses);
  json["security"] = security_of(operation.scope);
  if (operation.scope != Scope::open) json["x-tind-scope"] = name(operation.scope);
  json["x-tind-ignores-other-parameters"] = operation.ignores_others;
  return json;
}

}  // namespace

Ordered openapi_document(const http::Router& router) {
  Ordered document = openapi_head();
  Ordered& paths = document["paths"] = Ordered::object();
  for (const http::Router::Route& route : router.routes()) {
    std::vector<std::string> names;
    const std::string path = path_of(route.pattern, names);
    const auto add = [&](const char* method, const http::Router::Action& action,
                         const http::BodyRules* rules) {
      if (action && action.described && !action.operation->is_hidden)
        paths[path][method] = operation_json(*action.operation, names, rules);
    };
    add("get", route.get, nullptr);
    add("post", route.post, &route.body);
    add("delete", route.del, nullptr);
  }
  document["components"] = openapi_components();
  return document;
}

void add_openapi_routes(http::Router& router, const App& app) {
  struct Documents {
    std::shared_ptr<const http::Representation> json, yaml;
  };
  const auto made = std::make_shared<Documents>();
  const auto add = [&](const char* path, const char* id, const char* type, auto which) {
    router.get(path,
               {.id = id,
                .tag = "About",
                .summary = "This document",
                .scope = Scope::open,
                .ignores_others = true,
                .responses = {{200, "OpenAPI 3.1.", {{type, R"({"type": "object"})"}}},
                              {304, "The client has it already (If-None-Match)."}}},
               [made, which](const http::Request& request, http::DeferredReply&) {
                 return ((*made).*which)->reply(request.head.fields);
               });
  };
  constexpr const char *kJson = "application/vnd.oai.openapi+json;version=3.1",
                       *kYaml = "application/yaml";
  add("/openapi.json", "getOpenApiJson", kJson, &Documents::json);
  add("/openapi.yaml", "getOpenApiYaml", kYaml, &Documents::yaml);
  router.get("/api",
             {.id = "getApiPage",
              .tag = "About",
              .summary = "This document as a page for people",
              .scope = Scope::open,
              .ignores_others = true,
              .responses = {{200, "A page.", {{"text/html", R"({"type": "string"})"}}},
                            {404,
                             "The page is not installed.",
                             {{"application/problem+json", kProblemRef}}}}},
             [&app](const http::Request& request, http::DeferredReply&) {
               if (const auto page = app.viewer.find("api.html"))
                 return page->reply(request.head.fields);
               return http::problem_reply({.status = 404,
                                           .detail = "The page is not installed; /openapi.json is "
                                                     "what it would show.",
                                           .instance = request.head.target});
             });
  const Ordered document = openapi_document(router);
  made->json = http::Representation::make(document.dump(2) + "\n", {.content_type = kJson});
  made->yaml = http::Representation::make(to_yaml(document), {.content_type = kYaml});
}

}  // namespace tind::api
