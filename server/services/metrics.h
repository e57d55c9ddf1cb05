#pragma once
// The state of the daemon as Prometheus text (exposition format 0.0.4). No label takes a value from
// a client, so the number of series is fixed.

#include <chrono>
#include <string>

#include "server/http/stats.h"
#include "server/services/catalog.h"
#include "server/services/cpu_pool.h"
#include "server/services/tile_cache.h"
#include "server/services/tile_service.h"

namespace tind::services {

std::string render_metrics(const http::StatsSnapshot&, const Catalog&, const TileService&,
                           const TileCache&, const CpuPool&);

}  // namespace tind::services
