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
               return file(app, request, request.matched[0]);
             });
}

}  // namespace tind::api
