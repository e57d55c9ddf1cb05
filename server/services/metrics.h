#pragma once
// The state of the daemon as Prometheus text (exposition format 0.0.4). No label takes a value from
// a client, so the number of series is fixed.

#include <chrono>
#include <span>
#include <string>
#include <string_view>
#include <utility>

#include "server/http/stats.h"
#include "server/services/datasets/catalog.h"
#include "server/services/datasets/catalog_keeper.h"
#include "server/services/jobs/jobs.h"
#include "server/services/tiles/tile_cache.h"
#include "server/services/tiles/tile_products.h"
#include "server/services/tiles/tile_service.h"
#include "server/services/work/cpu_pool.h"

namespace tind::services {

/// The value of the label `product`, and the products; null: there are none.
using NamedProducts = std::pair<std::string_view, const TileProducts*>;

/// `keeper`: null where the catalog stays as it is; `jobs`: null where there are none.
std::string render_metrics(const http::StatsSnapshot&, const Catalog&, const CatalogKeeper* keeper,
                           const TileService&, const TileCache&, const CpuPool&,
                           std::span<const NamedProducts>, const Jobs* jobs);

}  // namespace tind::services
