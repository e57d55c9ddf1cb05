// What reading costs by file, pattern and datum; times in ratio to one sequential pass over the
// same file in the same run.

#include <fmt/format.h>

#include <chrono>
#include <cstdio>
#include <random>

#include "terrain/base/parallel.h"
#include "terrain/raster/dem_source.h"
#include "tests/support/support.h"

namespace tind {
namespace {

using Clock = std::chrono::steady_clock;

/// Microseconds of one call after opening the source anew (cold cache).
template <class Work>
double microseconds(const std::string& file, const DemOptions& options, const Work& work) {
  const auto source = DemSource::open({&file, 1}, options);
  if (!source) {
    fmt::print("{}\n", source.error().what);
    return 0;
  }
  const auto start = Clock::now();
  work(**source);
  return std::chrono::duration<double, std::micro>(Clock::now() - start).count();
}

void read_or_die(const DemSource& source, std::int64_t col, std::int64_t row, int cols, int rows,
                 int step) {
  const auto grid = source.read_decimated(col, row, cols, rows, step);
  if (!grid) std::fprintf(stderr, "%s\n", grid.error().what.c_str());
}

void table(const std::string& file) {
  const DemOptions plain, shifted{.from_datum = VerticalDatum::egm96,
                                  .to_datum = TargetDatum::ellipsoid,
                                  .environment = test::environment()};
  std::int64_t cols = 0, rows = 0;
  double once = 0;
  const auto line = [&](const char* what, double posts, double us) {
    if (once == 0) once = us;
    fmt::print("  {:<44} {:>10.3f} ms {:>8.1f} posts/us {:>8.2f} x\n", what, us / 1e3, posts / us,
               us / once);
  };
  const auto whole = [&](const DemSource& s) {
    cols = s.info().cols, rows = s.info().rows;
    read_or_die(s, 0, 0, int(cols), int(rows), 1);
  };
  fmt::print("{}\n", file.substr(file.rfind('/') + 1));
  microseconds(file, plain, whole);  // the operating system's own cache is warm in all that follow
  const double us = microseconds(file, plain, whole);
  const double all = double(cols) * double(rows);
  line("whole, once (cold)", all, us);
  line("whole, to the ellipsoid", all, microseconds(file, shifted, whole));
  const auto tiles = [&](const DemSource& s) {  // 68 x 68 windows, 64 apart, as tiles read
    for (std::int64_t r = 0; r < rows; r += 64)
      for (std::int64_t c = 0; c < cols; c += 64) read_or_die(s, c - 2, r - 2, 68, 68, 1);
  };
  line("all 68 x 68 windows, row by row", all, microseconds(file, plain, tiles));
  line("the same again (cached)", all, microseconds(file, plain, [&](const DemSource& s) {
         tiles(s);
         const auto start = Clock::now();
         tiles(s);
         fmt::print("  {:<44} {:>10.3f} ms\n", "  of which the second pass",
                    std::chrono::duration<double, std::milli>(Clock::now() - start).count());
       }));
  line("the same, 2 threads", all, microseconds(file, plain, [&](const DemSource& s) {
         parallel_for(std::size_t((rows + 63) / 64), 2, [&](std::size_t i) {
           for (std::int64_t c = 0; c < cols; c += 64)
             read_or_die(s, c - 2, std::int64_t(i) * 64 - 2, 68, 68, 1);
         });
       }));
  for (const int step : {4, 16, 64}) {
    const double posts = double(cols / step) * double(rows / step);
    line(fmt::format("every {}th post", step).c_str(), posts,
         microseconds(file, plain, [&](const DemSource& s) {
           read_or_die(s, 0, 0, int(cols / step), int(rows / step), step);
         }));
  }
  line("1000 heights at random places", 1000, microseconds(file, plain, [&](const DemSource& s) {
         std::mt19937 random(1);
         const GeoRect& b = s.info().bounds;
         std::uniform_real_distribution<double> x(b.west, b.east), y(b.south, b.north);
         for (int i = 0; i < 1000 && s.info().crs_kind != CrsKind::none; ++i)
           if (!height_at(s, {x(random), y(random)})) std::fprintf(stderr, "unreadable\n");
       }));
}

}  // namespace
}  // namespace tind

int main() {
  tind::table(tind::test::testdata("rainier.tif"));
  for (const char* name :
       {"dem/bigtujunga.tif", "dem/N48W125.hgt.zip", "dem/etopo5_int16.tif",
        "dem/n33_w116_3arc_v2.dt1", "dem/swissalti_2.5m_lv95.tif", "dem/SainteHelens.dem"})
    if (const std::string file = tind::test::shared_data(name); !file.empty()) tind::table(file);
}
