// The table of [Kim], on Crater Lake and Ashby Gap: edge-cost beside qem at 10, 30, 50, 70 and
// 90 % removal.
//
//   crater_table_bench [--runs N] [DEM...]
//
// Each time is the median of N runs, the two methods taking turns. Ends with 1 when anything is
// flipped or uncovered.

#include "terrain/mesh/validity.h"
#include "terrain/mesh/vertical_error.h"
#include "terrain/simplify/common/simplified.h"
#include "terrain/simplify/methods.h"
#include "terrain/simplify/options.h"
#include "terrain/simplify/simplify.h"
#include "tests/support/bench.h"

namespace {

using namespace tind;
using namespace tind::test;

struct Row {
  double seconds = 0;
  std::size_t triangles = 0;
  VerticalError error;
  std::size_t flipped = 0;
};

Simplified made(const BenchDem& dem, const std::string& method, double ratio) {
  SimplifyOptions o;
  o.method = *method_named(method);
  o.stop.ratio = ratio;
  Result<Simplified> s = simplify(dem.terrain, o);
  if (!s) {
    fmt::print(stderr, "{}\n", s.error().what);
    std::exit(2);
  }
  return std::move(*s);
}

/// Both methods at one ratio, in turns.
std::array<Row, 2> measure(const BenchDem& dem, double ratio, int runs) {
  const std::array<std::string, 2> methods{"edge-cost", "qem"};
  std::array<std::vector<double>, 2> seconds;
  std::array<Row, 2> rows;
  for (int run = 0; run < runs; ++run) {
    for (int m = 0; m < 2; ++m) {
      Simplified s;
      seconds[m].push_back(seconds_of([&] { s = made(dem, methods[m], ratio); }));
      if (run > 0) continue;
      rows[m].triangles = s.tin.triangles.size();
      rows[m].error = vertical_error(s.tin, dem.terrain.grid);
      rows[m].flipped = check_validity(s.tin).flipped;
    }
  }
  for (int m = 0; m < 2; ++m) rows[m].seconds = median(seconds[m]);
  return rows;
}

bool print_table(const BenchDem& dem, int runs) {
  bool sound = true;
  fmt::print("\n{}: {} x {} posts\n", dem.name, dem.terrain.grid.cols(), dem.terrain.grid.rows());
  fmt::print(
      "removed  triangles | edge-cost   ms    max m   RMS m flip uncov | qem   ms    max m   "
      "RMS m flip uncov | time ratio\n");
  for (const int removed : {10, 30, 50, 70, 90}) {
    const auto [edge, qem] = measure(dem, 1 - removed / 100.0, runs);
    fmt::print("{:6d} % {:10d} |", removed, edge.triangles);
    for (const Row& r : {edge, qem}) {
      fmt::print(" {:13.1f} {:8.2f} {:7.3f} {:4d} {:5d} |", 1000 * r.seconds, r.error.max_m,
                 r.error.rms_m, r.flipped, r.error.uncovered);
      sound = sound && r.flipped == 0 && r.error.uncovered == 0;
    }
    fmt::print(" {:10.3f}\n", edge.seconds / qem.seconds);
  }
  return sound;
}

}  // namespace

int main(int argc, char** argv) {
  int runs = 7;
  std::vector<std::string> paths;
  for (int i = 1; i < argc; ++i) {
    if (std::string(argv[i]) == "--runs" && i + 1 < argc)
      runs = std::max(1, std::atoi(argv[++i]));
    else
      paths.push_back(argv[i]);
  }
  if (paths.empty())
    for (const char* name : {"crater.tif", "ashby.tif"})
      if (const std::string path = default_dem(name); !path.empty()) paths.push_back(path);
  bool sound = true;
  for (const std::string& path : paths) sound = print_table(load_dem(path), runs) && sound;
  return sound ? 0 : 1;
}
