// Every tile of a pyramid to its parent's part [Yoon]: how many pairs succeed, how many
// vertices the splits cost, whether anything flips or neighbours differ on the way.
//
//   transition_bench [DIR]    a directory made by `tind build`; else the pyramid of rainier.tif

#include <cmath>
#include <map>
#include <random>

#include "terrain/base/parallel.h"
#include "terrain/pyramid/make/dem_tiles.h"
#include "terrain/pyramid/make/tile_transition.h"
#include "terrain/store/open/stored_tiles.h"
#include "terrain/store/tile_set.h"
#include "terrain/surface/post_warp.h"
#include "tests/support/bench.h"

using namespace tind;

namespace {

using Line = std::map<double, double>;

Line side(const Tin& mesh, bool vertical, double at) {
  Line out;
  for (const Vec3& v : mesh.vertices)
    if ((vertical ? v.x : v.y) == at) out[vertical ? v.y : v.x] = v.z;
  return out;
}

struct Pair {
  bool made = false;
  std::string error;
  std::size_t fine = 0, base = 0, all = 0, flips = 0;
  std::array<std::vector<Line>, 4> sides;  // west, south, east, north, by parameter
};

Pair run(const TileSet& set, TileId id, const std::vector<double>& parameters) {
  Pair out;
  const auto fine = set.tile(id, {}), parent = set.tile(id.parent(), {});
  if (!fine || !parent) {
    out.error = (fine ? parent : fine).error().what;
    return out;
  }
  const auto made = tile_transition(id, fine->bytes, parent->bytes);
  out.made = made.has_value();
  if (!made) {
    out.error = made.error().what;
    return out;
  }
  const TerrainTransition way = from_wire(*made);
  out.fine = way.fine_vertices, out.base = way.base_vertices(), out.all = way.vertices.size();
  for (const double s : parameters) {
    const Tin mesh = mesh_at(way, s);
    for (const Triangle& t : mesh.triangles)
      out.flips += orient2d(mesh.vertices[t[0]], mesh.vertices[t[1]], mesh.vertices[t[2]]) < -1e-6;
    out.sides[0].push_back(side(mesh, true, 0));
    out.sides[1].push_back(side(mesh, false, 0));
    out.sides[2].push_back(side(mesh, true, kTileExtent));
    out.sides[3].push_back(side(mesh, false, kTileExtent));
  }
  return out;
}

}  // namespace

int main(int argc, char** argv) {
  Result<std::unique_ptr<TileSet>> set = fail(Errc::internal, "");
  if (argc > 1) {
    set = open_stored_tiles(argv[1]);
  } else {
    auto source = DemSource::open(std::vector{test::testdata("rainier.tif")});
    set = source ? open_dem_tiles(std::move(*source), {}) : fail("rainier.tif", source.error());
  }
  if (!set) {
    fmt::print(stderr, "{}\n", set.error().what);
    return 2;
  }
  std::vector<TileId> ids;
  const proto::LayerJson& layer = (*set)->layer();
  for (int z = 1; z <= layer.maxzoom; ++z)
    for (const proto::TileRange& r : layer.available[std::size_t(z)])
      for (std::uint32_t x = r.start_x; x <= r.end_x; ++x)
        for (std::uint32_t y = r.start_y; y <= r.end_y; ++y)
          if ((*set)->available({z - 1, x / 2, y / 2})) ids.push_back({z, x, y});
  std::mt19937 random(1);
  std::uniform_real_distribution<double> anywhere(0, 1);
  std::vector<double> parameters = {0, 1};
  for (int i = 0; i < 8; ++i) parameters.push_back(anywhere(random));
  std::vector<Pair> pairs(ids.size());
  const double seconds = test::seconds_of([&] {
    parallel_for(ids.size(), 0, [&](std::size_t i) { pairs[i] = run(**set, ids[i], parameters); });
  });
  std::map<TileId, const Pair*> by_id;
  std::size_t made = 0, flips = 0, fine = 0, base = 0, all = 0, edges = 0, differ = 0;
  for (std::size_t i = 0; i < ids.size(); ++i) {
    const Pair& p = pairs[i];
    if (!p.made) fmt::print("refused: {}\n", p.error);
    made += p.made, flips += p.flips, fine += p.fine, base += p.base, all += p.all;
    if (p.made) by_id[ids[i]] = &p;
  }
  for (const auto& [id, p] : by_id) {
    const auto east = by_id.find({id.level, id.x + 1, id.y});
    const auto north = by_id.find({id.level, id.x, id.y + 1});
    if (east != by_id.end()) ++edges, differ += p->sides[2] != east->second->sides[0];
    if (north != by_id.end()) ++edges, differ += p->sides[3] != north->second->sides[1];
  }
  fmt::print(
      "{} pairs of tile and parent, {} succeed ({:.2f} %), {} flipped triangles at {} "
      "parameters\n",
      ids.size(), made, 100.0 * double(made) / double(ids.size()), flips, parameters.size());
  fmt::print("{} shared edges, {} differ at any parameter\n", edges, differ);
  fmt::print("vertices: parents' parts {}, tiles {}, transitions {} ({:.2f} of the tiles')\n", base,
             fine, all, double(all) / double(fine));
  fmt::print("{:.1f} ms a pair, tiles and checks included\n", 1000 * seconds / double(ids.size()));
  return made == ids.size() && flips == 0 && differ == 0 ? 0 : 1;
}
