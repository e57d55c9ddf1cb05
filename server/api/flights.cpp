// POST /plan/{dataset}: which tiles a flight needs, in the order of need.
// POST /tiles/{dataset}: many tiles in one response.

#include <nlohmann/json.hpp>
#include <string>

#include "proto/tile_frames.h"
#include "server/api/app.h"
#include "server/api/extensions.h"
#include "server/api/flight_request.h"
#include "server/http/problem.h"

namespace tind::api {
namespace {

using Json = nlohmann::ordered_json;
constexpr std::size_t kPlanBody = 2 << 20, kTilesBody = 64 << 10;
constexpr std::size_t kMostBytes = 32 << 20;  // of the tiles in one response

http::Reply answer(const FlightPlan& plan) {
  Json tiles = Json::array();
  for (const PlannedTile& t : plan.tiles)
    tiles.push_back({{"tile", t.id.text()},
                     {"needed_s", t.needed_s},
                     {"arrives_s", t.arrives_s},
                     {"bytes", t.bytes}});
  const Json json = {{"lead_s", plan.lead_s}, {"bytes", plan.bytes}, {"tiles", tiles}};
  return http::make_reply(200, "application/json", json.dump() + "\n",
                          {{"Cache-Control", "no-store"}});
}

std::optional<http::Reply> plan(const App& app, const http::Request& request, http::Later& later) {
  const auto [dataset, not_found] = find_dataset(app, request.matched[0], request);
  if (!dataset) return not_found;
  auto permit = app.pool.admit();
  if (!permit) return http::problem_reply(permit.error(), request.head.target);
  app.pool.run(std::move(*permit), [dataset, &app, body = std::string(request.body),
                                    target = std::string(request.head.target),
                                    responder = later.responder()](std::stop_token) mutable {
    const auto asked = parse_flight_request(body);
    if (!asked) return responder(http::problem_reply(asked.error(), target));
    const auto made = plan_flight(*dataset->tiles, asked->flight, asked->options, [&](TileId id) {
      const auto hit = app.tiles.cached(*dataset, id, {});
      return hit ? hit->body().size() : std::size_t(asked->tile_bytes);
    });
    responder(made ? answer(*made) : http::problem_reply(made.error(), target));
  });
  return std::nullopt;
}

/// On a worker, one tile after the other. Each that is missing or fails says so in its frame.
std::vector<std::uint8_t> in_frames(const App& app, const services::Dataset& dataset,
                                    const std::vector<TileId>& ids, proto::Extensions asked,
                                    std::stop_token stop) {
  std::vector<std::uint8_t> out = proto::begin_frames(std::uint32_t(ids.size()));
  for (const TileId id : ids) {
    proto::TileFrame frame{std::uint32_t(id.level), id.x, id.y, 404, {}};
    services::TileService::Tile tile;
    if (out.size() > kMostBytes) {
      frame.status = 413;
    } else if (dataset.tiles->available(id)) {
      const auto made = app.tiles.make_now(dataset, id, asked, stop);
      frame.status = made ? 200 : std::uint32_t(http::status_of(made.error().code));
      if (made) tile = *made;
    }
    if (tile) frame.bytes = tile->bytes();
    proto::append_frame(out, frame);
  }
  return out;
}

std::optional<http::Reply> tiles(const App& app, const http::Request& request, http::Later& later) {
  const auto [dataset, not_found] = find_dataset(app, request.matched[0], request);
  if (!dataset) return not_found;
  auto ids = parse_tile_list(request.body);
  if (!ids) return http::problem_reply(ids.error(), request.head.target);
  auto permit = app.pool.admit();
  if (!permit) return http::problem_reply(permit.error(), request.head.target);
  app.pool.run(
      std::move(*permit), [dataset, &app, ids = std::move(*ids), responder = later.responder(),
                           asked = asked_extensions(request.head.fields, request.head.query)](
                              std::stop_token stop) mutable {
        const auto frames = in_frames(app, *dataset, ids, asked, stop);
        responder(http::make_reply(200, "application/vnd.tind.tiles",
                                   {reinterpret_cast<const char*>(frames.data()), frames.size()},
                                   {{"Cache-Control", "no-store"}}));
      });
  return std::nullopt;
}

}  // namespace

void add_flight_routes(http::Router& router, const App& app) {
  router.post("/plan/{dataset}", kPlanBody,
              [&app](const http::Request& r, http::Later& l) { return plan(app, r, l); });
  router.post("/tiles/{dataset}", kTilesBody,
              [&app](const http::Request& r, http::Later& l) { return tiles(app, r, l); });
}

}  // namespace tind::api
