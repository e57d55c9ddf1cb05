// /datasets: what there is, where, and what is known about it.

#include <nlohmann/json.hpp>
#include <string>

#include "server/api/app.h"

namespace tind::api {
namespace {

using Json = nlohmann::ordered_json;

Json source_of(const DemSource& dem) {
  const DemInfo& info = dem.info();
  return {{"driver", info.driver},
          {"columns", info.cols},
          {"rows", info.rows},
          {"crs", info.crs_name},
          {"spacing_m", {info.spacing_x_m, info.spacing_y_m}},
          {"datum", name(info.source_datum)}};
}

Json describe(const services::Dataset& dataset) {
  const proto::LayerJson& layer = dataset.tiles->layer();
  const std::string tiles = "/terrain/" + dataset.name + "/";
  const DemSource* const dem = dataset.tiles->dem();
  Json json = {{"name", dataset.name},
               {"kind", dem ? "dem" : "store"},
               {"bounds", layer.bounds},
               {"min_level", layer.minzoom},
               {"max_level", layer.maxzoom},
               {"format", layer.format},
               {"projection", layer.projection},
               {"extensions", layer.extensions},
               {"attribution", layer.attribution}};
  json["datum"] = dem ? Json(name(dem->info().datum)) : Json(nullptr);
  json["source"] = dem ? source_of(*dem) : Json(nullptr);
  json["links"] = {{"tiles", tiles},
                   {"layer", tiles + "layer.json"},
                   {"progressive", "/progressive/" + dataset.name + "/{z}/{x}/{y}"}};
  if (dem) json["links"]["elevation"] = "/elevation/" + dataset.name + "?lon={lon}&lat={lat}";
  return json;
}

std::string list(const services::Catalog& catalog) {
  Json datasets = Json::array();
  for (const auto& dataset : catalog.all()) datasets.push_back(describe(*dataset));
  return Json{{"datasets", datasets}}.dump(2, ' ', true, Json::error_handler_t::replace) + "\n";
}

}  // namespace

void add_dataset_routes(http::Router& router, const App& app) {
  // The catalogue does not change while the daemon runs.
  const auto all =
      http::Representation::make(list(app.catalog), {.content_type = "application/json"});
  router.get("/datasets", [all](const http::Request& request, http::Later&) {
    return all->reply(request.head.fields);
  });
}

}  // namespace tind::api
