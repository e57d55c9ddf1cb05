// /shade/{dataset}/tiles.json and /shade/{dataset}/{z}/{x}/{y}.png or .webp: hillshade, slope and
// aspect.

#include <fmt/format.h>

#include <cmath>
#include <optional>
#include <span>
#include <string>

#include "server/api/app.h"
#include "server/api/tiles/web_map.h"
#include "server/http/message/problem.h"
#include "server/http/message/query_numbers.h"

namespace tind::api {
namespace {

using services::AskedShade;

const std::vector<http::QueryWord> kWords = {
    {.name = "style", .words = {"hillshade", "slope", "aspect"}, .about = "what is drawn"},
    kVersionWord};
constexpr http::QueryNumber kNumbers[] = {
    {"azimuth", 0, 360, "whole degrees", true, "where the light of a hillshade comes from"},
    {"altitude", 0, 90, "whole degrees", true, "of that light above the horizon"},
    {"z_factor", 0, 100, "a number", false, "by which heights are multiplied for a hillshade"}};

http::Operation with_numbers(http::Operation operation) {
  operation.numbers.assign(std::begin(kNumbers), std::end(kNumbers));
  return operation;
}

/// `format`: as the path says it; nothing: the query may.
std::expected<AskedShade, http::Reply> shade_of(const http::Request& request,
                                                std::optional<proto::ImageFormat> format) {
  auto query = http::read_query(request);
  AskedShade asked;
  asked.style = shade_style_named(query.words[0]).value_or(ShadeStyle::hillshade);
  for (std::size_t k = 0; k < query.values.size(); ++k)
    if (query.values[k] && asked.style != ShadeStyle::hillshade)
      query.problems.push_back({std::string(kNumbers[k].name), "is of style=hillshade alone"});
  if (!query.problems.empty())
    return std::unexpected(http::problem_reply(query.problems, request.head.target));
  if (!format) format = enum_named<proto::ImageFormat>(query.words[2]);
  asked.format = format.value_or(proto::ImageFormat::png);
  if (const auto& azimuth = query.values[0]) asked.azimuth_deg = int(*azimuth) % 360;
  if (const auto& altitude = query.values[1]) asked.altitude_deg = int(*altitude);
  if (const auto& factor = query.values[2]) asked.z_tenths = int(std::lround(*factor * 10));
  return asked;
}

/// As it is asked for again.
std::string query_of(const AskedShade& asked) {
  std::string style = fmt::format("style={}", name(asked.style));
  if (asked.style != ShadeStyle::hillshade) return style;
  return style + fmt::format("&azimuth={}&altitude={}&z_factor={}", asked.azimuth_deg,
                             asked.altitude_deg, asked.z_tenths / 10.);
}

std::optional<http::Reply> image(const App& app, proto::ImageFormat format,
                                 const http::Request& request, http::DeferredReply& deferred) {
  const auto dataset = find_mapped(app, request);
  if (!dataset) return dataset.error();
  const auto asked = shade_of(request, format);
  if (!asked) return asked.error();
  const auto tile = find_web_tile(**dataset, request);
  if (!tile) return tile.error();
  return serve_image(request, deferred, app.images->shades(), **dataset, *tile, asked->number());
}

std::optional<http::Reply> tiles_json(const App& app, const http::Request& request) {
  const auto dataset = find_mapped(app, request);
  if (!dataset) return dataset.error();
  const auto asked = shade_of(request, {});
  if (!asked) return asked.error();
  const Surface& surface = *(*dataset)->source;
  return tile_json_reply(
      request, **dataset,
      image_tile_json(surface, asked->kind(), (*dataset)->name, (*dataset)->facts().attribution),
      "shade", query_of(*asked) + "&v=" + image_version(surface));
}

}  // namespace

void add_shade_routes(http::Router& router, const App& app) {
  if (!app.images) return;
  for (const auto format : {proto::ImageFormat::png, proto::ImageFormat::webp})
    router.get(
        "/shade/{dataset}/{z}/{x}/{y}." + name_of(format),
        with_numbers(image_operation("getShade", "Hillshade, slope or aspect", format, kWords)),
        [&app, format](const http::Request& request, http::DeferredReply& deferred) {
          return image(app, format, request, deferred);
        });
  router.get("/shade/{dataset}/tiles.json",
             with_numbers(tile_json_operation("getShades", "TileJSON of shades", kWords)),
             [&app](const http::Request& request, http::DeferredReply&) {
               return tiles_json(app, request);
             });
}

}  // namespace tind::api
