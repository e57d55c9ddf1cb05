#pragma once
// Plans of shards as the command line names them, and what a plan says is to be opened.

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "server/cli/options/dem_input.h"
#include "server/cli/options/surface_input.h"
#include "server/cli/program/command_line.h"
#include "terrain/base/result.h"
#include "terrain/pyramid/shards/shard_plan.h"
#include "terrain/surface/surface.h"

namespace tind::cli {

/// The words of a command line, to be kept in a plan.
PlannedSource planned_source(const DemInput&, const SurfaceInput&, const ShapeFiles&);

Result<ShardPlan> read_plan(const std::string& path);

/// Where the shards of a plan are: `said`, or where that is empty the folder of the plan.
std::string shards_folder(const std::string& plan, const std::string& said);
/// The same of shards that are to be there: not_found for a folder that is not. The folder `shards`
/// itself may be named, too.
Result<std::string> shards_to_read(const std::string& plan, const std::string& said);

/// What a plan says is to be opened, where it is elsewhere on this machine: what is empty is where
/// the plan says.
struct NamedAgain {
  std::vector<std::string> files;   // the DEMs
  std::vector<std::string> layers;  // NAME=FILE[,FILE...], of a plan of layers
  ShapeFiles shapes;
};

/// The same as options, for a command that builds nothing without a plan.
void add_named_again(Command, NamedAgain&);

/// What is planned, with caches and threads (`threads`: as many as are asked for, then as there is
/// memory for) as `tind build` has them.
Result<Surface> open_planned(const ShardPlan&, const NamedAgain&,
                             std::shared_ptr<const Environment>, std::uint64_t memory,
                             int& threads);

}  // namespace tind::cli
