// Triangles and time of `bounded` by effort, in ratio to `greedy` in the same run; one thread, and
// two threads against one. Every mesh is measured by the referee before it counts.
//
//   bounded_bench [--eps 1,5,20] [--runs N] DEM...

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <vector>

#include "terrain/mesh/validity.h"
#include "terrain/mesh/vertical_error.h"
#include "terrain/raster/dem_source.h"
#include "terrain/simplify/simplify.h"
#include "tests/support/support.h"

using namespace tind;

namespace {

struct Timed {
  Simplified result;
  double seconds = 0;
};

/// The median of `runs` runs.
Timed run(const HeightGrid& grid, const DemInfo& info, SimplifyOptions o, int runs) {
  std::vector<double> seconds;
  Timed timed;
  for (int k = 0; k < runs; ++k) {
    const auto begin = std::chrono::steady_clock::now();
    auto r = simplify(grid, info.spacing_x_m, info.spacing_y_m, o);
    seconds.push_back(
        std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count());
    if (!r) {
      std::fprintf(stderr, "%s\n", r.error().what.c_str());
      std::exit(1);
    }
    timed.result = std::move(*r);
  }
  std::sort(seconds.begin(), seconds.end());
  timed.seconds = seconds[seconds.size() / 2];
  return timed;
}

void print_row(const char* name, const Timed& t, const Timed& base, const HeightGrid& grid,
               double eps) {
  const VerticalError e = vertical_error(t.result.tin, grid);
  const MeshValidity v = check_validity(t.result.tin);
  std::printf(
      "  %-18s %9zu triangles (%.3f)  %8.1f ms (%.2f x)  max %.6f  rms %.3f  flipped %zu  "
      "uncovered %llu%s\n",
      name, t.result.tin.triangles.size(),
      double(t.result.tin.triangles.size()) / double(base.result.tin.triangles.size()),
      t.seconds * 1e3, t.seconds / base.seconds, e.max_m, e.rms_m, v.flipped,
      static_cast<unsigned long long>(e.uncovered), e.max_m <= eps + 1e-9 ? "" : "  BOUND BROKEN");
}

}  // namespace

int main(int argc, char** argv) {
  std::vector<double> bounds = {1, 5, 20};
  std::vector<std::string> files;
  int runs = 3;
  for (int i = 1; i < argc; ++i) {
    const std::string word = argv[i];
    if (word == "--runs" && i + 1 < argc) {
      runs = std::max(1, std::atoi(argv[++i]));
    } else if (word == "--eps" && i + 1 < argc) {
      bounds.clear();
      for (char* at = argv[++i]; *at;) {
        bounds.push_back(std::strtod(at, &at));
        if (*at) ++at;
      }
    } else {
      files.push_back(word);
    }
  }
  if (files.empty()) {
    const std::string full = test::shared_data("dem/bigtujunga.tif");
    files.push_back(full.empty() ? test::testdata("bigtujunga_crop.tif") : full);
  }
  for (const std::string& file : files) {
    const std::vector<std::string> one = {file};
    const auto source = DemSource::open(one);
    if (!source) {
      std::fprintf(stderr, "%s\n", source.error().what.c_str());
      return 1;
    }
    const DemInfo& info = (*source)->info();
    const auto grid = (*source)->read(0, 0, int(info.cols), int(info.rows));
    if (!grid) {
      std::fprintf(stderr, "%s\n", grid.error().what.c_str());
      return 1;
    }
    for (const double eps : bounds) {
      std::printf("%s, %lld x %lld, max error %g m\n", file.substr(file.rfind('/') + 1).c_str(),
                  static_cast<long long>(info.cols), static_cast<long long>(info.rows), eps);
      SimplifyOptions o;
      o.stop.max_error_m = eps;
      o.method = "greedy";
      const Timed greedy = run(*grid, info, o, runs);
      print_row("greedy", greedy, greedy, *grid, eps);
      o.method = "bounded";
      for (const char* effort : {"fast", "normal", "best"}) {
        o.effort = effort;
        const Timed t = run(*grid, info, o, runs);
        print_row(effort, t, greedy, *grid, eps);
        if (o.effort != "normal") continue;
        o.threads = 2;
        const Timed two = run(*grid, info, o, runs);
        o.threads = 1;
        const bool same = two.result.tin.vertices == t.result.tin.vertices &&
                          two.result.tin.triangles == t.result.tin.triangles;
        std::printf("  two threads: %.2f x faster than one, %s\n", t.seconds / two.seconds,
                    same ? "same mesh" : "ANOTHER MESH");
      }
    }
  }
  return 0;
}
