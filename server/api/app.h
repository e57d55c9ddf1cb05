#pragma once
// What the handlers work with, and the table of all routes.

#include "server/http/router.h"
#include "server/http/server.h"
#include "server/http/static_files.h"
#include "server/services/catalog.h"
#include "server/services/cpu_pool.h"
#include "server/services/refine_service.h"
#include "server/services/tile_cache.h"
#include "server/services/tile_service.h"
#include "server/services/tile_streams.h"
#include "server/services/tile_transitions.h"

namespace tind::api {

/// Everything here outlives the router.
struct App {
  const services::Catalog& catalog;
  services::TileService& tiles;
  const services::TileCache& cache;
  services::CpuPool& pool;
  const http::StaticFiles& viewer;
  const http::Server* server = nullptr;              // set once it listens, before it runs
  services::RefineService* refine = nullptr;         // null: no /refine
  services::TileStreams* streams = nullptr;          // null: no /progressive
  services::TileTransitions* transitions = nullptr;  // null: no /transition
};

http::Router make_router(const App&);

// One function per resource, each in its own file.
void add_tile_routes(http::Router&, const App&);
void add_dataset_routes(http::Router&, const App&);
void add_elevation_routes(http::Router&, const App&);
void add_transition_routes(http::Router&, const App&);
void add_flight_routes(http::Router&, const App&);
void add_health_routes(http::Router&, const App&);
void add_method_routes(http::Router&);
void add_progressive_routes(http::Router&, const App&);
void add_refine_routes(http::Router&, const App&);
void add_viewer_routes(http::Router&, const App&);

/// The dataset of that name, or the 404 that says there is none.
struct FoundDataset {
  const services::Dataset* dataset = nullptr;
  http::Reply not_found;
};
FoundDataset find_dataset(const App&, std::string_view name, const http::Request&);

}  // namespace tind::api
