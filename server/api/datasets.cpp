// /datasets: what there is, where, and what is known about it.

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <memory>
#include <mutex>
#include <nlohmann/json.hpp>
#include <string>

#include "server/api/accuracy_json.h"
#include "server/api/app.h"
#include "server/api/responses.h"
#include "terrain/images/height_image.h"
#include "terrain/tiles3d/tileset.h"

namespace tind::api {
namespace {

using Json = nlohmann::ordered_json;

Json source_of(const DemInfo& info) {
  Json json = {{"driver", info.driver},
               {"columns", info.cols},
               {"rows", info.rows},
               {"crs", info.crs_name},
               {"crs_accuracy_m", info.crs_accuracy_m ? Json(*info.crs_accuracy_m) : Json()},
               {"spacing_m", {info.spacing_x_m, info.spacing_y_m}},
               {"datum", name(info.source_datum)}};
  if (info.accuracy) json["accuracy"] = accuracy_json(*info.accuracy);
  return json;
}

/// Of several layers: each, the lowest first.
Json source_of(const Surface& surface) {
  if (surface.only()) return source_of(surface.info());
  Json layers = Json::array();
  for (const SurfaceLayer& layer : surface.layers()) {
    const DemInfo& info = layer.source->info();
    Json one = {{"name", layer.name}};
    one.update(source_of(info));
    one["bounds"] = {info.bounds.west, info.bounds.south, info.bounds.east, info.bounds.north};
    one["blend_m"] = layer.blend_m;
    layers.push_back(std::move(one));
  }
  return {{"layers", std::move(layers)}};
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
    if (readiness.seconds_left) json["seconds_left"] = std::ceil(*readiness.seconds_left);
  }
}

void add_tiles(Json& json, const proto::LayerJson& layer) {
  json["min_level"] = layer.minzoom;
  json["max_level"] = layer.maxzoom;
  json["format"] = layer.format;
  json["projection"] = layer.projection;
  json["extensions"] = layer.extensions;
  if (!layer.accuracy.empty()) json["accuracy"] = proto::accuracy_json(layer.accuracy);
}

/// URI templates (RFC 6570); one POSTs to plan, tiles_in_frames and refine.
Json links(const services::ServedDataset& dataset) {
  const auto of = [&dataset](const char* resource) { return resource + dataset.name; };
  Json json = Json::object();
  if (dataset.tiles) {
    json = {{"layer", of("/terrain/") + "/layer.json"},
            {"tiles", of("/terrain/") + "/{z}/{x}/{y}.terrain"},
            {"progressive", of("/progressive/") + "/{z}/{x}/{y}"},
            {"transition", of("/transition/") + "/{z}/{x}/{y}"},
            {"plan", of("/plan/")},
            {"tiles_in_frames", of("/tiles/")}};
    if (tiles3d::has_roots(*dataset.tiles)) {
      json["3dtiles"] = of("/3dtiles/") + "/tileset.json";
      json["3dtiles_meshopt"] = of("/3dtiles/") + "/meshopt/tileset.json";
    }
  }
  if (dataset.tiles && !dataset.source) {  // of the meshes, which is all there is
    json["elevation"] = of("/elevation/") + "?surface=level={level}{&lon,lat,datum}";
    json["height_images"] = of("/rgb/") + "/tiles.json?surface=mesh{&encoding,format}";
  }
  if (dataset.source) {
    if (dataset.source->only()) json["refine"] = of("/refine/");
    json["elevation"] = of("/elevation/") + "{?lon,lat,datum}";
    json["terrasync"] = of("/terrasync/") + "/Terrain/{ten}/{one}/.dirindex";
  }
  if (dataset.source && has_images(*dataset.source)) {
    json["height_images"] = of("/rgb/") + "/tiles.json" +
                            (dataset.tiles ? "{?encoding,format,surface}" : "{?encoding,format}");
    json["shades"] = of("/shade/") + "/tiles.json{?style,azimuth,altitude,z_factor,format}";
  }
  return json;
}

Readiness readiness_of(const Dataset& dataset) {
  return dataset.tiles ? dataset.tiles->readiness() : Readiness{};
}

Json describe(const services::ServedDataset& dataset) {
  const DatasetFacts facts = dataset.facts();
  const GeoRect& b = facts.bounds;
  Json json = {{"name", dataset.name},
               {"kind", dataset.source ? "dem" : "store"},
               {"bounds", {b.west, b.south, b.east, b.north}},
               {"box", {facts.box.west, facts.box.south, facts.box.east, facts.box.north}}};
  if (dataset.tiles) add_tiles(json, dataset.tiles->layer());
  json["attribution"] = facts.attribution;
  // Stores that others made, and old ones, do not say it.
  json["datum"] = facts.datum.empty() ? Json(nullptr) : Json(facts.datum);
  json["highest"] = facts.extremes ? place(facts.extremes->highest) : Json(nullptr);
  json["lowest"] = facts.extremes ? place(facts.extremes->lowest) : Json(nullptr);
  json["source"] = dataset.source ? source_of(*dataset.source) : Json(nullptr);
  add_state(json, readiness_of(dataset));
  json["links"] = links(dataset);
  return json;
}

bool any_reading(const services::Catalog& catalog) {
  return std::ranges::any_of(catalog.all(), [](const auto& dataset) {
    return readiness_of(*dataset).state == Readiness::State::reading;
  });
}

/// Those that who asks may see.
std::string list(const services::Catalog& catalog, const http::Request& request) {
  Json datasets = Json::array();
  for (const auto& dataset : catalog.all())
    if (request.sees(dataset->name)) datasets.push_back(describe(*dataset));
  return Json{{"datasets", datasets}}.dump(2, ' ', true, Json::error_handler_t::replace) + "\n";
}

const http::Operation kDatasets = {
    .id = "getDatasets",
    .tag = "About",
    .summary = "The datasets: bounds, levels, datum, source, links",
    .scope = http::Scope::read,
    .heeds_access = true,
    .ignores_others = true,
    .responses = resource("All datasets that the key is for.", "application/json", R"({
      "type": "object",
      "required": ["datasets"],
      "properties": {
        "datasets": {"type": "array", "items": {
          "type": "object",
          "required": ["name", "kind", "bounds", "box", "state", "links"],
          "properties": {
            "name": {"type": "string"},
            "kind": {"enum": ["dem", "store"]},
            "bounds": {"type": "array", "items": {"type": "number"}},
            "box": {"type": "array", "items": {"type": "number"}},
            "datum": {"type": ["string", "null"]},
            "state": {"enum": ["ready", "reading", "failed"]},
            "share_read": {"type": "number"},
            "seconds_left": {"type": "number"},
            "links": {"type": "object"}
          }}}}})")};

}  // namespace

void add_dataset_routes(http::Router& router, const App& app) {
  // While large DEMs are read the list says how far that is; then it changes with the catalog only.
  struct List {
    std::mutex mutex;
    std::shared_ptr<const http::Representation> settled;
    std::uint64_t of = 0;  // which catalog
  };
  const auto known = std::make_shared<List>();
  router.get("/datasets", kDatasets,
             [&app, known](const http::Request& request, http::DeferredReply&) {
               const http::Representation::Options json = {.content_type = "application/json"};
               if (request.access && !request.access->datasets.empty())
                 return http::Representation::make(list(app.catalog, request), json)
                     ->reply(request.head.fields);
               const std::lock_guard lock(known->mutex);
               const std::uint64_t revision = app.catalog.revision();
               if (known->settled && known->of == revision)
                 return known->settled->reply(request.head.fields);
               const bool reading = any_reading(app.catalog);
               const auto now = http::Representation::make(list(app.catalog, request), json);
               known->settled = reading ? nullptr : now;
               known->of = revision;
               return now->reply(request.head.fields);
             });
}

}  // namespace tind::api
