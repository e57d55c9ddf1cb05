#pragma once
// tind build --plan: the shards of a plan, made by one process.

#include <cstdint>
#include <memory>
#include <string>

#include "server/cli/options/plan_input.h"
#include "server/cli/program/command_line.h"

namespace tind {
class Environment;
}

namespace tind::cli {

struct ShardLine {
  std::string plan, shard;
  double grace_s = 25;
};

/// --plan, --shard, --grace.
void add_shard_options(Command, ShardLine&);

/// `output`: empty: the plan's folder. The exit code.
int build_shards(const ShardLine&, const std::string& output, const NamedAgain&,
                 std::shared_ptr<const Environment>, std::uint64_t memory, int threads,
                 const std::string& progress, bool json);

}  // namespace tind::cli
