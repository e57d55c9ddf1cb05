#include "server/api/app.h"

#include "server/http/message/problem.h"

namespace tind::api {

http::Router make_router(const App& app) {
  http::Router router;
  add_tile_routes(router, app);  // first: by far the most asked for
  add_dataset_routes(router, app);
  add_elevation_routes(router, app);
  add_open_topo_data_routes(router, app);
  add_open_elevation_routes(router, app);
  add_valhalla_routes(router, app);
  add_encoding_routes(router, app);
  add_height_image_routes(router, app);
  add_shade_routes(router, app);
  add_method_routes(router);
  add_transition_routes(router, app);
  add_flight_routes(router, app);
  add_progressive_routes(router, app);
  add_health_routes(router, app, false);
  add_refine_routes(router, app);
  add_tiles3d_routes(router, app);
  add_terrasync_routes(router, app);
  add_process_routes(router, app);
  add_job_routes(router, app);
  add_ogc_routes(router, app);
  add_viewer_routes(router, app);
  add_openapi_routes(router, app);
  router.guard(app.gate);
  if (app.job_pages)
    router.refuse_first([ours = *app.job_pages](const http::Request& request) {
      return refuse_jobs_of_strangers(request, ours);
    });
  return router;
}

FoundDataset find_dataset(const App& app, std::string_view name, const http::Request& request) {
  if (auto dataset = app.catalog.find(name)) return {std::move(dataset), {}};
  return {nullptr, http::problem_reply({.status = 404,
                                        .detail = "There is no such dataset; /datasets lists all.",
                                        .instance = request.head.target})};
}

http::Reply no_tiles(const http::Request& request) {
  return http::problem_reply({.status = 404,
                              .detail = "This dataset is a DEM without tiles.",
                              .instance = request.head.target});
}

http::Reply no_source(const http::Request& request) {
  return http::problem_reply({.status = 404,
                              .detail = "This dataset is a store of tiles without its DEM.",
                              .instance = request.head.target});
}

http::BodyRules json_for_dataset(const App& app, std::size_t max_bytes) {
  return {.max_bytes = max_bytes,
          .refuse = [&app](const http::Request& request) -> std::optional<http::Reply> {
            auto found = find_dataset(app, request.matched[0], request);
            if (found.dataset) return std::nullopt;
            return std::move(found.not_found);
          }};
}

void run_on_worker(const App& app, services::Work work, std::string_view target,
                   http::Responder responder, OnWorker run) {
  auto permit = app.pool.admit(work, responder.asker().client);
  if (!permit) return responder(http::problem_reply(permit.error(), target));
  const std::stop_token gone = responder.asker().gone;
  app.pool.run(
      std::move(*permit),
      [responder = std::move(responder), run = std::move(run)](std::stop_token stop) mutable {
        run(std::move(responder), std::move(stop));
      },
      gone);
}

void answer_on_worker(const App& app, services::Work work, std::string_view target,
                      http::Responder responder, Answer answer) {
  run_on_worker(app, work, target, std::move(responder),
                [answer = std::move(answer)](http::Responder to, std::stop_token stop) mutable {
                  to(answer(std::move(stop)));
                });
}

std::optional<http::Reply> answer_on_worker(const App& app, services::Work work,
                                            const http::Request& request,
                                            http::DeferredReply& deferred, Answer answer) {
  answer_on_worker(app, work, request.head.target, deferred.responder(), std::move(answer));
  return std::nullopt;
}

}  // namespace tind::api
