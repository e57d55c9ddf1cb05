// Tiles a second, bytes a tile, and where the time goes. What is measured is checked, too: cracks
// and the certificate, over all posts.
//
//   tiles_bench [DEM [MAX_ERROR [LEVELS [THREADS]]]]    N49W123.tif 18.8 12 2

#include <cstdlib>
#include <mutex>

#include "terrain/base/parallel.h"
#include "terrain/check/check.h"
#include "terrain/pyramid/build/build.h"
#include "terrain/pyramid/make/make_tile.h"
#include "tests/support/bench.h"

namespace tind {
namespace {

using test::give_up;

constexpr int kRuns = 3;

struct Run {
  double seconds = 0, thread_seconds = 0, gzipping = 0;
  std::uint64_t tiles = 0, bytes = 0;
  TileCost cost;
};

/// Everything that a build does but for the disk.
Run make_all(const DemSource& source, const TileSetOptions& options, int threads) {
  Run run;
  run.seconds = test::seconds_of([&] {
    const auto range = scan_heights(source, {}, threads);
    if (!range) give_up(range.error().what);
    const auto plan = TilePlan::make(source, *range, options);
    if (!plan) give_up(plan.error().what);
    std::vector<TileId> ids;
    for (int z = plan->first_level(); z <= plan->last_level(); ++z) {
      const TileArea& tiles = plan->tiles(z);
      for (std::uint64_t i = 0; i < tiles.size(); ++i)
        ids.push_back({z, tiles[i].first, tiles[i].second});
    }
    run.tiles = ids.size();
    std::mutex mutex;
    parallel_for(ids.size(), threads, [&](std::size_t i) {
      Result<TileBytes> tile = fail(Errc::internal, "not made");
      std::size_t size = 0;
      double gzipping = 0;
      const double seconds = test::seconds_of([&] {
        tile = make_tile(source, *plan, ids[i]);
        if (tile) gzipping = test::seconds_of([&] { size = gzipped(tile->bytes).size(); });
      });
      const std::lock_guard lock(mutex);
      if (!tile) give_up(tile.error().what);
      run.bytes += size;
      run.gzipping += gzipping;
      run.thread_seconds += seconds;
      run.cost.reading += tile->cost.reading;
      run.cost.borders += tile->cost.borders;
      run.cost.fitting += tile->cost.fitting;
      run.cost.measuring += tile->cost.measuring;
      run.cost.encoding += tile->cost.encoding;
    });
  });
  return run;
}

std::uint64_t violations(std::shared_ptr<const DemSource> source, const TileSetOptions& options) {
  const test::TempDir dir;
  BuildOptions o;
  o.tiles = options;
  o.output = dir.file("tiles");
  o.gzip = true;
  if (const auto built = build_tiles(source, o); !built) give_up(built.error().what);
  CheckOptions check;
  check.source = source;
  const auto report = check_tiles(o.output, check);
  if (!report) give_up(report.error().what);
  return report->findings.total(Severity::violation);
}

int bench(int argc, char** argv) {
  const std::string dem = argc > 1 ? argv[1] : test::default_dem("N49W123.tif");
  const int threads = argc > 4 ? std::atoi(argv[4]) : 2;
  const auto source = DemSource::open(std::vector{dem});
  if (!source) give_up(source.error().what);
  TileSetOptions options;
  options.max_error_m = argc > 2 ? std::atof(argv[2]) : 18.8;
  options.max_level = argc > 3 ? std::atoi(argv[3]) : 12;
  fmt::print("{}, levels 0-{}, {} m at the leaves, {} threads, median of {} runs\n\n",
             std::filesystem::path(dem).filename().string(), options.max_level, options.max_error_m,
             threads, kRuns);
  fmt::print(
      "| effort | tiles | tiles/s | bytes/tile, gzip | violations | reading | borders | "
      "fitting | measuring | encoding | gzip |\n|---|---|---|---|---|---|---|---|---|---|---|\n");
  for (const Effort effort : {Effort::fast, Effort::normal}) {
    options.effort = effort;
    std::vector<double> rates;
    Run run;
    for (int i = 0; i < kRuns; ++i) {
      run = make_all(**source, options, threads);
      rates.push_back(double(run.tiles) / run.seconds);
    }
    const auto share = [&](double seconds) {
      return fmt::format("{:.0f} %", 100 * seconds / run.thread_seconds);
    };
    fmt::print("| {} | {} | {:.0f} | {:.0f} | {} | {} | {} | {} | {} | {} | {} |\n",
               name_of(effort), run.tiles, test::median(rates),
               double(run.bytes) / double(run.tiles), violations(*source, options),
               share(run.cost.reading), share(run.cost.borders), share(run.cost.fitting),
               share(run.cost.measuring), share(run.cost.encoding), share(run.gzipping));
    std::fflush(stdout);
  }
  return 0;
}

}  // namespace
}  // namespace tind

int main(int argc, char** argv) { return tind::bench(argc, argv); }
