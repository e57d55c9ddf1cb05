#pragma once
// --memory: what of it goes to caches, and how many threads the rest is enough for.

#include <cstddef>
#include <cstdint>

#include "server/cli/program/command_line.h"
#include "terrain/base/result.h"
#include "terrain/raster/dem_source.h"
#include "terrain/surface/surface.h"

namespace tind::cli {

struct DemInput;
struct SurfaceInput;

inline constexpr std::uint64_t kDefaultMemory = std::uint64_t(1) << 30;

/// --memory, in bytes; "200M" and "1G" count in powers of 1024.
void add_memory_option(Command, std::uint64_t& bytes);

/// Divides the memory among caches and sets those that are not a source's own. Before the first
/// source is opened.
void limit_caches(std::uint64_t memory, const DemInput&, const SurfaceInput&, DemOptions&);

/// As many of the threads that are asked for (0: one per core) as there is memory to work in. Fails
/// where there is not enough for one.
Result<int> threads_within(std::uint64_t memory, const Surface&, const DemOptions&, int threads);

}  // namespace tind::cli
