#include "server/api/ogc/routes.h"

#include "server/api/ogc/error_page.h"

namespace tind::api {

void add_ogc_routes(http::Router& router, const App& app) {
  ogc::add_tileset_routes(router, app);
  ogc::add_tile_matrix_set_routes(router);
  ogc::add_edr_routes(router, app);
  ogc::add_coverage_routes(router, app);
  ogc::add_collection_routes(router, app);
  ogc::add_landing_routes(router, app);
  router.form_errors(&ogc::error_form);
}

}  // namespace tind::api
