#include "terrain/tiles3d/tile_drape.h"

#include <algorithm>
#include <optional>
#include <span>

#include "terrain/tile/level_colours.h"

namespace tind::tiles3d {
namespace {

using Found = std::vector<std::optional<std::uint16_t>>;

/// Of each triangle: that of its corners where they agree, else that of its middle.
Found classes_of(const TileModel& tile, std::span<const Geographic> places,
                 const LandCover& cover) {
  Found at_corners(places.size()), found;
  cover.at(places, at_corners);
  std::vector<Geographic> middles;
  std::vector<std::size_t> mixed;
  for (const Triangle& t : tile.mesh.triangles) {
    if (at_corners[t[0]] != at_corners[t[1]] || at_corners[t[1]] != at_corners[t[2]]) {
      const Vec3 sum =
          tile.mesh.vertices[t[0]] + tile.mesh.vertices[t[1]] + tile.mesh.vertices[t[2]];
      middles.push_back(place_of(tiling::rect(tile.id), sum * (1. / 3)));
      mixed.push_back(found.size());
    }
    found.push_back(at_corners[t[0]]);
  }
  Found at_middles(middles.size());
  cover.at(middles, at_middles);
  for (std::size_t i = 0; i < mixed.size(); ++i) found[mixed[i]] = at_middles[i];
  return found;
}

void add_classes(const Found& found, const LandCover& cover, GlbDrape& drape) {
  std::vector<std::uint16_t> row_of(cover.classes().size(), proto::kNoGlbClass);
  for (const auto& index : found)
    if (index) row_of[*index] = 0;
  for (std::size_t i = 0; i < row_of.size(); ++i) {
    if (row_of[i] == proto::kNoGlbClass) continue;
    row_of[i] = std::uint16_t(drape.classes.size());
    const CoverClass& c = cover.classes()[i];
    drape.classes.push_back({c.number, c.name, c.colour});
  }
  if (drape.classes.empty()) return;
  drape.covers.reserve(found.size());
  for (const auto& index : found)
    drape.covers.push_back(index ? row_of[*index] : proto::kNoGlbClass);
}

}  // namespace

GlbDrape tile_drape(const TileModel& tile, const Draped& over) {
  GlbDrape drape;
  const GeoRect rect = tiling::rect(tile.id);
  const bool coloured = over.colours && rect.overlaps(over.colours->bounds());
  const bool covered = over.cover && rect.overlaps(over.cover->bounds());
  if (!coloured && !covered) return drape;
  std::vector<Geographic> places;
  places.reserve(tile.mesh.vertices.size());
  for (const Vec3& v : tile.mesh.vertices) places.push_back(place_of(rect, v));
  if (coloured) drape.colours = level_colours(places, tile.id.level, *over.colours);
  if (covered) add_classes(classes_of(tile, places, *over.cover), *over.cover, drape);
  return drape;
}

}  // namespace tind::tiles3d
