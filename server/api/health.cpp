// /livez, /readyz, /healthz and /metrics: for orchestrators and for Prometheus.

#include <fmt/format.h>

#include <string>
#include <vector>

#include "server/api/app.h"
#include "server/log/printable.h"
#include "server/services/metrics.h"
#include "terrain/base/errno_text.h"

namespace tind::api {
namespace {

http::Reply text(int status, std::string_view body) {
  return http::make_reply(status, "text/plain; charset=utf-8", body,
                          {{"Cache-Control", "no-store"}});
}

bool is_verbose(const http::Request& request) {
  const std::string_view query = request.head.query;
  return query == "verbose" || query.starts_with("verbose=") || query.starts_with("verbose&");
}

/// One line each: [+] what is well, [-] what is not, [.] what is left alone.
std::string report(const App& app, bool reasons) {
  std::string out = app.server && app.server->ready() ? "[+] listening\n" : "[-] listening\n";
  out += fmt::format("[+] {} datasets\n", app.catalog.all().size());
  const auto because = [&](const std::string& why) {
    return reasons ? ": " + logging::printable(why) : std::string(" (the log says why)");
  };
  const int code = app.jobs ? app.jobs->unwritable() : 0;
  if (code == services::Jobs::kOtherList)
    out += fmt::format("[-] the list of jobs is no longer the one that was opened{}\n",
                       because("put it back, or restart the daemon"));
  else if (code != 0)
    out +=
        fmt::format("[-] the folder of jobs cannot be written to{}\n", because(errno_text(code)));
  if (!app.keeper) return out;
  const auto status = app.keeper->status();
  if (status.wrong)
    out += fmt::format("[-] reload at {} failed, what there was stays{}\n", status.when,
                       because(*status.wrong));
  else if (!status.when.empty())
    out += fmt::format("[+] reloaded at {}\n", status.when);
  if (status.lost)
    out += fmt::format("[-] the catalog's folder cannot be followed, what there was stays{}\n",
                       because(*status.lost));
  // Which datasets there are is for whoever has a key for them.
  const auto so_many = [](std::size_t n) {
    return n == 1 ? std::string("a dataset") : fmt::format("{} datasets", n);
  };
  if (!reasons && !status.unlike.empty())
    out += fmt::format("[-] the files of {} are not as they were opened (the log says which)\n",
                       so_many(status.unlike.size()));
  if (!reasons && !status.unread.empty())
    out += fmt::format("[-] the heights of {} cannot be made ready (the log says which)\n",
                       so_many(status.unread.size()));
  if (!reasons && !status.again.empty())
    out += fmt::format("[-] {} of the catalog cannot be opened just now (the log says which)\n",
                       so_many(status.again.size()));
  for (const auto& [name, why] : status.unread)
    if (reasons)
      out +=
          fmt::format("[-] dataset {}: its heights cannot be made ready{}\n", name, because(why));
  for (const auto& [name, why] : status.unlike)
    if (reasons)
      out += fmt::format("[-] dataset {}: its files are not as they were opened{}\n", name,
                         because(why));
  for (const auto& [path, why] : status.aside)
    if (reasons)
      out += status.again.contains(path)
                 ? fmt::format("[-] left alone: {}; it is tried again\n", logging::printable(why))
                 : fmt::format("[.] left alone: {}\n", logging::printable(why));
  for (const std::string& path : status.opening)
    if (reasons) out += fmt::format("[.] still being opened: {}\n", logging::printable(path));
  return out;
}

http::Reply readiness(const App& app, const http::Request& request, bool reasons) {
  const bool ready = app.server && app.server->ready();
  const std::string before = is_verbose(request) ? report(app, reasons) : std::string();
  return text(ready ? 200 : 503, before + (ready ? "ready\n" : "not ready\n"));
}

http::Reply metrics(const App& app) {
  const auto stats = app.server ? app.server->stats() : http::StatsSnapshot{};
  std::vector<services::NamedProducts> products = {{"progressive", app.streams},
                                                   {"transition", app.transitions}};
  if (app.encodings)
    for (const auto& encoding : app.encodings->all())
      products.emplace_back(encoding.format.name, encoding.products.get());
  if (app.tiles3d) {
    products.emplace_back("3dtiles-glb", &app.tiles3d->plain.contents);
    products.emplace_back("3dtiles-subtree", &app.tiles3d->plain.subtrees);
    products.emplace_back("3dtiles-tileset", &app.tiles3d->plain.tilesets);
    products.emplace_back("3dtiles-meshopt-glb", &app.tiles3d->meshopt.contents);
    products.emplace_back("3dtiles-meshopt-subtree", &app.tiles3d->meshopt.subtrees);
    products.emplace_back("3dtiles-meshopt-tileset", &app.tiles3d->meshopt.tilesets);
  }
  if (app.scenery) {
    products.emplace_back("terrasync-ground", &app.scenery->grounds);
    products.emplace_back("terrasync-stg", &app.scenery->stgs);
    products.emplace_back("terrasync-index", &app.scenery->indices);
  }
  return http::make_reply(200, "text/plain; version=0.0.4; charset=utf-8",
                          services::render_metrics(stats, app.catalog, app.keeper, app.tiles,
                                                   app.cache, app.pool, products, app.jobs),
                          {{"Cache-Control", "no-store"}});
}

constexpr const char* kText = R"({"type": "string"})";

const http::Operation kAlive = {.id = "getAlive",
                                .tag = "Health",
                                .summary = "Does the process work?",
                                .scope = http::Scope::open,
                                .ignores_others = true,
                                .responses = {{200, "It does.", {{"text/plain", kText}}}}};

const http::Operation kMetrics = {
    .id = "getMetrics",
    .tag = "Health",
    .summary = "What the daemon counts, for Prometheus",
    .scope = http::Scope::admin,
    .ignores_others = true,
    .responses = {{200, "The exposition format of Prometheus.", {{"text/plain", kText}}}}};

http::Operation ready_operation(std::string_view path) {
  return {
      .id = path == "/readyz" ? "getReady" : "getHealth",
      .tag = "Health",
      .summary = "May clients send requests?",
      .scope = http::Scope::open,
      .words = {{.name = "verbose",
                 .words = {},
                 .form = "anything",
                 .about = "a line for each thing that is well or not",
                 .pattern = "^$",
                 .example = ""}},
      .ignores_others = true,
      .responses = {
          {200, "They may.", {{"text/plain", kText}}},
          {503, "Not now: it stops, or has no file descriptors left.", {{"text/plain", kText}}}}};
}

}  // namespace

void add_health_routes(http::Router& router, const App& app, bool reasons) {
  // Alive: this thread answers. Never asks anything else, or a slow disk would have us killed.
  router.get_always("/livez", kAlive, [](const http::Request&, http::DeferredReply&) {
    return text(200, "alive\n");
  });
  for (const char* path : {"/readyz", "/healthz"})
    router.get_always(path, ready_operation(path),
                      [&app, reasons](const http::Request& request, http::DeferredReply&) {
                        return readiness(app, request, reasons);
                      });
  router.get_always("/metrics", kMetrics,
                    [&app](const http::Request&, http::DeferredReply&) { return metrics(app); });
}

}  // namespace tind::api
