// POST /refine/{dataset}: one mesh for a region, or the mesh that a camera needs and then only what
// changes from view to view. The request is JSON, the answer proto/refine_delta.h.

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <string>
#include <variant>

#include "server/api/app.h"
#include "server/http/problem.h"

namespace tind::api {
namespace {

using Json = nlohmann::json;

constexpr std::size_t kMostBody = 64 << 10;
constexpr std::size_t kMostPoints = 500;

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

/// Reads the members of one object, and keeps what is wrong with them.
class Members {
 public:
  Members(const Json& object, std::string path, std::vector<http::ParameterProblem>& problems)
      : object_(object), path_(std::move(path)), problems_(problems) {}

  void number(const char* name, double low, double high, double& value, bool needed = false) {
    known_.push_back(name);
    const auto found = object_.find(name);
    if (found == object_.end()) {
      if (needed) problems_.push_back({path_ + name, "missing"});
      return;
    }
    if (found->is_number() && double(*found) >= low && double(*found) <= high)
      value = *found;
    else
      problems_.push_back(
          {path_ + name, "must be a number from " + Json(low).dump() + " to " + Json(high).dump()});
  }
  const Json* member(const char* name) {
    known_.push_back(name);
    const auto found = object_.find(name);
    return found == object_.end() ? nullptr : &*found;
  }
  void nothing_else() {
    for (const auto& [name, value] : object_.items())
      if (std::ranges::find(known_, name) == known_.end())
        problems_.push_back({path_ + name.substr(0, 64), "is not known here"});
  }

 private:
  const Json& object_;
  std::string path_;
  std::vector<http::ParameterProblem>& problems_;
  std::vector<std::string> known_;
};

using Problems = std::vector<http::ParameterProblem>;

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
  if (!box) problems.push_back({"window", "must be [west, south, east, north], in degrees"});
  return box;
}

GeoRegion read_region(const Json& json, Problems& problems) {
  GeoRegion out;
  if (!json.is_object()) return problems.push_back({"region", "must be an object"}), out;
  Members members(json, "region.", problems);
  const Json* const box = members.member("bbox");
  const Json* const ring = members.member("polygon");
  const Json* const route = members.member("route");
  members.number("width_m", 1, 1e6, out.width_m, route != nullptr);
  members.nothing_else();
  if ((box != nullptr) + (ring != nullptr) + (route != nullptr) != 1)
    return problems.push_back({"region", "takes one of bbox, polygon and route"}), out;
  if (box) {
    const bool four = box->is_array() && box->size() == 4 &&
                      std::ranges::all_of(*box, [](const Json& j) { return j.is_number(); });
    if (!four)
      return problems.push_back({"region.bbox", "must be [west, south, east, north]"}), out;
    return GeoRegion::box({(*box)[0], (*box)[1], (*box)[2], (*box)[3]});
  }
  const Json& points = ring ? *ring : *route;
  if (!points.is_array() || points.size() > kMostPoints || !std::ranges::all_of(points, is_place)) {
    problems.push_back({ring ? "region.polygon" : "region.route",
                        "must be at most " + std::to_string(kMostPoints) + " pairs [lon, lat]"});
    return out;
  }
  out.closed = ring != nullptr;
  for (const Json& p : points) out.points.push_back({p[0], p[1]});
  return out;
}

Camera read_camera(const Json& json, Problems& problems) {
  Camera c;
  if (!json.is_object()) return problems.push_back({"camera", "must be an object"}), c;
  Members members(json, "camera.", problems);
  double width = c.width_px, height = c.height_px;
  members.number("lon", -360, 360, c.position.lon, true);
  members.number("lat", -90, 90, c.position.lat, true);
  members.number("height_m", -12000, 1e8, c.height_m, true);
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

Asked read_request(std::string_view body, Problems& problems) {
  const Json json = Json::parse(body, nullptr, false);
  if (!json.is_object()) return problems.push_back({"body", "must be a JSON object"}), Asked();
  Members members(json, "", problems);
  if (const Json* const camera = members.member("camera")) {
    AskedView view{read_camera(*camera, problems), {}, {}};
    if (const Json* const token = members.member("view")) {
      if (token->is_string() && token->get_ref<const std::string&>().size() <= 64)
        view.token = *token;
      else
        problems.push_back({"view", "must be the token of a view"});
    }
    view.window = read_window(members, problems);
    if (view.window && !view.token.empty())
      problems.push_back({"window", "is for a first view; a view stays in its own"});
    members.nothing_else();
    return view;
  }
  AskedRegion asked;
  const Json* const region = members.member("region");
  if (!region) return problems.push_back({"body", "takes a camera or a region"}), Asked();
  asked.where = read_region(*region, problems);
  members.number("inside_m", 0, 1e5, asked.errors.inside_m, true);
  members.number("outside_m", 0, 1e5, asked.errors.outside_m, true);
  asked.window = read_window(members, problems);
  members.nothing_else();
  if (asked.errors.inside_m > asked.errors.outside_m)
    problems.push_back({"inside_m", "must not be above outside_m"});
  return asked;
}

http::Reply answer(const Result<proto::RefineDelta>& made, const std::string& target) {
  if (made)
    return http::make_reply(200, "application/vnd.tind.refined-mesh", proto::encode(*made),
                            {{"Cache-Control", "no-store"}});
  if (made.error().code == Errc::not_found)  // ours, not the source's: it may be told
    return http::problem_reply({.status = 404, .detail = made.error().what, .instance = target});
  return http::problem_reply(made.error(), target);
}

std::optional<http::Reply> refine(const App& app, const http::Request& request,
                                  http::Later& later) {
  const auto [found, not_found] = find_dataset(app, request.matched[0], request);
  if (!found) return not_found;
  Problems problems;
  Asked asked = read_request(request.body, problems);
  if (!problems.empty())
    return http::problem_reply({.status = 400,
                                .detail = "The request is wrong: " + problems[0].parameter + " " +
                                          problems[0].detail + ".",
                                .instance = request.head.target,
                                .errors = problems});
  auto permit = app.pool.admit();
  if (!permit) return http::problem_reply(permit.error(), request.head.target);
  app.pool.run(
      std::move(*permit), [&dataset = *found, &service = *app.refine, asked = std::move(asked),
                           target = std::string(request.head.target),
                           responder = later.responder()](std::stop_token stop) mutable {
        if (const auto* const view = std::get_if<AskedView>(&asked))
          return responder(
              answer(service.view(dataset, view->camera, view->token, view->window, stop), target));
        const auto& region = std::get<AskedRegion>(asked);
        responder(answer(service.region(dataset, region.where, region.errors, region.window, stop),
                         target));
      });
  return std::nullopt;
}

}  // namespace

void add_refine_routes(http::Router& router, const App& app) {
  if (!app.refine) return;
  router.post("/refine/{dataset}", kMostBody,
              [&app](const http::Request& request, http::Later& later) {
                return refine(app, request, later);
              });
}

}  // namespace tind::api
