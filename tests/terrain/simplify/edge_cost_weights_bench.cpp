// The experiment that chooses edge-cost's default weights: every pair of alpha and beta, the five
// levels of [Kim], two terrains. A pair's score is its error over the error of alpha = beta =
// 0, as the geometric mean over all levels and terrains; beside it the vertex-removal criteria that
// the paper compares with.
//
//   edge_cost_weights_bench [DEM...]        default: crater.tif and ashby.tif

#include <cmath>

#include "terrain/mesh/vertical_error.h"
#include "terrain/simplify/common/simplified.h"
#include "terrain/simplify/options.h"
#include "terrain/simplify/simplify.h"
#include "tests/support/bench.h"

namespace {

using namespace tind;
using namespace tind::test;

constexpr int kRemoved[] = {10, 30, 50, 70, 90};

/// Max and RMS error per DEM and level.
struct Errors {
  std::vector<double> max, rms;
};

Errors errors_of(const std::vector<BenchDem>& dems, SimplifyOptions o) {
  Errors out;
  for (const BenchDem& dem : dems) {
    for (const int removed : kRemoved) {
      o.stop.ratio = 1 - removed / 100.0;
      const Result<Simplified> s = simplify(dem.terrain, o);
      if (!s) {
        fmt::print(stderr, "{}\n", s.error().what);
        std::exit(2);
      }
      const VerticalError e = vertical_error(s->tin, dem.terrain.grid);
      out.max.push_back(e.max_m);
      out.rms.push_back(e.rms_m);
    }
  }
  return out;
}

double geometric_mean_ratio(const std::vector<double>& a, const std::vector<double>& b) {
  double sum = 0;
  for (std::size_t i = 0; i < a.size(); ++i) sum += std::log(a[i] / b[i]);
  return std::exp(sum / double(a.size()));
}

void print_row(const std::string& name, const Errors& e, const Errors& base) {
  fmt::print(
      "{:24} {:6.3f} {:6.3f} {:6.3f} |", name, geometric_mean_ratio(e.max, base.max),
      geometric_mean_ratio(e.rms, base.rms),
      std::sqrt(geometric_mean_ratio(e.max, base.max) * geometric_mean_ratio(e.rms, base.rms)));
  for (const double m : e.max) fmt::print(" {:7.2f}", m);
  fmt::print(" |");
  for (const double r : e.rms) fmt::print(" {:6.3f}", r);
  fmt::print("\n");
}

}  // namespace

int main(int argc, char** argv) {
  std::vector<BenchDem> dems;
  for (int i = 1; i < argc; ++i) dems.push_back(load_dem(argv[i]));
  if (dems.empty())
    for (const char* name : {"crater.tif", "ashby.tif"})
      if (const std::string path = default_dem(name); !path.empty()) dems.push_back(load_dem(path));

  fmt::print("levels: 10 30 50 70 90 % removed of");
  for (const BenchDem& dem : dems) fmt::print(" {}", dem.name);
  fmt::print("\n{:24} {:>6} {:>6} {:>6} | max m per level | RMS m per level\n", "", "max", "RMS",
             "both");
  SimplifyOptions o;
  const EdgeCostOptions defaults;
  o.method = EdgeCostOptions{.alpha = 0, .beta = 0};
  const Errors base = errors_of(dems, o);
  for (const double alpha : {0.0, 0.25, 0.5, 1.0, 2.0, 4.0, 8.0, 32.0, 128.0, 1000.0}) {
    for (const double beta : {0.0, 0.25, 0.5, 1.0, 2.0, 4.0}) {
      o.method = EdgeCostOptions{alpha, beta};
      const bool chosen = alpha == defaults.alpha && beta == defaults.beta;
      print_row(fmt::format("alpha {:<5g} beta {:<5g}{}", alpha, beta, chosen ? " <-" : ""),
                errors_of(dems, o), base);
    }
  }
  for (const Term term : {Term::height, Term::degree}) {
    SimplifyOptions alone;
    alone.method = EdgeCostOptions{.term = term};
    print_row(fmt::format("{} alone", name_of(term)), errors_of(dems, alone), base);
  }
  for (const Criterion criterion : {Criterion::plane, Criterion::degree, Criterion::k_degree}) {
    SimplifyOptions removal;
    removal.method = VertexRemovalOptions{.criterion = criterion};
    print_row(fmt::format("vertex-removal {}", name_of(criterion)), errors_of(dems, removal), base);
  }
}
