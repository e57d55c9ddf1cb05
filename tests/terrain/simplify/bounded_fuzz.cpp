// Bytes -> a small grid (plateaus, steps, spikes, voids) and how to mesh it -> every promise of
// bounded.h: through the front door, in blocks of a few posts, and inside a locked border.

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>

#include "terrain/mesh/validity.h"
#include "terrain/mesh/vertical_error.h"
#include "terrain/simplify/bounded/bounded.h"
#include "terrain/simplify/bounded/bounded_blocks.h"
#include "terrain/simplify/simplify.h"
#include "tests/support/fuzz_bytes.h"

namespace {

using namespace tind;

using test::require;
using Bytes = test::FuzzBytes;

constexpr double kErrors[] = {0.001, 0.5, 1, 3, 10, 100, 1e4};

HeightGrid grid_from(Bytes& in) {
  HeightGrid grid(2 + int(in.next() % 23), 2 + int(in.next() % 23));
  const unsigned kind = in.next();
  const bool voids = kind & 1;
  float last = 0;
  for (int r = 0; r < grid.rows(); ++r) {
    for (int c = 0; c < grid.cols(); ++c) {
      const unsigned b = in.next();
      float z = float(b % 16);                                // noise
      if (kind & 2) z = last = b % 8 == 7 ? float(b) : last;  // plateaus and steps
      if (kind & 4) z = float(c * c) / 4 + float(r * r) / 8;  // a bowl
      if (kind & 8) z = float(3 * c - 2 * r);                 // a plane
      if (kind & 16 && b > 240) z += float(b) * 33;           // spikes
      if (kind & 32) z += 0.1f * float(b % 3);                // nothing is round
      grid.at(c, r) = voids && b % 16 == 15 ? HeightGrid::kVoid : z;
    }
  }
  return grid;
}

void check(const Tin& tin, const HeightGrid& grid, double above, double below) {
  const MeshValidity v = check_validity(tin);
  require(v.ok(), v.first_problem.c_str());
  require(v.area == double(grid.cols() - 1) * (grid.rows() - 1), "the whole rectangle");
  const VerticalError e = vertical_error(tin, grid);
  require(e.uncovered == 0, "nothing uncovered");
  require(e.max_above_m <= above, "the bound above");
  require(e.max_below_m <= below, "the bound below");
  for (const Vec3& p : tin.vertices) require(std::isfinite(p.z), "finite heights");
}

void front_door(Bytes& in) {
  SimplifyOptions o;
  const Effort efforts[] = {Effort::fast, Effort::normal, Effort::best};
  const Side sides[] = {Side::both, Side::above, Side::below};
  const Effort effort = efforts[in.next() % 3];
  const unsigned side = in.next() % 3;
  o.method = BoundedOptions{effort, sides[side]};
  const unsigned amount = in.next();
  const bool count = amount % 4 == 0;
  if (count)
    o.stop.triangles = amount / 4 + 2;
  else
    o.stop.max_error_m = kErrors[amount % 7];
  const double x = 1 + in.next() / 8.0, y = 1 + in.next() / 8.0;
  const HeightGrid grid = grid_from(in);
  const bool empty = std::ranges::all_of(grid.values(), [](float z) { return std::isnan(z); });
  const auto s = simplify({grid, x, y}, o);
  require(s.has_value() != empty, "fails only where there is no height");
  if (!s) return;
  if (count) require(s->tin.triangles.size() <= *o.stop.triangles, "the count");
  const double m = count ? 1e9 : *o.stop.max_error_m;
  check(s->tin, grid, side == 2 && !count ? 1e-9 : m, side == 1 && !count ? 1e-9 : m);
}

void small_blocks(Bytes& in) {
  BlockOptions o;
  o.mesher.eps = kErrors[in.next() % 7];
  o.mesher.rounds = int(in.next() % 3);
  const unsigned search = in.next();
  o.mesher.search_reach = search / 64.0;
  o.mesher.step_gain = search % 4 / 8.0;
  o.mesher.search_step_min = 0.125;
  o.block_posts = 2 + int(in.next() % 8);
  const HeightGrid grid = grid_from(in);
  const auto one = mesh_in_blocks(rows_of(grid), o, {});
  if (!one) return;
  check(one->tin, grid, o.mesher.eps, o.mesher.eps);
  o.threads = 3;
  const auto three = mesh_in_blocks(rows_of(grid), o, {});
  require(three && one->tin.vertices == three->tin.vertices &&
              one->tin.triangles == three->tin.triangles,
          "the same for any number of threads");
}

/// Inside a locked border whose vertices are some of the border's posts.
void locked(Bytes& in) {
  MesherOptions o;
  o.eps = kErrors[in.next() % 7];
  o.relief = 1e4;
  o.rounds = int(in.next() % 3);
  o.locked_border = true;
  const unsigned keep = in.next();
  const HeightGrid grid = grid_from(in);
  const int c1 = grid.cols() - 1, r1 = grid.rows() - 1;
  const auto post = [&](int c, int r) {
    return Vec3{double(c), -double(r), grid.is_void(c, r) ? 0.0 : double(grid.at(c, r))};
  };
  HalfedgeMesh mesh = *HalfedgeMesh::from_tin(
      {{post(0, r1), post(c1, r1), post(c1, 0), post(0, 0)}, {{0, 1, 2}, {0, 2, 3}}, {}, {}, {}});
  GridSamples samples;
  samples.cols = grid.cols(), samples.rows = grid.rows();
  samples.z = grid.values().data();
  DelaunayInsertion<GridSamples> frame(mesh, samples, {});
  for (int c = 1; c < c1; ++c)
    for (const int r : {0, r1})
      if ((unsigned(c) + keep) % 3 == 0) frame.insert_point(post(c, r));
  for (int r = 1; r < r1; ++r)
    for (const int c : {0, c1})
      if ((unsigned(r) + keep) % 2 == 0) frame.insert_point(post(c, r));
  const std::vector<Vec3> border(mesh.positions().begin(), mesh.positions().end());
  o.pinned = std::uint32_t(border.size());
  BoundedMesher<GridSamples> mesher(std::move(mesh), samples, o);
  mesher.run();
  for (std::uint32_t v = 0; v < border.size(); ++v)
    require(mesher.mesh().alive_vertex(v) && mesher.mesh().position(v) == border[v],
            "the border as it was");
  const std::string problem = mesher.mesh().check();
  require(problem.empty(), problem.c_str());
  // Posts on the border are the frame's business.
  HeightGrid inner = grid;
  for (int c = 0; c <= c1; ++c) inner.at(c, 0) = inner.at(c, r1) = HeightGrid::kVoid;
  for (int r = 0; r <= r1; ++r) inner.at(0, r) = inner.at(c1, r) = HeightGrid::kVoid;
  const Tin tin = mesher.mesh().to_tin();
  std::size_t on_border = 0;
  for (const Vec3& p : tin.vertices) on_border += p.x == 0 || p.x == c1 || p.y == 0 || p.y == -r1;
  require(on_border == border.size(), "no new vertex on the border");
  check(tin, inner, o.eps, o.eps);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  Bytes in{data, size};
  switch (in.next() % 3) {
    case 0:
      front_door(in);
      break;
    case 1:
      small_blocks(in);
      break;
    default:
      locked(in);
  }
  return 0;
}
