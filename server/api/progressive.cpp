// /progressive/{dataset}/{z}/{x}/{y}: a tile as a progressive mesh, coarse to fine; the whole
// stream, a range of its bytes, or as much of it as an error or a number of triangles takes.

#include <charconv>
#include <cmath>
#include <string>

#include "proto/mesh_stream.h"
#include "server/api/app.h"
#include "server/api/tile_address.h"
#include "server/http/problem.h"
#include "server/http/uri.h"

namespace tind::api {
namespace {

using Stream = services::TileStreams::Stream;

constexpr double kMostError = 1e6;  // metres
constexpr double kMostTriangles = 1e9;

struct Asked {
  proto::StreamLimit limit;
  bool limited = false;
  std::vector<http::ParameterProblem> problems;
};

bool read_number(const std::string& text, double& value) {
  const char* const end = text.data() + text.size();
  const auto [stop, error] = std::from_chars(text.data(), end, value);
  return error == std::errc() && stop == end && std::isfinite(value);
}

Asked read_query(std::string_view query) {
  Asked asked;
  const auto parameters = http::parse_query(query);
  if (!parameters) {
    asked.problems.push_back({"query", "holds a bad percent-escape"});
    return asked;
  }
  bool error_given = false, triangles_given = false;
  for (const auto& [name, text] : *parameters) {
    double value = 0;
    const bool number = read_number(text, value);
    bool* const given = name == "max_error"   ? &error_given
                        : name == "triangles" ? &triangles_given
                                              : nullptr;
    if (!given) {
      asked.problems.push_back({name.substr(0, 64), "is not a parameter of this resource"});
    } else if (std::exchange(*given, true)) {
      asked.problems.push_back({name, "given twice"});
    } else if (name == "max_error") {
      if (!number || value < 0 || value > kMostError)
        asked.problems.push_back({name, "must be metres from 0 to 1000000"});
      asked.limit.max_error_m = value;
    } else {
      if (!number || value < 1 || value > kMostTriangles || value != std::floor(value))
        asked.problems.push_back({name, "must be a whole number from 1 to 1000000000"});
      else
        asked.limit.triangles = std::size_t(value);
    }
  }
  asked.limited = error_given || triangles_given;
  if (!error_given) asked.limit.max_error_m = -1;  // no state is that good
  return asked;
}

/// The beginning that the limit asks for, as a resource of its own. On a worker.
http::Reply beginning(const Stream& whole, const proto::StreamLimit& limit,
                      const http::Conditions& client, std::string_view target) {
  const auto stream = proto::decode_mesh_stream(whole->bytes());
  if (!stream) return http::problem_reply(Error{Errc::internal, stream.error()}, target);
  const std::size_t bytes = proto::bytes_until(*stream, limit);
  if (bytes == whole->bytes().size()) return whole->reply(client);
  return whole->beginning(bytes)->reply(client);
}

std::optional<http::Reply> progressive(const App& app, const http::Request& request,
                                       http::Later& later) {
  const std::string_view target = request.head.target;
  const auto [dataset, not_found] = find_dataset(app, request.matched[0], request);
  if (!dataset) return not_found;
  const auto id = tile_address(request.matched[1], request.matched[2], request.matched[3]);
  if (!id || !dataset->tiles->available(*id))
    return http::problem_reply({.status = 404,
                                .detail = "There is no such tile; layer.json says which exist.",
                                .instance = target});
  const Asked asked = read_query(request.head.query);
  if (!asked.problems.empty())
    return http::problem_reply({.status = 400,
                                .detail = "A parameter is wrong: " + asked.problems[0].parameter +
                                          " " + asked.problems[0].detail + ".",
                                .instance = target,
                                .errors = asked.problems});
  http::Conditions client(request.head.fields);
  if (request.head.method != http::Method::get) client.range.clear();  // RFC 9110, 14.2

  const Stream hit = app.streams->cached(*dataset, *id);
  if (hit && !asked.limited) return hit->reply(client);
  auto answer = [limit = asked.limit, limited = asked.limited, client = std::move(client),
                 target = std::string(target),
                 responder = later.responder()](const Result<Stream>& made) mutable {
    if (!made) return responder(http::problem_reply(made.error(), target));
    responder(limited ? beginning(*made, limit, client, target) : (*made)->reply(client));
  };
  if (!hit) {
    app.streams->make(*dataset, *id, std::move(answer));
    return std::nullopt;
  }
  auto permit = app.pool.admit();
  if (!permit) {
    answer(std::unexpected(permit.error()));
    return std::nullopt;
  }
  app.pool.run(std::move(*permit),
               [hit, answer = std::move(answer)](std::stop_token) mutable { answer(hit); });
  return std::nullopt;
}

}  // namespace

void add_progressive_routes(http::Router& router, const App& app) {
  if (!app.streams) return;
  router.get("/progressive/{dataset}/{z}/{x}/{y}",
             [&app](const http::Request& request, http::Later& later) {
               return progressive(app, request, later);
             });
}

}  // namespace tind::api
