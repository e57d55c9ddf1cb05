// POST /plan/{dataset}: which tiles a flight needs, in the order of need.
// POST /tiles/{dataset}: many tiles in one response.

#include <algorithm>
#include <nlohmann/json.hpp>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "proto/stream/tile_frames.h"
#include "server/api/app.h"
#include "server/api/elevation/lookups.h"
#include "server/api/extensions.h"
#include "server/api/flights/flight_request.h"
#include "server/api/responses.h"
#include "server/http/message/problem.h"
#include "terrain/analysis/heights_at.h"

namespace tind::api {
namespace {

constexpr std::size_t kPlanBody = 2 << 20, kTilesBody = 64 << 10;
constexpr std::size_t kMostBytes = 32 << 20;  // of the tiles in one response

http::Reply answer(const FlightPlan& plan) {
  using Ordered = nlohmann::ordered_json;
  Ordered tiles = Ordered::array();
  for (const PlannedTile& t : plan.tiles)
    tiles.push_back({{"tile", t.id.text()},
                     {"needed_s", t.needed_s},
                     {"arrives_s", t.arrives_s},
                     {"bytes", t.bytes}});
  const Ordered json = {{"lead_s", plan.lead_s}, {"bytes", plan.bytes}, {"tiles", tiles}};
  return http::make_reply(200, "application/json", json.dump() + "\n",
                          {{"Cache-Control", "no-store"}});
}

/// A height that the highest ground below the flight is not under, from a few of its places.
/// Nothing where these have none, or where all of it is soon read.
Result<std::optional<double>> some_ground(const services::ServedDataset& dataset,
                                          std::span<const Geographic> places,
                                          const std::stop_token& stop) {
  constexpr std::size_t kFew = 16, kMany = 256;
  if (!dataset.source || places.size() <= kMany ||
      work_of(dataset, places.size()) == services::Work::question)
    return std::nullopt;
  std::vector<Geographic> few;
  few.reserve(kFew);
  for (std::size_t i = 0; i < kFew; ++i) few.push_back(places[i * places.size() / kFew]);
  const auto heights = heights_at(*dataset.source, few, Interpolation::bilinear, stop);
  if (!heights) return std::unexpected(heights.error());
  std::optional<double> highest;
  for (const SurfaceHeight& at : *heights)
    if (at.height.coverage == Coverage::value)
      highest = std::max(highest.value_or(at.height.height_m), at.height.height_m);
  return highest;
}

http::Reply answer_plan(const App& app, const services::ServedDataset& dataset,
                        const FlightRequest& asked, const std::string& target,
                        const std::stop_token& stop) {
  const auto facts_of = [&](TileId id) {
    const auto hit = app.tiles.peek(dataset, id, {});
    return hit ? facts_of_tile(hit->bytes()) : PlanFacts{std::size_t(asked.tile_bytes)};
  };
  const auto above = [&](double ground_m) {
    FlightOptions options = asked.options;
    options.ground_m = ground_m;
    return plan_flight(*dataset.tiles, asked.flight, options, facts_of, stop);
  };
  const auto refused = [&](const Error& error) {
    if (error.code != Errc::out_of_range) return http::problem_reply(error, target);
    return http::problem_reply({{"tolerance_px", error.what}}, target);
  };
  std::optional<double> ground_m = asked.ground_m;
  if (!ground_m) {
    const std::vector<Geographic> places = places_of(asked.flight);
    // The higher the ground, the nearer the tiles and the more of them: what are too many above
    // some ground are too many, and all of it need not be read.
    const auto some = some_ground(dataset, places, stop);
    if (!some) return http::problem_reply(some.error(), target);
    if (*some)
      if (const auto made = above(**some); !made) return refused(made.error());
    const auto highest = highest_ground(dataset.source.get(), places, stop);
    if (!highest) return http::problem_reply(highest.error(), target);
    ground_m = *highest;
  }
  const auto made = above(*ground_m);
  return made ? answer(*made) : refused(made.error());
}

std::optional<http::Reply> plan(const App& app, const http::Request& request,
                                http::DeferredReply& deferred) {
  const auto [dataset, not_found] = find_dataset(app, request.matched[0], request);
  if (!dataset) return not_found;
  if (!dataset->tiles) return no_tiles(request);
  return answer_on_worker(app, services::Work::batch, request, deferred,
                          [dataset, &app, body = request.body,
                           target = std::string(request.head.target)](const std::stop_token& stop) {
                            Problems problems;
                            const FlightRequest asked = parse_flight_request(body, problems);
                            if (!problems.empty())
                              return http::problem_reply(problems.list(), target);
                            return answer_plan(app, *dataset, asked, target, stop);
                          });
}

/// On a worker, one tile after the other. Each that is missing or fails says so in its frame. The
/// tiles are sent from the cache's own copies, so that the response holds little but the frames.
http::Reply in_frames(const App& app, const services::ServedDataset& dataset,
                      const std::vector<TileId>& ids, proto::Extensions asked,
                      std::stop_token stop) {
  std::vector<std::uint8_t> heads = proto::begin_frames(std::uint32_t(ids.size()));
  std::vector<services::TileService::Tile> tiles;
  std::size_t size = heads.size();
  for (const TileId id : ids) {
    proto::TileFrame frame{std::uint32_t(id.level), id.x, id.y, 404, {}};
    services::TileService::Tile& tile = tiles.emplace_back();
    if (stop.stop_requested()) {
      frame.status = 503;  // nobody is likely to read it
    } else if (size > kMostBytes) {
      frame.status = 413;
    } else if (dataset.has(id)) {
      const auto made = app.tiles.make_now(dataset, id, asked, stop);
      frame.status = made ? 200 : std::uint32_t(http::status_of(made.error().code));
      if (made) tile = *made;
    }
    if (tile) frame.bytes = tile->bytes();
    proto::append_frame_head(heads, frame);
    size += proto::kFrameHead + frame.bytes.size();
  }
  auto owner = std::make_shared<http::Payload>();
  owner->bytes.assign(heads.begin(), heads.end());
  const std::string_view bytes = owner->bytes;
  std::vector<http::Piece> pieces = {{owner, bytes.substr(0, proto::kFramesHead)}};
  for (std::size_t i = 0; i < tiles.size(); ++i) {
    pieces.push_back(
        {owner, bytes.substr(proto::kFramesHead + i * proto::kFrameHead, proto::kFrameHead)});
    if (tiles[i]) pieces.push_back(tiles[i]->piece());
  }
  return http::make_reply("application/vnd.tind.tiles", std::move(pieces),
                          {{"Cache-Control", "no-store"}});
}

std::optional<http::Reply> tiles(const App& app, const http::Request& request,
                                 http::DeferredReply& deferred) {
  const auto [dataset, not_found] = find_dataset(app, request.matched[0], request);
  if (!dataset) return not_found;
  Problems problems;
  auto ids = parse_tile_list(request.body, problems);
  if (!problems.empty()) return http::problem_reply(problems.list(), request.head.target);
  const auto asked = asked_extensions(request.head.fields, request.head.query);
  const bool all_here = std::ranges::all_of(
      ids, [&](TileId id) { return !dataset->has(id) || app.tiles.peek(*dataset, id, asked); });
  return answer_on_worker(
      app, all_here ? services::Work::question : services::Work::batch, request, deferred,
      [dataset, &app, ids = std::move(ids), asked](const std::stop_token& stop) {
        return in_frames(app, *dataset, ids, asked, stop);
      });
}

constexpr const char* kFix = R"({
  "type": "object",
  "required": ["lon", "lat", "height_m", "time_s"],
  "additionalProperties": false,
  "properties": {
    "lon": {"type": "number", "minimum": -360, "maximum": 360},
    "lat": {"type": "number", "minimum": -90, "maximum": 90},
    "height_m": {"type": "number", "minimum": -1e8, "maximum": 1e8},
    "time_s": {"type": "number", "minimum": -1e11, "maximum": 1e11}
  }})";

std::string plan_schema() {
  return R"({
  "type": "object",
  "additionalProperties": false,
  "properties": {
    "position": {
      "type": "object",
      "required": ["lon", "lat", "height_m"],
      "additionalProperties": false,
      "properties": {
        "lon": {"type": "number", "minimum": -360, "maximum": 360},
        "lat": {"type": "number", "minimum": -90, "maximum": 90},
        "height_m": {"type": "number", "minimum": -1e8, "maximum": 1e8}
      }
    },
    "velocity": {
      "type": "object",
      "additionalProperties": false,
      "description": "metres a second",
      "properties": {
        "east": {"type": "number", "minimum": -1e5, "maximum": 1e5, "default": 0},
        "north": {"type": "number", "minimum": -1e5, "maximum": 1e5, "default": 0},
        "up": {"type": "number", "minimum": -1e5, "maximum": 1e5, "default": 0}
      }
    },
    "horizon_s": {"type": "number", "minimum": 0, "maximum": 86400},
    "trajectory": {"type": "array", "minItems": 1, "maxItems": 10000, "items": )" +
         std::string(kFix) + R"(},
    "link_bits_per_s": {"type": "number", "minimum": 1, "maximum": 1e15, "default": 1e7},
    "tolerance_px": {"type": "number", "minimum": 0.001, "maximum": 1e6, "default": 2},
    "viewport_height_px": {"type": "number", "minimum": 1, "maximum": 1e6, "default": 1080},
    "fov_deg": {"type": "number", "minimum": 0.01, "maximum": 179, "default": 60},
    "tile_bytes": {"type": "number", "minimum": 1, "maximum": 1e9, "default": 12000},
    "ground_m": {"type": "number", "minimum": -1e5, "maximum": 1e5, "description": )" +
         std::string(
             R"("how high the ground is above the ellipsoid where no tile says it yet; )"
             R"(without it the highest below the flight, 0 where there are tiles alone"})") +
         R"(
  },
  "oneOf": [{"required": ["position", "horizon_s"]}, {"required": ["trajectory"]}]})";
}

http::Operation plan_operation() {
  return {.id = "planFlight",
          .tag = "Flights and cameras",
          .summary = "The tiles that a flight will need, in the order of need",
          .scope = http::Scope::tiles,
          .ignores_others = true,
          .body = {{"application/json", plan_schema(), R"({
            "position": {"lon": -123.9, "lat": 49.1, "height_m": 3000},
            "velocity": {"east": 200, "north": 150}, "horizon_s": 60})"}},
          .responses = json_answer("The plan.", R"({
            "type": "object",
            "required": ["lead_s", "bytes", "tiles"],
            "properties": {
              "lead_s": {"type": "number"}, "bytes": {"type": "number"},
              "tiles": {"type": "array", "items": {
                "type": "object",
                "required": ["tile", "needed_s", "arrives_s", "bytes"],
                "properties": {"tile": {"type": "string"}, "needed_s": {"type": "number"},
                               "arrives_s": {"type": "number"}, "bytes": {"type": "number"}}}}
            }})")};
}

http::Operation tiles_operation() {
  return {.id = "getTilesInFrames",
          .tag = "Flights and cameras",
          .summary = "Many tiles in one response",
          .scope = http::Scope::tiles,
          .ignores_others = true,
          .body = {{"application/json", R"({
            "type": "object",
            "required": ["tiles"],
            "additionalProperties": false,
            "properties": {"tiles": {"type": "array", "minItems": 1, "maxItems": 256, "items": {
              "type": "string", "pattern": "^[0-9]/[0-9]/[0-9]$"}}}})",
                    R"({"tiles": ["0/0/0", "0/1/0"]})"}},
          .responses = {{200, "The tiles in frames.", {{"application/vnd.tind.tiles"}}}}};
}

}  // namespace

void add_flight_routes(http::Router& router, const App& app) {
  router.post("/plan/{dataset}", plan_operation(), json_for_dataset(app, kPlanBody),
              [&app](const http::Request& r, http::DeferredReply& d) { return plan(app, r, d); });
  router.post("/tiles/{dataset}", tiles_operation(), json_for_dataset(app, kTilesBody),
              [&app](const http::Request& r, http::DeferredReply& d) { return tiles(app, r, d); });
}

}  // namespace tind::api
