#include "server/services/tiles/scenery.h"

#include <string_view>
#include <vector>

#include "terrain/flightgear/bucket.h"
#include "terrain/flightgear/scenery_folder.h"
#include "terrain/pyramid/plan/tile_set_options.h"

namespace tind::services {
namespace {

using flightgear::BucketId;

/// As the batch has it for the same options.
Result<flightgear::BucketPlan> plan_of(const ServedDataset& dataset,
                                       const Environment& environment) {
  flightgear::BucketOptions options;
  if (dataset.options) options = {dataset.options->max_error_m, dataset.options->effort};
  return flightgear::BucketPlan::make(*dataset.source, options, environment);
}

TileProducts::Product represent(std::string_view body, std::string_view type, bool compress) {
  return http::Representation::make(body, {.content_type = type, .compress = compress});
}

/// One of the two files of a bucket; the other goes to the cache, too.
TileProducts::Build build_bucket(TileCache& cache, const Environment& environment, bool ground) {
  return [&cache, &environment, ground](const ServedDataset& dataset, TileId address,
                                        std::stop_token stop) -> Result<TileProducts::Product> {
    const auto plan = plan_of(dataset, environment);
    if (!plan) return std::unexpected(plan.error());
    const auto made = make_bucket(*plan, *flightgear::bucket_of(address.x), std::move(stop),
                                  dataset.draped.cover.get());
    if (!made) return fail(dataset.name, made.error());
    if (!*made)
      return fail(Errc::not_found,
                  "No height is known in this bucket; FlightGear has its sea there.");
    const auto& packed = (*made)->btg_gz;
    const auto btg = represent({reinterpret_cast<const char*>(packed.data()), packed.size()},
                               "application/gzip", false);
    const auto stg = represent((*made)->stg, "text/plain; charset=utf-8", true);
    cache.insert({dataset.index, address, ground ? TileKey::kStg : TileKey::kGround},
                 ground ? stg : btg);
    return ground ? btg : stg;
  };
}

/// Of all buckets of the folder, from the cache or made here.
TileProducts::Build build_index(Scenery& scenery) {
  return [&scenery](const ServedDataset& dataset, TileId address,
                    std::stop_token stop) -> Result<TileProducts::Product> {
    const flightgear::Folder folder{int(address.x) - 180, int(address.y) - 90};
    std::vector<flightgear::SceneryFile> files;
    for (const BucketId id : flightgear::buckets_in(folder)) {
      if (!flightgear::has_bucket(*dataset.source, id)) continue;
      const TileId at = Scenery::address(id);
      const auto ground = scenery.grounds.make_now(dataset, at, stop);
      if (!ground && ground.error().code == Errc::not_found) continue;
      if (!ground) return std::unexpected(ground.error());
      const auto stg = scenery.stgs.make_now(dataset, at, stop);
      if (!stg) return std::unexpected(stg.error());
      files.emplace_back(flightgear::btg_name(id), (*ground)->body());
      files.emplace_back(flightgear::stg_name(id), (*stg)->body());
    }
    if (files.empty())
      return fail(Errc::not_found,
                  "No height is known in this folder; FlightGear has its sea there.");
    return represent(flightgear::folder_index(folder, files), "text/plain; charset=utf-8", true);
  };
}

}  // namespace

Scenery::Scenery(TileCache& cache, CpuPool& pool, const Environment& environment)
    : grounds(cache, pool, TileKey::kGround, build_bucket(cache, environment, true)),
      stgs(cache, pool, TileKey::kStg, build_bucket(cache, environment, false)),
      indices(cache, pool, TileKey::kDirIndex, build_index(*this)) {}

}  // namespace tind::services
