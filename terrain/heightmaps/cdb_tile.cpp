#include "terrain/heightmaps/cdb_tile.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <numbers>

#include "terrain/geo/ellipsoid.h"

namespace tind::cdb {
namespace {

constexpr int kPosts = 1024;  // a side, from level 0 on

std::string lod_name(int lod) { return fmt::format("L{}{:02}", lod < 0 ? "C" : "", std::abs(lod)); }

unsigned tiles_a_side(int lod) { return lod > 0 ? 1u << lod : 1u; }

void add_tiles(const Tile& tile, const GeoRect& area, int deepest, std::vector<Tile>& all) {
  if (tile.lod > deepest || !touches(tile, area)) return;
  all.push_back(tile);
  if (tile.lod < 0) {
    add_tiles({tile.lat, tile.lon, tile.lod + 1, 0, 0}, area, deepest, all);
    return;
  }
  for (const unsigned north : {0u, 1u})
    for (const unsigned east : {0u, 1u})
      add_tiles({tile.lat, tile.lon, tile.lod + 1, 2 * tile.up + north, 2 * tile.right + east},
                area, deepest, all);
}

}  // namespace

int width_deg(int lat) {
  const int from = lat >= 0 ? lat : -1 - lat;  // of the edge that is nearer to the equator
  return from < 50 ? 1 : from < 70 ? 2 : from < 75 ? 3 : from < 80 ? 4 : from < 89 ? 6 : 12;
}

int posts(int lod) { return lod >= 0 ? kPosts : kPosts >> -lod; }

GeoRect rect(const Tile& t) {
  const double n = tiles_a_side(t.lod), wide = width_deg(t.lat) / n, high = 1 / n;
  return {t.lon + t.right * wide, t.lat + t.up * high, t.lon + (t.right + 1) * wide,
          t.lat + (t.up + 1) * high};
}

std::string path(const Tile& t) {
  const std::string lat = fmt::format("{}{:02}", t.lat < 0 ? 'S' : 'N', std::abs(t.lat));
  const std::string lon = fmt::format("{}{:03}", t.lon < 0 ? 'W' : 'E', std::abs(t.lon));
  const std::string lod = lod_name(t.lod);
  return fmt::format("Tiles/{0}/{1}/001_Elevation/{2}/U{3}/{0}{1}_D001_S001_T001_{4}_U{3}_R{5}.tif",
                     lat, lon, t.lod < 0 ? "LC" : lod, t.up, lod, t.right);
}

RasterLattice lattice(const Tile& tile) {
  const GeoRect r = rect(tile);
  const int n = posts(tile.lod);
  const double step_x = r.width() / n, step_y = r.height() / n;
  const Vec2 degree = wgs84::metres_per_degree((r.south + r.north) / 2);
  return {n,
          n,
          {step_x * degree.x, step_y * degree.y},
          [=](double row, double first, std::span<Geographic> places) {
            for (std::size_t i = 0; i < places.size(); ++i)
              places[i] = {r.west + (first + double(i)) * step_x, r.south + (n - 1 - row) * step_y};
          }};
}

int level_of(double spacing_m) {
  const double level_0 = wgs84::metres_per_degree(0).y / kPosts;
  // A hundredth is not worth a level.
  const double level = std::ceil(std::log2(level_0 / spacing_m) - .015);
  return int(std::clamp(level, double(kCoarsest), double(kFinest)));
}

bool touches(const Tile& tile, const GeoRect& area) { return rect(tile).overlaps(area); }

std::vector<Tile> tiles(const GeoRect& area, int deepest) {
  std::vector<Tile> all;
  const int north = int(std::min(std::ceil(area.north), 90.));
  for (int lat = int(std::max(std::floor(area.south), -90.)); lat < north; ++lat) {
    const int wide = width_deg(lat);
    for (int lon = -180; lon < 180; lon += wide)
      add_tiles({lat, lon, kCoarsest}, area, deepest, all);
  }
  return all;
}

}  // namespace tind::cdb
