#include "server/api/app.h"

#include "server/http/problem.h"

namespace tind::api {

http::Router make_router(const App& app) {
  http::Router router;
  add_tile_routes(router, app);  // first: by far the most asked for
  add_dataset_routes(router, app);
  add_elevation_routes(router, app);
  add_method_routes(router);
  add_transition_routes(router, app);
  add_flight_routes(router, app);
  add_progressive_routes(router, app);
  add_health_routes(router, app);
  add_refine_routes(router, app);
  add_viewer_routes(router, app);
  return router;
}

FoundDataset find_dataset(const App& app, std::string_view name, const http::Request& request) {
  if (const services::Dataset* dataset = app.catalog.find(name)) return {dataset, {}};
  return {nullptr, http::problem_reply({.status = 404,
                                        .detail = "There is no such dataset; /datasets lists all.",
                                        .instance = request.head.target})};
}

}  // namespace tind::api
