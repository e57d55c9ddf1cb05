// The figures are what builds were measured to take, and a third more: tests hold builds to them.

#include "server/cli/options/memory_limit.h"

#include <fmt/format.h>
#include <malloc.h>

#include <algorithm>
#include <cstdlib>

#include "server/cli/options/dem_input.h"
#include "server/cli/options/surface_input.h"
#include "terrain/base/parallel.h"
#include "terrain/raster/dem_files.h"

namespace tind::cli {

namespace {

constexpr std::uint64_t kMega = 1 << 20;
constexpr std::uint64_t kProgram = 72 * kMega;  // itself, its libraries, lists of a large source
// The posts that one thread holds at a time and a mesh. Those of a projected source take more: each
// has a place.
constexpr std::uint64_t kPerThread = 48 * kMega, kPerThreadProjected = 96 * kMega;
// What an arena keeps of what was freed: a tile's work space is used again for the next. Its pages,
// taken and given back for each tile, were half of the time of one.
constexpr int kKeptWorkspace = 32 << 20;

std::uint64_t gdal_bytes(std::uint64_t memory) {
  return std::clamp(memory / 8, 16 * kMega, 128 * kMega);
}

std::uint64_t cache_bytes(std::uint64_t memory) {
  return std::clamp(memory / 16, 8 * kMega, 64 * kMega);
}
std::uint64_t unpacked_bytes(std::uint64_t memory) {
  return std::clamp(memory / 4, 32 * kMega, 256 * kMega);
}

/// Is any of the files, also in a folder or a list, or of a layer? (What cannot be read, whoever
/// opens it says.)
bool is_zipped(const DemInput& input, const SurfaceInput& layers, const DemOptions& dem) {
  const auto any = [&](const std::vector<std::string>& named) {
    const auto all = dem_files(named, dem);
    return all &&
           std::ranges::any_of(all->files, [](const auto& f) { return f.ends_with(".zip"); });
  };
  if (any(input.files)) return true;
  const auto read = read_layers(layers, dem);
  return read && std::ranges::any_of(read->layers, any, &LayerSpec::files);
}

}  // namespace

void add_memory_option(Command command, std::uint64_t& bytes) {
  command
      .add_option(
          "--memory", bytes,
          "most memory to take, e.g. 400M or 2G (default 1G); threads that there is no room "
          "for are left out")
      .bytes();
}

void limit_caches(std::uint64_t memory, const DemInput& input, const SurfaceInput& layers,
                  DemOptions& dem) {
  // An arena for each of many threads would keep as much each.
  // NOLINTBEGIN(concurrency-mt-unsafe): no other thread asks the environment yet
  mallopt(M_ARENA_MAX, 4);
  mallopt(M_MMAP_THRESHOLD, kKeptWorkspace);
  mallopt(M_TRIM_THRESHOLD, kKeptWorkspace);
  setenv("GDAL_CACHEMAX", std::to_string(gdal_bytes(memory) / kMega).c_str(), 1);
  // NOLINTEND(concurrency-mt-unsafe)
  dem.cache_bytes = cache_bytes(memory);
  dem.unpacked_bytes = is_zipped(input, layers, dem) ? unpacked_bytes(memory) : 0;
}

Result<int> threads_within(std::uint64_t memory, const Surface& surface, const DemOptions& dem,
                           int threads) {
  const std::uint64_t each =
      surface.only() && surface.is_plain_geographic() ? kPerThread : kPerThreadProjected;
  const std::uint64_t layers = surface.layers().size();
  // What is there before the first thread; caches grow with the memory, up to a bound.
  const auto fixed = [&](std::uint64_t all) {
    return kProgram + gdal_bytes(all) +
           layers * (cache_bytes(all) + (dem.unpacked_bytes > 0 ? unpacked_bytes(all) : 0));
  };
  if (memory < fixed(memory) + each) {
    std::uint64_t needed = memory;
    while (needed < fixed(needed) + each) needed += kMega;
    return fail(Errc::invalid_argument,
                fmt::format("--memory {}{} is not enough for one thread with this source; {}M is",
                            memory < kMega ? memory : memory / kMega, memory < kMega ? "" : "M",
                            (needed + kMega - 1) / kMega));
  }
  const auto room = int(std::min<std::uint64_t>((memory - fixed(memory)) / each, 1024));
  return std::min(threads > 0 ? threads : hardware_threads(), room);
}

}  // namespace tind::cli
