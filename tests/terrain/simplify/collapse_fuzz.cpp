// Bytes -> a small grid of integer heights (the most degenerate there are), a method and a stop ->
// every promise of simplify.h.

#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>

#include "terrain/mesh/validity.h"
#include "terrain/mesh/vertical_error.h"
#include "terrain/simplify/common/simplified.h"
#include "terrain/simplify/common/terrain_mesh.h"
#include "terrain/simplify/options.h"
#include "terrain/simplify/simplify.h"
#include "tests/support/fuzz_bytes.h"

namespace {

using namespace tind;

using test::require;
using Bytes = test::FuzzBytes;

SimplifyOptions options_from(Bytes& in) {
  SimplifyOptions o;
  const unsigned method = in.next() % 3;
  EdgeCostOptions edge_cost;
  edge_cost.term = EnumNames<Term>::kAll[in.next() % 4].first;
  edge_cost.alpha = in.next() / 16.0;
  edge_cost.beta = in.next() / 16.0;
  const unsigned flags = in.next();
  if (method == 0)
    o.method = edge_cost;
  else if (method == 1)
    o.method =
        QemOptions{.subset_placement = (flags & 1) != 0, .border_constraints = (flags & 2) != 0};
  else
    o.method = MemorylessOptions{};
  const unsigned amount = in.next();
  if (flags & 4)
    o.stop.max_error_m = amount / 8.0;
  else if (flags & 8)
    o.stop.ratio = (amount + 1) / 256.0;
  else
    o.stop.triangles = amount + 1;
  return o;
}

HeightGrid grid_from(Bytes& in) {
  HeightGrid grid(2 + int(in.next() % 11), 2 + int(in.next() % 11));
  const bool voids = in.next() % 2;
  for (float& z : grid.values()) {
    const unsigned b = in.next();
    z = voids && b % 16 == 15 ? HeightGrid::kVoid : float(b % 11) * (b > 200 ? 1000.f : 1.f);
  }
  return grid;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  Bytes in{data, size};
  const SimplifyOptions o = options_from(in);
  const HeightGrid grid = grid_from(in);
  const Result<Simplified> s = simplify({grid, 1 + in.next() / 8.0, 1 + in.next() / 8.0}, o);
  const Result<TerrainMesh> full = terrain_mesh({grid, 1, 1});
  require(s.has_value() == full.has_value(), "fails only where there is no triangle");
  if (!s) return 0;
  const Tin input = full->mesh.to_tin();
  const MeshValidity v = check_validity(s->tin), before = check_validity(input);
  require(v.ok(), v.first_problem.c_str());
  require(v.area == before.area, "the same area");
  const VerticalError e = vertical_error(s->tin, grid);
  require(e.uncovered == vertical_error(input, grid).uncovered, "nothing uncovered");
  if (o.stop.max_error_m) require(e.max_m <= *o.stop.max_error_m, "the error bound");
  const auto target =
      o.stop.triangles ? *o.stop.triangles
                       : std::uint64_t(o.stop.ratio.value_or(0) * double(input.triangles.size()));
  if (!o.stop.max_error_m && s->note.empty())  // the last collapse may take one more than wanted
    require(s->tin.triangles.size() <= target && s->tin.triangles.size() + 1 >= target,
            "the count");
  return 0;
}
