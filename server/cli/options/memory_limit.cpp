// The figures are what builds were measured to take, and a third more: tests hold builds to them.

#include "server/cli/options/memory_limit.h"

#include <fmt/format.h>
#include <malloc.h>

#include <algorithm>
#include <cstdlib>

#include "terrain/base/parallel.h"

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

}  // namespace

void add_memory_option(Command command, std::uint64_t& bytes) {
  command
      .add_option(
          "--memory", bytes,
          "most memory to take, e.g. 400M or 2G (default 1G); threads that there is no room "
          "for are left out")
      .bytes();
}

void limit_caches(std::uint64_t memory, const std::vector<std::string>& files, DemOptions& dem) {
  // An arena for each of many threads would keep as much each.
  mallopt(M_ARENA_MAX, 4);
  mallopt(M_MMAP_THRESHOLD, kKeptWorkspace);
  mallopt(M_TRIM_THRESHOLD, kKeptWorkspace);
  setenv("GDAL_CACHEMAX", std::to_string(gdal_bytes(memory) / kMega).c_str(), 1);
  dem.cache_bytes = std::clamp(memory / 16, 8 * kMega, 64 * kMega);
  const bool zipped = std::ranges::any_of(files, [](const auto& f) { return f.ends_with(".zip"); });
  dem.unpacked_bytes = zipped ? std::clamp(memory / 4, 32 * kMega, 256 * kMega) : 0;
}

Result<int> threads_within(std::uint64_t memory, const Surface& surface, const DemOptions& dem,
                           int threads) {
  const std::uint64_t each =
      surface.only() && surface.is_plain_geographic() ? kPerThread : kPerThreadProjected;
  const std::uint64_t layers = surface.layers().size();
  const std::uint64_t fixed =
      kProgram + gdal_bytes(memory) + layers * (dem.cache_bytes + dem.unpacked_bytes);
  if (memory < fixed + each) {
    std::uint64_t needed = memory;  // caches grow with it
    while (needed < kProgram + gdal_bytes(needed) +
                        layers * (std::max(8 * kMega, needed / 16) +
                                  (dem.unpacked_bytes ? std::max(32 * kMega, needed / 4) : 0)) +
                        each)
      needed += kMega;
    return fail(Errc::invalid_argument,
                fmt::format("--memory {}M is not enough for one thread with this source; {}M is",
                            memory / kMega, (needed + kMega - 1) / kMega));
  }
  const auto room = int(std::min<std::uint64_t>((memory - fixed) / each, 1024));
  return std::min(threads > 0 ? threads : hardware_threads(), room);
}

}  // namespace tind::cli
