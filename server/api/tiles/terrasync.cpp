// /terrasync/{dataset}/: FlightGear's scenery, as fgfs asks a TerraSync server for it: the index of
// a folder of one degree, then its files.

#include <charconv>
#include <optional>
#include <string>

#include "server/api/app.h"
#include "server/api/responses.h"
#include "server/api/tiles/tile_product.h"
#include "terrain/flightgear/bucket_id.h"

namespace tind::api {
namespace {

using services::Scenery;

constexpr std::string_view kNoFile =
    "There is no such file; the .dirindex of a folder of one degree says which exist.";
constexpr std::string_view kNoIndex =
    "FlightGear asks for folders of one degree (Terrain/e000n40/e006n45/.dirindex). The index of "
    "all of them takes all their buckets: tind build --format flightgear has it.";

/// Digits alone, as the batch names files: no other spelling is a second address of the same file.
std::optional<flightgear::BucketId> bucket_named(std::string_view text) {
  std::int64_t index = -1;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), index);
  if (error != std::errc() || end != text.data() + text.size() || std::to_string(index) != text)
    return {};
  return flightgear::bucket_of(index);
}

std::optional<http::Reply> serve(const http::Request& request, http::DeferredReply& deferred,
                                 std::shared_ptr<const services::ServedDataset> dataset,
                                 TileId address, services::TileProducts& products) {
  return serve_product(request, deferred, {std::move(dataset), address}, products);
}

std::optional<http::Reply> file(const App& app, const http::Request& request,
                                http::DeferredReply& deferred, services::TileProducts& products) {
  auto [dataset, not_found] = find_dataset(app, request.matched[0], request);
  if (!dataset) return std::move(not_found);
  if (!dataset->source) return no_source(request);
  const auto folder = flightgear::folder_named(request.matched[1], request.matched[2]);
  const auto id = bucket_named(request.matched[3]);
  if (!folder || !id || flightgear::folder_of(*id) != *folder ||
      !flightgear::has_bucket(*dataset->source, *id))
    return no_tile(request, kNoFile);
  return serve(request, deferred, std::move(dataset), Scenery::address(*id), products);
}

std::optional<http::Reply> index(const App& app, const http::Request& request,
                                 http::DeferredReply& deferred) {
  auto [dataset, not_found] = find_dataset(app, request.matched[0], request);
  if (!dataset) return std::move(not_found);
  if (!dataset->source) return no_source(request);
  const auto folder = flightgear::folder_named(request.matched[1], request.matched[2]);
  if (!folder) return no_tile(request, kNoFile);
  bool any = false;
  for (const auto id : flightgear::buckets_in(*folder))
    any = any || flightgear::has_bucket(*dataset->source, id);
  if (!any) return no_tile(request, kNoFile);
  return serve(request, deferred, std::move(dataset), Scenery::address(*folder),
               app.scenery->indices);
}

std::optional<http::Reply> no_index(const App& app, const http::Request& request) {
  auto [dataset, not_found] = find_dataset(app, request.matched[0], request);
  if (!dataset) return std::move(not_found);
  if (!dataset->source) return no_source(request);
  return no_tile(request, kNoIndex);
}

/// Of what FlightGear may ask and is not there.
http::Operation hidden() {
  return {.scope = http::Scope::tiles, .ignores_others = true, .is_hidden = true};
}

http::Operation operation_of(const char* id, const char* summary, const char* type) {
  return {.id = id,
          .tag = "Tiles",
          .summary = summary,
          .scope = http::Scope::tiles,
          .ignores_others = true,
          .path = {{"ten", "the folder of ten degrees", R"({"type": "string"})", R"("w130n40")"},
                   {"one", "the folder of one degree", R"({"type": "string"})", R"("w122n46")"},
                   {"bucket", "the number of FlightGear's bucket",
                    R"({"type": "integer", "minimum": 0, "maximum": 9999999})", "959024"}},
          .responses = resource("It.", type)};
}

}  // namespace

void add_terrasync_routes(http::Router& router, const App& app) {
  if (!app.scenery) return;
  const std::string root = "/terrasync/{dataset}/", folder = root + "Terrain/{ten}/{one}/";
  router.get(folder + ".dirindex",
             operation_of("getTerraSyncIndex", "The index of a folder of FlightGear's scenery",
                          "text/plain; charset=utf-8"),
             [&app](const http::Request& request, http::DeferredReply& deferred) {
               return index(app, request, deferred);
             });
  router.get(folder + "{bucket}.btg.gz",
             operation_of("getTerraSyncGround", "The ground of a bucket", "application/gzip"),
             [&app](const http::Request& request, http::DeferredReply& deferred) {
               return file(app, request, deferred, app.scenery->grounds);
             });
  router.get(folder + "{bucket}.stg",
             operation_of("getTerraSyncList", "What lies in a bucket", "text/plain; charset=utf-8"),
             [&app](const http::Request& request, http::DeferredReply& deferred) {
               return file(app, request, deferred, app.scenery->stgs);
             });
  for (const char* above : {".dirindex", "Terrain/.dirindex", "Terrain/{ten}/.dirindex"})
    router.get(root + above, hidden(), [&app](const http::Request& request, http::DeferredReply&) {
      return no_index(app, request);
    });
}

}  // namespace tind::api
