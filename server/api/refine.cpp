// POST /refine/{dataset}: one mesh for a region, or the mesh that a camera needs and then only what
// changes from view to view. The request is JSON, the answer proto/stream/refine_delta.h.

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <string>
#include <variant>

#include "server/api/accuracy_json.h"
#include "server/api/app.h"
#include "server/api/members.h"
#include "server/http/message/problem.h"

namespace tind::api {
namespace {

using Need = Members::Need;

constexpr std::size_t kMostBody = 64 << 10, kMostPoints = 500;
constexpr std::size_t kMostValues = 3 * kMostPoints + 100;  // lists of two

struct AskedRegion {
  GeoRegion where;
  RegionErrors errors;
  std::optional<GeoRect> window;
};
struct AskedView {
  Camera camera;
  std::string token;
  std::optional<GeoRect> window;
};
using Asked = std::variant<AskedRegion, AskedView>;

bool is_place(const Json& json) {
  return json.is_array() && json.size() == 2 && json[0].is_number() && json[1].is_number();
}

/// [west, south, east, north] in degrees.
std::optional<GeoRect> read_box(const Json& json) {
  const bool four = json.is_array() && json.size() == 4 &&
                    std::ranges::all_of(json, [](const Json& j) { return j.is_number(); });
  if (!four) return {};
  const GeoRect box{json[0], json[1], json[2], json[3]};
  const bool on_earth = std::abs(box.west) <= 360 && std::abs(box.east) <= 360 &&
                        std::abs(box.south) <= 90 && std::abs(box.north) <= 90;
  if (!on_earth || box.west >= box.east || box.south >= box.north) return {};
  return box;
}

std::optional<GeoRect> read_window(Members& members, Problems& problems) {
  const Json* const json = members.member("window");
  if (!json) return {};
  const auto box = read_box(*json);
  if (!box) problems.add("window", "must be [west, south, east, north], in degrees");
  return box;
}

/// A polygon or route.
void read_points(const Json& json, const std::string& name, GeoRegion& out, Problems& problems) {
  if (!json.is_array() || json.size() > kMostPoints || !std::ranges::all_of(json, is_place))
    return problems.add(name,
                        "must be at most " + std::to_string(kMostPoints) + " pairs [lon, lat]");
  for (const Json& p : json) out.points.push_back({p[0], p[1]});
}

GeoRegion read_region(const Json& json, Problems& problems) {
  GeoRegion out;
  Members members(json, "region", problems);
  const Json* const box = members.member("bbox");
  const Json* const ring = members.member("polygon");
  const Json* const route = members.member("route");
  members.number("width_m", 1, 1e6, out.width_m, route ? Need::must : Need::may);
  members.nothing_else();
  if (!problems.empty()) return out;
  if ((box != nullptr) + (ring != nullptr) + (route != nullptr) != 1) {
    problems.add("region", "takes one of bbox, polygon and route");
  } else if (box) {
    const auto rect = read_box(*box);
    if (rect) return GeoRegion::box(*rect);
    problems.add("region.bbox", "must be [west, south, east, north], in degrees");
  } else {
    out.closed = ring != nullptr;
    read_points(ring ? *ring : *route, ring ? "region.polygon" : "region.route", out, problems);
  }
  return out;
}

Camera read_camera(const Json& json, Problems& problems) {
  Camera c;
  Members members(json, "camera", problems);
  double width = c.width_px, height = c.height_px;
  members.number("lon", -360, 360, c.position.lon, Need::must);
  members.number("lat", -90, 90, c.position.lat, Need::must);
  members.number("height_m", -12000, 1e8, c.height_m, Need::must);
  members.number("heading_deg", -360, 360, c.heading_deg);
  members.number("pitch_deg", -90, 90, c.pitch_deg);
  members.number("roll_deg", -180, 180, c.roll_deg);
  members.number("fov_deg", 1, 150, c.fov_deg);
  members.number("width_px", 16, 16384, width);
  members.number("height_px", 16, 16384, height);
  members.number("tolerance_px", 0.1, 100, c.tolerance_px);
  members.number("silhouette_px", 0, 100, c.silhouette_px);
  members.nothing_else();
  c.width_px = int(width), c.height_px = int(height);
  return c;
}

AskedView read_view(const Json& camera, Members& members, Problems& problems) {
  AskedView view{read_camera(camera, problems), {}, {}};
  if (const Json* const token = members.member("view")) {
    if (token->is_string() && token->get_ref<const std::string&>().size() <= 64)
      view.token = *token;
    else
      problems.add("view", "must be the token of a view");
  }
  view.window = read_window(members, problems);
  if (view.window && !view.token.empty())
    problems.add("window", "is for a first view; a view stays in its own");
  return view;
}

AskedRegion read_asked_region(const Json& region, Members& members, Problems& problems) {
  AskedRegion asked;
  asked.where = read_region(region, problems);
  members.number("inside_m", 0, 1e5, asked.errors.inside_m, Need::must);
  members.number("outside_m", 0, 1e5, asked.errors.outside_m, Need::must);
  asked.window = read_window(members, problems);
  if (asked.errors.inside_m > asked.errors.outside_m)
    problems.add("inside_m", "must not be above outside_m");
  return asked;
}

Asked read_request(std::string_view body, Problems& problems) {
  Asked asked;
  const Json json = parse_body(body, kMostValues, problems);
  if (!problems.empty()) return asked;
  Members members(json, "", problems);
  if (const Json* const camera = members.member("camera"))
    asked = read_view(*camera, members, problems);
  else if (const Json* const region = members.member("region"))
    asked = read_asked_region(*region, members, problems);
  else
    problems.add("region", "missing: takes a camera or a region");
  members.nothing_else();
  return asked;
}

/// Which member an error of the service is about: it has looked at nothing else.
std::string culprit(const Asked& asked) {
  if (const auto* const region = std::get_if<AskedRegion>(&asked))
    return region->window ? "window" : "region";
  return "window";
}

/// Of the mesh's heights, what their maker says: the mesh itself has no room for it.
http::Reply mesh_reply(const proto::RefineDelta& made, const services::ServedDataset& dataset) {
  std::vector<http::Header> fields = {{"Cache-Control", "no-store"}};
  const DemSource* const dem = dataset.source ? dataset.source->only() : nullptr;
  std::string accuracy;  // a field only points at its value: this one lives until it is written
  if (dem && dem->info().accuracy) {
    accuracy = accuracy_text(*dem->info().accuracy);
    fields.push_back({"Tind-Accuracy", accuracy});
    fields.push_back({"Access-Control-Expose-Headers", "Tind-Accuracy"});
  }
  return http::make_reply(200, "application/vnd.tind.refined-mesh", proto::encode(made), fields);
}

http::Reply answer(const Result<proto::RefineDelta>& made, const services::ServedDataset& dataset,
                   const Asked& asked, const std::string& target) {
  if (made) return mesh_reply(*made, dataset);
  if (made.error().code == Errc::not_found)  // ours, not the source's: it may be told
    return http::problem_reply({.status = 404, .detail = made.error().what, .instance = target});
  if (made.error().code == Errc::invalid_argument)
    return http::problem_reply({.status = 400,
                                .detail = made.error().what,
                                .instance = target,
                                .errors = {{culprit(asked), made.error().what}}});
  return http::problem_reply(made.error(), target);
}

bool ready(const services::RefineService& service, const services::ServedDataset& dataset,
           const Asked& asked) {
  if (const auto* const view = std::get_if<AskedView>(&asked))
    return !view->token.empty() || service.ready(dataset, view->window);
  const auto& region = std::get<AskedRegion>(asked);
  return service.ready(dataset, region.where, region.window);
}

Result<proto::RefineDelta> refined(services::RefineService& service,
                                   const services::ServedDataset& dataset, const Asked& asked,
                                   const std::string& client, const std::stop_token& stop) {
  if (const auto* const view = std::get_if<AskedView>(&asked))
    return service.view(dataset, view->camera, view->token, view->window, stop, client);
  const auto& region = std::get<AskedRegion>(asked);
  return service.region(dataset, region.where, region.errors, region.window, stop, client);
}

/// What is ready is answered at once; what must be prepared first waits for its turn among the
/// long work.
std::optional<http::Reply> refine(const App& app, const http::Request& request,
                                  http::DeferredReply& deferred) {
  const auto [dataset, not_found] = find_dataset(app, request.matched[0], request);
  if (!dataset) return not_found;
  Problems problems;
  Asked asked = read_request(request.body, problems);
  if (!problems.empty()) return http::problem_reply(problems.list(), request.head.target);
  run_on_worker(
      app, services::Work::question, request.head.target, deferred.responder(),
      [&app, dataset, asked = std::move(asked), client = deferred.client(),
       target = std::string(request.head.target)](http::Responder responder,
                                                  const std::stop_token& stop) {
        const auto make = [&app, dataset, asked, client, target](const std::stop_token& s) {
          return answer(refined(*app.refine, *dataset, asked, client, s), *dataset, asked, target);
        };
        if (ready(*app.refine, *dataset, asked)) return responder(make(stop));
        answer_on_worker(app, services::Work::batch, target, std::move(responder), make);
      });
  return std::nullopt;
}

constexpr const char* kBody = R"({
  "type": "object",
  "additionalProperties": false,
  "properties": {
    "region": {
      "type": "object",
      "description": "one of bbox, polygon, route",
      "additionalProperties": false,
      "properties": {
        "bbox": {"type": "array", "minItems": 4, "maxItems": 4, "items": {"type": "number"}},
        "polygon": {"type": "array", "maxItems": 500, "items": {
          "type": "array", "minItems": 2, "maxItems": 2, "items": {"type": "number"}}},
        "route": {"type": "array", "maxItems": 500, "items": {
          "type": "array", "minItems": 2, "maxItems": 2, "items": {"type": "number"}}},
        "width_m": {"type": "number", "minimum": 1, "maximum": 1e6}
      }
    },
    "inside_m": {"type": "number", "minimum": 0, "maximum": 1e5},
    "outside_m": {"type": "number", "minimum": 0, "maximum": 1e5},
    "camera": {
      "type": "object",
      "required": ["lon", "lat", "height_m"],
      "additionalProperties": false,
      "properties": {
        "lon": {"type": "number", "minimum": -360, "maximum": 360},
        "lat": {"type": "number", "minimum": -90, "maximum": 90},
        "height_m": {"type": "number", "minimum": -12000, "maximum": 1e8},
        "heading_deg": {"type": "number", "minimum": -360, "maximum": 360, "default": 0},
        "pitch_deg": {"type": "number", "minimum": -90, "maximum": 90, "default": 0},
        "roll_deg": {"type": "number", "minimum": -180, "maximum": 180, "default": 0},
        "fov_deg": {"type": "number", "minimum": 1, "maximum": 150, "default": 60},
        "width_px": {"type": "number", "minimum": 16, "maximum": 16384, "default": 1920},
        "height_px": {"type": "number", "minimum": 16, "maximum": 16384, "default": 1080},
        "tolerance_px": {"type": "number", "minimum": 0.1, "maximum": 100, "default": 1},
        "silhouette_px": {"type": "number", "minimum": 0, "maximum": 100, "default": 0}
      }
    },
    "view": {"type": "string", "maxLength": 64, "description": "the token of the last answer"},
    "window": {"type": "array", "minItems": 4, "maxItems": 4, "items": {"type": "number"},
               "description": "[west, south, east, north], degrees"}
  },
  "oneOf": [{"required": ["region", "inside_m", "outside_m"]}, {"required": ["camera"]}]})";

const http::Operation kRefine = {
    .id = "refine",
    .tag = "Flights and cameras",
    .summary = "One mesh, fine in a region or as a camera needs it",
    .about = "Then only what changes.",
    .ignores_others = true,
    .body = {{"application/json", kBody, R"({
      "region": {"bbox": [-121.78, 46.84, -121.74, 46.87]}, "inside_m": 5, "outside_m": 80})"}},
    .responses = {
        {200, "The mesh, or what of it changes.", {{"application/vnd.tind.refined-mesh"}}}}};

}  // namespace

void add_refine_routes(http::Router& router, const App& app) {
  if (!app.refine) return;
  router.post("/refine/{dataset}", kRefine, json_for_dataset(app, kMostBody),
              [&app](const http::Request& request, http::DeferredReply& deferred) {
                return refine(app, request, deferred);
              });
}

}  // namespace tind::api
