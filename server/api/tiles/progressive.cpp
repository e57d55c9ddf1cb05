// /progressive/{dataset}/{z}/{x}/{y}: a tile as a progressive mesh, coarse to fine; the whole
// stream, a range of its bytes, or as much of it as an error or a number of triangles takes.

#include <optional>
#include <string>

#include "proto/stream/mesh_stream.h"
#include "server/api/app.h"
#include "server/api/tiles/tile_product.h"
#include "server/http/message/problem.h"
#include "server/http/message/query_numbers.h"

namespace tind::api {
namespace {

using Stream = services::TileStreams::Stream;

const http::Operation kProgressive = {
    .id = "getProgressiveTile",
    .tag = "Flights and cameras",
    .summary = "A tile as a progressive mesh",
    .about =
        "Coarse at once, finer with every byte. Any prefix is a valid mesh; `Range` takes the "
        "rest.",
    .scope = http::Scope::tiles,
    .numbers = {{"max_error", 0, 1e6, "metres", false,
                 "as much as it takes to be within it of every post", "3"},
                {"triangles", 1, 1e9, "a whole number", true, "as much as so many triangles take",
                 "1000"}},
    .responses = {
        {200, "The stream, or its beginning.", {{"application/vnd.tind.progressive-mesh"}}},
        {206, "A range of it.", {{"application/vnd.tind.progressive-mesh"}}},
        {304, "The client has it already (If-None-Match)."},
        {416, "A range beyond the end."}}};

/// How much of the stream the query asks for; nothing: all of it.
std::optional<proto::StreamLimit> limit_of(const http::QueryNumbers& query) {
  const auto& error = query.values[0];
  const auto& triangles = query.values[1];
  if (!error && !triangles) return {};
  proto::StreamLimit limit;
  limit.max_error_m = error.value_or(-1);  // no state is that good
  if (triangles) limit.triangles = std::size_t(*triangles);
  return limit;
}

/// The beginning that the limit asks for, as a resource of its own. On a worker.
http::Reply beginning(const Stream& whole, const proto::StreamLimit& limit,
                      const http::Conditions& client, std::string_view target) {
  const auto stream = proto::decode_mesh_stream(whole->bytes());
  if (!stream) return http::problem_reply(Error{Errc::internal, stream.error().what}, target);
  const std::size_t bytes = proto::bytes_until(*stream, limit);
  if (bytes == whole->bytes().size()) return whole->reply(client);
  return whole->beginning(bytes)->reply(client);
}

std::optional<http::Reply> progressive(const App& app, const http::Request& request,
                                       http::DeferredReply& deferred) {
  auto tile = find_tile(app, request);
  if (!tile) return std::move(tile.error());
  const std::string target(request.head.target);
  const auto query = http::read_query(request);
  if (!query.problems.empty()) return http::problem_reply(query.problems, target);
  const auto limit = limit_of(query);
  http::Conditions client(request.head);

  const Stream hit = app.streams->cached(*tile->dataset, tile->id);
  if (hit && !limit) return hit->reply(client);
  const auto answer = [limit, client = std::move(client), target](const Stream& stream) {
    return limit ? beginning(stream, *limit, client, target) : stream->reply(client);
  };
  if (hit)
    return answer_on_worker(app, services::Work::question, request, deferred,
                            [hit, answer](const std::stop_token&) { return answer(hit); });
  return answer_when_made(request, deferred, *tile->dataset, make_of(*app.streams, *tile), answer);
}

}  // namespace

void add_progressive_routes(http::Router& router, const App& app) {
  if (!app.streams) return;
  router.get("/progressive/{dataset}/{z}/{x}/{y}", kProgressive,
             [&app](const http::Request& request, http::DeferredReply& deferred) {
               return progressive(app, request, deferred);
             });
}

}  // namespace tind::api
