#pragma once
// What the benchmarks share: a DEM by name, a clock, a median.

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <ctime>
#include <string>
#include <vector>

#include "terrain/base/result.h"
#include "terrain/raster/dem_source.h"
#include "terrain/raster/height_grid.h"
#include "terrain/raster/terrain.h"
#include "tests/support/support.h"

namespace tind::test {

struct BenchDem {
  std::string name;
  Terrain terrain;
};

/// testdata/NAME, or dem/NAME of the shared data; empty when neither is there.
inline std::string default_dem(const std::string& name) {
  const std::string own = testdata(name);
  return std::filesystem::exists(own) ? own : shared_data("dem/" + name);
}

/// Says what is wrong and ends the program.
[[noreturn]] inline void give_up(const std::string& why) {
  fmt::print(stderr, "{}\n", why);
  std::exit(2);
}

/// Reads a whole DEM; says what is wrong and ends the program when it cannot.
inline BenchDem load_dem(const std::string& path) {
  const auto dem = DemSource::open(std::vector{path});
  if (!dem) give_up(path + ": " + dem.error().what);
  const DemInfo& info = (*dem)->info();
  Result<HeightGrid> grid = (*dem)->read(0, 0, int(info.cols), int(info.rows));
  if (!grid) give_up(path + ": " + grid.error().what);
  return {std::filesystem::path(path).filename().string(), terrain_of(std::move(*grid), info)};
}

template <class F>
double seconds_of(F&& f) {
  const auto start = std::chrono::steady_clock::now();
  f();
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

/// Processor time of the whole process: other work on the machine shows little.
template <class F>
double processor_seconds_of(F&& f) {
  const std::clock_t start = std::clock();
  f();
  return double(std::clock() - start) / CLOCKS_PER_SEC;
}

inline double median(std::vector<double> v) {
  std::sort(v.begin(), v.end());
  return v[v.size() / 2];
}

}  // namespace tind::test
