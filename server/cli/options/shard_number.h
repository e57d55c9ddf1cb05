#pragma once
// --shard: which shards of a plan this process makes, said or taken from what the engine that
// started it has put into the environment.

#include <cstddef>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "terrain/base/result.h"

namespace tind::cli {

/// A variable of the environment, where it is set.
using Variables = std::function<std::optional<std::string>(const char* name)>;

/// `text`: "i/N" or "i", from 0; "top" (ShardTiles::kTop); or "auto", from these, of which one kind
/// must be set:
///   SLURM_ARRAY_TASK_ID        an array of `count` tasks, wherever it begins (_MIN, _COUNT); one
///                              of fewer tasks (to make some again) is numbered from 0
///   JOB_COMPLETION_INDEX       an Indexed Job of Kubernetes
///   AWS_BATCH_JOB_ARRAY_INDEX
///   OMPI_COMM_WORLD_RANK       with _SIZE, as PMI_RANK and PMI_SIZE: of fewer ranks than shards
///                              each makes every SIZE-th
///   PARALLEL_SEQ               GNU parallel, from 1
/// Fails (invalid_argument) for anything else, and for a number that no shard has.
Result<std::vector<std::size_t>> shards_to_make(const std::string& text, std::size_t count,
                                                const Variables&);

/// Those of this process.
Variables environment_variables();

}  // namespace tind::cli
