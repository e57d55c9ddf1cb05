// /datasets: what there is, where, and what is known about it.

#include <algorithm>
#include <cmath>
#include <memory>
#include <mutex>
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

Json place(const HeightExtremes::Place& place) {
  return {{"lon", place.where.lon}, {"lat", place.where.lat}, {"height_m", place.height_m}};
}

/// What keeps tiles from being made: "reading" or "failed". Not the reason: it may name files.
void add_state(Json& json, const Readiness& readiness) {
  using State = Readiness::State;
  if (readiness.state == State::ready) {
    json["state"] = "ready";
  } else {
    json["state"] = readiness.state == State::reading ? "reading" : "failed";
    json["share_read"] = std::floor(readiness.share * 1000) / 1000;
  }
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
  // Stores that others made, and old ones, do not say it.
  json["datum"] = layer.datum.empty() ? Json(nullptr) : Json(layer.datum);
  const auto extremes = dataset.tiles->extremes();
  json["highest"] = extremes ? place(extremes->highest) : Json(nullptr);
  json["lowest"] = extremes ? place(extremes->lowest) : Json(nullptr);
  json["source"] = dem ? source_of(*dem) : Json(nullptr);
  add_state(json, dataset.tiles->readiness());
  const auto of = [&dataset](const char* resource) { return resource + dataset.name; };
  // URI templates (RFC 6570); who POSTs to plan, tiles_in_frames and refine.
  json["links"] = {{"layer", tiles + "layer.json"},
                   {"tiles", tiles + "{z}/{x}/{y}.terrain"},
                   {"progressive", of("/progressive/") + "/{z}/{x}/{y}"},
                   {"transition", of("/transition/") + "/{z}/{x}/{y}"},
                   {"plan", of("/plan/")},
                   {"tiles_in_frames", of("/tiles/")}};
  if (dem) {
    json["links"]["refine"] = of("/refine/");
    json["links"]["elevation"] = of("/elevation/") + "{?lon,lat,datum}";
  }
  return json;
}

bool any_reading(const services::Catalog& catalog) {
  return std::ranges::any_of(catalog.all(), [](const auto& dataset) {
    return dataset->tiles->readiness().state == Readiness::State::reading;
  });
}

std::string list(const services::Catalog& catalog) {
  Json datasets = Json::array();
  for (const auto& dataset : catalog.all()) datasets.push_back(describe(*dataset));
  return Json{{"datasets", datasets}}.dump(2, ' ', true, Json::error_handler_t::replace) + "\n";
}

}  // namespace

void add_dataset_routes(http::Router& router, const App& app) {
  // While large DEMs are read the list says how far that is; then it does not change any more.
  struct List {
    std::mutex mutex;
    std::shared_ptr<const http::Representation> settled;
  };
  const auto known = std::make_shared<List>();
  router.get("/datasets", [&app, known](const http::Request& request, http::Later&) {
    const std::lock_guard lock(known->mutex);
    if (known->settled) return known->settled->reply(request.head.fields);
    const bool reading = any_reading(app.catalog);
    const auto now =
        http::Representation::make(list(app.catalog), {.content_type = "application/json"});
    if (!reading) known->settled = now;
    return now->reply(request.head.fields);
  });
}

}  // namespace tind::api
