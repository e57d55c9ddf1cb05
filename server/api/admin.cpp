// What only the operator asks, at a place that only this machine reaches.

#include <nlohmann/json.hpp>
#include <string>
#include <utility>

#include "server/api/app.h"
#include "server/api/web_pages.h"
#include "server/http/message/problem.h"

namespace tind::api {
namespace {

using Json = nlohmann::ordered_json;

std::optional<http::Reply> refuse_pages(const http::Request& request) {
  if (!is_of_page(request) && names_this_machine(request.head.host)) return std::nullopt;
  return http::problem_reply({.status = 403,
                              .detail = "This is for the operator, not for web pages.",
                              .instance = request.head.target});
}

http::Reply answer(const Result<services::CatalogChange>& change, const std::string& target) {
  if (!change) {
    if (change.error().code == Errc::cancelled) return http::problem_reply(change.error(), target);
    return http::problem_reply(
        {.status = 422,
         .detail =
             "What is served stays as it was, and so do keys and rates: " + change.error().what,
         .instance = target});
  }
  Json aside = Json::array();
  for (const auto& [entry, why] : change->aside) aside.push_back({{"entry", entry}, {"why", why}});
  const Json json = {{"kept", change->kept},
                     {"new", change->added},
                     {"opened_anew", change->replaced},
                     {"gone", change->removed},
                     {"only_after_restart", change->for_restart},
                     {"left_alone", std::move(aside)},
                     {"not_yet", change->waiting}};
  return http::make_reply(200, "application/json",
                          json.dump(2, ' ', true, Json::error_handler_t::replace) + "\n",
                          {{"Cache-Control", "no-store"}});
}

std::optional<http::Reply> reload(const App& app, const http::Request& request,
                                  http::DeferredReply& deferred) {
  app.keeper->reload(
      [to = deferred.responder(), target = std::string(request.head.target)](
          Result<services::CatalogChange> change) mutable { to(answer(change, target)); });
  return std::nullopt;
}

}  // namespace

http::Router make_admin_router(const App& app, bool by_address) {
  http::Router router;
  add_health_routes(router, app, true);
  http::BodyRules none{.max_bytes = 0, .type = ""};
  router.post("/admin/reload", none,
              [&app](const http::Request& request, http::DeferredReply& deferred) {
                return reload(app, request, deferred);
              });
  if (by_address) router.refuse_first(refuse_pages);
  return router;
}

}  // namespace tind::api
