// /livez, /readyz, /healthz and /metrics: for orchestrators and for Prometheus.

#include <vector>

#include "server/api/app.h"
#include "server/services/metrics.h"

namespace tind::api {
namespace {

http::Reply text(int status, std::string_view body) {
  return http::make_reply(status, "text/plain; charset=utf-8", body,
                          {{"Cache-Control", "no-store"}});
}

http::Reply readiness(const App& app) {
  return app.server && app.server->ready() ? text(200, "ready\n") : text(503, "not ready\n");
}

http::Reply metrics(const App& app) {
  const auto stats = app.server ? app.server->stats() : http::StatsSnapshot{};
  std::vector<services::NamedProducts> products = {{"progressive", app.streams},
                                                   {"transition", app.transitions}};
  if (app.encodings)
    for (const auto& encoding : app.encodings->all())
      products.emplace_back(encoding.format.name, encoding.products.get());
  return http::make_reply(
      200, "text/plain; version=0.0.4; charset=utf-8",
      services::render_metrics(stats, app.catalog, app.tiles, app.cache, app.pool, products),
      {{"Cache-Control", "no-store"}});
}

}  // namespace

void add_health_routes(http::Router& router, const App& app) {
  // Alive: this thread answers. Never asks anything else, or a slow disk would have us killed.
  router.get_always(
      "/livez", [](const http::Request&, http::DeferredReply&) { return text(200, "alive\n"); });
  for (const char* path : {"/readyz", "/healthz"})
    router.get_always(
        path, [&app](const http::Request&, http::DeferredReply&) { return readiness(app); });
  router.get_always("/metrics",
                    [&app](const http::Request&, http::DeferredReply&) { return metrics(app); });
}

}  // namespace tind::api
