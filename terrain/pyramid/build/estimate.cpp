#include "terrain/pyramid/build/estimate.h"

#include <chrono>
#include <cmath>
#include <mutex>
#include <optional>

#include "terrain/base/parallel.h"
#include "terrain/pyramid/make/make_tile.h"
#include "terrain/pyramid/plan/plan_source.h"

namespace tind {

namespace {

using Clock = std::chrono::steady_clock;
constexpr std::uint64_t kWhole = 16;  // levels of up to so many tiles are made whole

double since(Clock::time_point t) {
  return std::chrono::duration<double>(Clock::now() - t).count();
}

/// A number that says nothing about its argument (the finaliser of SplitMix64).
std::uint64_t scrambled(std::uint64_t x) {
  x += 0x9e3779b97f4a7c15;
  x = (x ^ x >> 30) * 0xbf58476d1ce4e5b9;
  x = (x ^ x >> 27) * 0x94d049bb133111eb;
  return x ^ x >> 31;
}

std::vector<TileId> sample_of(int level, const TileArea& tiles) {
  const std::uint64_t count = tiles.size();
  const std::uint64_t wanted =
      count <= kWhole ? count : std::min(count, kWhole + std::uint64_t(std::sqrt(double(count))));
  std::vector<TileId> ids;
  for (std::uint64_t k = 0; k < wanted; ++k) {
    const std::uint64_t begin = count * k / wanted, end = count * (k + 1) / wanted;
    const std::uint64_t i = begin + scrambled(std::uint64_t(level) << 48 ^ begin) %
                                        std::max<std::uint64_t>(1, end - begin);
    const auto [x, y] = tiles[i];
    ids.push_back({level, x, y});
  }
  return ids;
}

struct Made {
  double bytes = 0, seconds = 0;
};

LevelEstimate extrapolated(int level, std::uint64_t count, const std::vector<Made>& made) {
  LevelEstimate e{.level = level, .tiles = count, .sampled = made.size()};
  const double n = double(made.size());
  double mean = 0, squares = 0, seconds = 0;
  for (const Made& m : made) mean += m.bytes / n, seconds += m.seconds / n;
  for (const Made& m : made) squares += (m.bytes - mean) * (m.bytes - mean);
  e.bytes = mean * double(count);
  e.seconds = seconds * double(count);
  if (e.sampled < count)
    e.bytes_error = double(count) * std::sqrt(squares / (n - 1) / n * (1 - n / double(count)));
  return e;
}

}  // namespace

Result<BuildEstimate> estimate_build(const Surface& surface, const BuildOptions& o,
                                     const Progress& progress) {
  BuildEstimate estimate;
  estimate.threads = o.threads > 0 ? o.threads : hardware_threads();
  const auto begin = Clock::now();
  Progress reading = progress;
  reading.report = [&](double share) { progress.at(0.1 * share); };
  const auto plan = plan_source(surface, o.tiles, "", o.threads, reading);
  if (!plan) return std::unexpected(plan.error());
  estimate.reading_seconds = since(begin);

  std::vector<TileId> ids;
  for (int z = plan->last_level(); z >= plan->first_level(); --z)
    for (const TileId id : sample_of(z, plan->tiles(z))) ids.push_back(id);
  std::vector<Made> made(ids.size());
  std::mutex mutex;
  std::optional<Error> error;
  std::size_t done = 0;
  parallel_for(ids.size(), estimate.threads, [&](std::size_t i) {
    {
      const std::lock_guard lock(mutex);
      if (error || progress.stopped()) return;
    }
    const auto start = Clock::now();
    auto tile = make_tile(surface, *plan, ids[i], progress.stop);
    if (tile)
      made[i] = {double(o.gzip ? gzipped(tile->bytes).size() : tile->bytes.size()), since(start)};
    const std::lock_guard lock(mutex);
    if (!tile && !error) error = tile.error();
    progress.at(0.1 + 0.9 * double(++done) / double(ids.size()));
  });
  if (progress.stopped()) return fail(Errc::cancelled, "stopped");
  if (error) return std::unexpected(*error);

  double variance = 0;
  for (int z = plan->first_level(); z <= plan->last_level(); ++z) {
    std::vector<Made> of_level;
    for (std::size_t i = 0; i < ids.size(); ++i)
      if (ids[i].level == z) of_level.push_back(made[i]);
    estimate.levels.push_back(extrapolated(z, plan->tiles(z).size(), of_level));
    const LevelEstimate& level = estimate.levels.back();
    estimate.tiles += level.tiles;
    estimate.sampled += level.sampled;
    estimate.bytes += level.bytes;
    variance += level.bytes_error * level.bytes_error;
  }
  estimate.bytes_error = std::sqrt(variance);
  estimate.seconds = estimate.reading_seconds + estimate.thread_seconds() / estimate.threads;
  return estimate;
}

}  // namespace tind
