#pragma once
// What `tind estimate` and `tind build --dry-run` print.

#include <nlohmann/json_fwd.hpp>
#include <string>

#include "terrain/pyramid/build/build.h"
#include "terrain/surface/surface.h"

namespace tind::cli {

/// Estimates and prints; returns the exit code. `update`, where there is one, becomes that member
/// of the JSON.
int print_estimate(const Surface&, const BuildOptions&, const std::string& progress, bool json,
                   std::uint64_t shards = 0, double dollars_per_core_hour = 0,
                   const nlohmann::ordered_json* update = nullptr);

}  // namespace tind::cli
