// /viewer/...: the web pages, from the table of files made at start.

#include "server/api/app.h"
#include "server/http/message/problem.h"

namespace tind::api {
namespace {

std::optional<http::Reply> file(const App& app, const http::Request& request,
                                std::string_view name) {
  if (const auto found = app.viewer.find(name)) return found->reply(request.head.fields);
  return http::problem_reply(
      {.status = 404,
       .detail = app.viewer.size() == 0 ? "The viewer is not installed; /datasets lists the data."
                                        : "The viewer has no such file.",
       .instance = request.head.target});
}

/// The viewer's page is the root's: its files lie beside that.
http::Reply to_root(const http::Request& request) {
  const std::string_view query = request.head.query;
  return http::make_reply(308, "text/plain", "The viewer is at /.\n",
                          {{"Location", "../" + (query.empty() ? "" : "?" + std::string(query))},
                           {"Cache-Control", "no-cache"}});
}

http::Operation page_operation(const char* id) {
  return {.id = id,
          .tag = "About",
          .summary = "The viewer's page and its files",
          .scope = http::Scope::open,
          .ignores_others = true,
          .is_hidden = true};
}

}  // namespace

void add_viewer_routes(http::Router& router, const App& app) {
  router.get("/viewer/{path...}", page_operation("getViewerFile"),
             [&app](const http::Request& request, http::DeferredReply&) {
               const std::string_view name = request.matched[0];
               if (app.viewer.size() > 0 && (name.empty() || name == "index.html"))
                 return std::optional(to_root(request));
               return file(app, request, name);
             });
}

}  // namespace tind::api
