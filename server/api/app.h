#pragma once
// What the handlers work with, and the table of all routes.

#include <functional>
#include <memory>
#include <optional>
#include <stop_token>
#include <string>
#include <string_view>
#include <vector>

#include "server/api/web_pages.h"
#include "server/http/router.h"
#include "server/http/server.h"
#include "server/http/static_files.h"
#include "server/services/datasets/catalog.h"
#include "server/services/datasets/catalog_keeper.h"
#include "server/services/jobs/jobs.h"
#include "server/services/refine/refine_service.h"
#include "server/services/tiles/height_images.h"
#include "server/services/tiles/scenery.h"
#include "server/services/tiles/tile_cache.h"
#include "server/services/tiles/tile_encodings.h"
#include "server/services/tiles/tile_service.h"
#include "server/services/tiles/tile_streams.h"
#include "server/services/tiles/tile_transitions.h"
#include "server/services/tiles/tiles3d.h"
#include "server/services/work/cpu_pool.h"
#include "terrain/geo/environment.h"

namespace tind::api {

/// Everything here outlives the router.
struct App {
  const services::Catalog& catalog;
  services::TileService& tiles;
  const services::TileCache& cache;
  services::CpuPool& pool;
  const http::StaticFiles& viewer;
  const Environment& environment;
  const http::Server* server = nullptr;              // set once it listens, before it runs
  services::RefineService* refine = nullptr;         // null: no /refine
  services::TileStreams* streams = nullptr;          // null: no /progressive
  services::TileTransitions* transitions = nullptr;  // null: no /transition
  services::TileEncodings* encodings = nullptr;      // null: tiles as quantized-mesh only
  services::HeightImages* images = nullptr;          // null: no /rgb, no /shade
  services::CatalogKeeper* keeper = nullptr;         // null: the catalog stays as it is
  services::Tiles3d* tiles3d = nullptr;              // null: no /3dtiles
  services::Scenery* scenery = nullptr;              // null: no /terrasync
  services::Jobs* jobs = nullptr;                    // null: no /processes, no /jobs
  const http::Gate* gate = nullptr;                  // null: everybody may ask everything
  std::optional<JobPages> job_pages = {};            // nothing: all names may ask for jobs
  std::string index_dir = {};  // absolute, for jobs that make tiles; empty: the default
};

/// For everybody.
http::Router make_router(const App&);
/// For the operator alone, at a place of its own: health with its reasons, and /admin/reload.
/// `by_address`: a web page could ask there, too, and is refused.
http::Router make_admin_router(const App&, bool by_address);

// One function per resource, each in its own file.
void add_tile_routes(http::Router&, const App&);
void add_dataset_routes(http::Router&, const App&);
void add_elevation_routes(http::Router&, const App&);
void add_encoding_routes(http::Router&, const App&);
void add_transition_routes(http::Router&, const App&);
void add_flight_routes(http::Router&, const App&);
void add_height_image_routes(http::Router&, const App&);
void add_shade_routes(http::Router&, const App&);
/// `reasons`: /readyz?verbose says them, which name files.
void add_health_routes(http::Router&, const App&, bool reasons);
void add_job_routes(http::Router&, const App&);
void add_method_routes(http::Router&);
void add_ogc_routes(http::Router&, const App&);  // all of OGC API but Processes
/// The document of all routes that are there already: to be added last.
void add_openapi_routes(http::Router&, const App&);
void add_open_elevation_routes(http::Router&, const App&);
void add_open_topo_data_routes(http::Router&, const App&);
void add_process_routes(http::Router&, const App&);
void add_progressive_routes(http::Router&, const App&);
void add_refine_routes(http::Router&, const App&);
void add_terrasync_routes(http::Router&, const App&);
void add_tiles3d_routes(http::Router&, const App&);
void add_valhalla_routes(http::Router&, const App&);
void add_viewer_routes(http::Router&, const App&);

/// The dataset of that name, or the 404 that says there is none.
struct FoundDataset {
  std::shared_ptr<const services::ServedDataset> dataset;
  http::Reply not_found;
};
FoundDataset find_dataset(const App&, std::string_view name, const http::Request&);

/// The 404 of a resource that needs tiles, for a dataset that has none.
http::Reply no_tiles(const http::Request&);

/// The 404 of a resource that needs the DEM, for a dataset that has only tiles.
http::Reply no_source(const http::Request&);

/// A POST of JSON to a path whose first {...} names a dataset: the 404 comes before its body.
http::BodyRules json_for_dataset(const App&, std::size_t max_bytes);

/// On a worker; answers through the responder, or hands it on. Its token is stopped when the client
/// has hung up or the daemon stops.
using OnWorker = std::move_only_function<void(http::Responder, std::stop_token)>;
/// Runs it, or sends at once the 503 of a class that has no room. `target`: of the request.
void run_on_worker(const App&, services::Work, std::string_view target, http::Responder, OnWorker);

/// Made on a worker, with that token.
using Answer = std::move_only_function<http::Reply(std::stop_token)>;

/// Sends what `answer` makes there, or that 503.
void answer_on_worker(const App&, services::Work, std::string_view target, http::Responder, Answer);
/// The same for a handler; always nothing, which is what it returns then.
std::optional<http::Reply> answer_on_worker(const App&, services::Work, const http::Request&,
                                            http::DeferredReply&, Answer);

}  // namespace tind::api
