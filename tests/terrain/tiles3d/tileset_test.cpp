// A pyramid as 3D Tiles: what subtrees say holds for every tile below, neighbours meet to the bit,
// walls hide every step between levels.

#include "terrain/tiles3d/tileset.h"

#include <gtest/gtest.h>

#include <map>
#include <nlohmann/json.hpp>
#include <set>

#include "terrain/base/bytes.h"
#include "terrain/encode/glb_tile.h"
#include "terrain/encode/quantized_mesh_tile.h"
#include "terrain/geo/ellipsoid.h"
#include "terrain/pyramid/make/dem_tiles.h"
#include "terrain/tile/border.h"
#include "terrain/tile/culling.h"
#include "terrain/tiles3d/tile3d.h"
#include "tests/support/made_up_source.h"

namespace tind::tiles3d {
namespace {

using Json = nlohmann::json;
using Bytes = std::vector<std::uint8_t>;

/// A primitive of a GLB, its vertices in ECEF as a client adds them up.
struct Drawn {
  std::vector<Vec3> vertices;
  std::vector<std::uint32_t> indices;
  Json json;
};

std::vector<Drawn> decode_content(const Bytes& bytes) {
  ByteReader in(bytes);
  in.get_bytes(12);
  const auto size = in.get<std::uint32_t>();
  in.get_bytes(4);
  const Json gltf = Json::parse(in.get_text(size));
  in.get_bytes(8);
  const std::size_t numbers = in.at();
  const auto at = [&](const Json& accessor) {
    const Json& view = gltf["bufferViews"][accessor["bufferView"].get<std::size_t>()];
    ByteReader values(bytes);
    values.get_bytes(numbers + view["byteOffset"].get<std::size_t>());
    return values;
  };
  const auto m = gltf["nodes"][0]["matrix"].get<std::vector<double>>();
  std::vector<Drawn> drawn;
  for (const Json& primitive : gltf["meshes"][0]["primitives"]) {
    Drawn part{{}, {}, primitive};
    const Json& places = gltf["accessors"][primitive["attributes"]["POSITION"].get<std::size_t>()];
    ByteReader floats = at(places);
    for (std::size_t i = 0; i < places["count"].get<std::size_t>(); ++i) {
      const Vec3 v{floats.get<float>(), floats.get<float>(), floats.get<float>()};
      part.vertices.push_back({m[12] + v.x, -m[14] + v.y, m[13] + v.z});
    }
    const Json& accessor = gltf["accessors"][primitive["indices"].get<std::size_t>()];
    ByteReader shorts = at(accessor);
    for (std::size_t i = 0; i < accessor["count"].get<std::size_t>(); ++i)
      part.indices.push_back(shorts.get<std::uint16_t>());
    drawn.push_back(std::move(part));
  }
  return drawn;
}

std::uint64_t unpack(std::uint64_t number, int offset) {
  std::uint64_t x = 0;
  for (int bit = 0; bit < 16; ++bit) x |= (number >> (2 * bit + offset) & 1) << bit;
  return x;
}

/// By the specification's text: which tiles and subtrees, and what the metadata say.
struct DecodedSubtree {
  std::map<TileId, proto::Tile3d> tiles;
  std::set<TileId> children;
};

DecodedSubtree decode_subtree(const Bytes& bytes, TileId root) {
  ByteReader in(bytes);
  EXPECT_EQ(in.get_text(4), "subt");
  EXPECT_EQ(in.get<std::uint32_t>(), 1u);
  const auto text = in.get<std::uint64_t>(), numbers = in.get<std::uint64_t>();
  EXPECT_EQ(text % 8, 0u);
  EXPECT_EQ(numbers % 8, 0u);
  EXPECT_EQ(bytes.size(), 24 + text + numbers);
  const Json json = Json::parse(in.get_text(text));
  const auto view = [&](std::size_t number) {
    const Json& v = json["bufferViews"][number];
    EXPECT_EQ(v["byteOffset"].get<std::size_t>() % 8, 0u);
    return ByteReader(std::span(bytes).subspan(24 + text + v["byteOffset"].get<std::size_t>(),
                                               v["byteLength"].get<std::size_t>()));
  };
  const auto bits = [&](const Json& availability, std::size_t count) {
    if (availability.contains("constant"))
      return std::vector<bool>(count, availability["constant"] == 1);
    ByteReader words = view(availability["bitstream"]);
    EXPECT_EQ(words.left(), (count + 7) / 8);
    std::vector<bool> all;
    for (std::uint8_t byte = 0; all.size() < count; byte = std::uint8_t(byte >> 1)) {
      if (all.size() % 8 == 0) byte = words.get<std::uint8_t>();
      all.push_back(byte & 1);
    }
    EXPECT_EQ(std::size_t(std::ranges::count(all, true)),
              availability["availableCount"].get<std::size_t>());
    return all;
  };
  const auto id = [&](int depth, std::uint64_t number) {
    return TileId{root.level + depth, std::uint32_t((root.x << depth) + unpack(number, 0)),
                  std::uint32_t((root.y << depth) + unpack(number, 1))};
  };
  EXPECT_EQ(json["contentAvailability"], Json::array({json["tileAvailability"]}));
  DecodedSubtree tree;
  const Json& table = json["propertyTables"][json["tileMetadata"].get<std::size_t>()];
  const auto column = [&](const char* name) {
    return view(table["properties"][name]["values"].get<std::size_t>());
  };
  ByteReader low = column("minHeight"), high = column("maxHeight");
  ByteReader sphere = column("boundingSphere"), horizon = column("horizonOcclusionPoint");
  ByteReader error = column("geometricError");
  const auto there = bits(json["tileAvailability"], 21);
  for (int depth = 0, k = 0; depth < kSubtreeLevels; ++depth)
    for (std::uint64_t number = 0; number < 1u << (2 * depth); ++number, ++k) {
      if (!there[std::size_t(k)]) continue;
      proto::Tile3d& tile = tree.tiles[id(depth, number)];
      tile.min_height = low.get<float>(), tile.max_height = high.get<float>();
      for (double& x : tile.sphere) x = sphere.get<double>();
      for (double& x : tile.horizon_occlusion) x = horizon.get<double>();
      tile.geometric_error = error.get<double>();
    }
  EXPECT_EQ(table["count"], tree.tiles.size());
  EXPECT_TRUE(error.good());
  EXPECT_EQ(error.left() + low.left() + sphere.left() + horizon.left(), 0u);
  const auto children = bits(json["childSubtreeAvailability"], 64);
  for (std::uint64_t number = 0; number < 64; ++number)
    if (children[number]) tree.children.insert(id(kSubtreeLevels, number));
  return tree;
}

class Pyramid : public ::testing::Test {
 protected:
  Pyramid() {
    TileSetOptions options;
    options.effort = Effort::fast;
    auto opened = open_dem_tiles(source_, options);
    EXPECT_TRUE(opened) << opened.error().what;
    tiles_ = std::move(*opened);
    collect({0, 0, 0});
    collect({0, 1, 0});
  }

  void collect(TileId id) {
    if (!tiles_->available(id)) return;
    const auto bytes = tiles_->tile(id, {});
    ASSERT_TRUE(bytes) << bytes.error().what;
    models_[id] = *decode_tile(id, bytes->bytes);
    for (const int north : {0, 1})
      for (const int east : {0, 1}) collect(id.child(east, north));
  }

  Source source() const {
    return {*tiles_, [this](TileId id) -> Result<TileModel> { return models_.at(id); }};
  }
  std::vector<Drawn> drawn(TileId id) const {
    const auto made = content(source(), id);
    EXPECT_TRUE(made);
    return decode_content(*made);
  }
  /// Every subtree that can be come to from the roots.
  std::map<TileId, proto::Tile3d> facts_of_all() const {
    std::map<TileId, proto::Tile3d> all;
    std::vector<TileId> roots = {{0, 0, 0}, {0, 1, 0}};
    while (!roots.empty()) {
      const TileId root = roots.back();
      roots.pop_back();
      const auto made = subtree(source(), root);
      EXPECT_TRUE(made) << made.error().what;
      const DecodedSubtree tree = decode_subtree(*made, root);
      all.insert(tree.tiles.begin(), tree.tiles.end());
      roots.insert(roots.end(), tree.children.begin(), tree.children.end());
    }
    return all;
  }

  test::MadeUpSource source_{test::rough_terrain(260, 200, 3), {7.1, 45.9}, 4e-4};
  std::unique_ptr<DemTiles> tiles_;
  std::map<TileId, TileModel> models_;
};

TEST_F(Pyramid, SubtreesNameEveryTileAndNoOther) {
  const auto all = facts_of_all();
  ASSERT_GT(models_.size(), 40u);
  ASSERT_EQ(all.size(), models_.size());
  for (const auto& [id, says] : all) EXPECT_TRUE(models_.contains(id)) << id.text();
}

TEST_F(Pyramid, WhatASubtreeSaysOfATileHoldsForAllThatIsDrawnBelow) {
  const auto all = facts_of_all();
  for (const auto& [id, model] : models_) {
    std::vector<Vec3> places;
    for (const Drawn& part : drawn(id))
      places.insert(places.end(), part.vertices.begin(), part.vertices.end());
    for (TileId above = id;; above = above.parent()) {
      const proto::Tile3d& says = all.at(above);
      const Vec3 center{says.sphere[0], says.sphere[1], says.sphere[2]};
      for (const Vec3& place : places) {
        EXPECT_LE(length(place - center), says.sphere[3]) << id.text() << " in " << above.text();
        const double height = wgs84::from_ecef(place).height_m;
        EXPECT_GE(height, says.min_height - 1e-3) << id.text() << " in " << above.text();
        EXPECT_LE(height, says.max_height + 1e-3) << id.text() << " in " << above.text();
      }
      EXPECT_LE(all.at(id).geometric_error, says.geometric_error) << id.text() << above.text();
      if (above.level == 0) break;
    }
    EXPECT_GE(all.at(id).geometric_error, model.certificate->max_error_m);
  }
}

TEST_F(Pyramid, AnOcclusionPointHidesNoTileBelowItThatCouldBeSeen) {
  const auto all = facts_of_all();
  int looked = 0, hidden = 0;
  for (const auto& [id, says] : all) {
    if (id.level < 8) continue;
    const auto& [x, y, z] = says.horizon_occlusion;
    for (const double lon : {-40.0, 7.0, 20.0, 60.0})
      for (const double height : {100.0, 5000.0, 400000.0}) {
        const Vec3 camera = ellipsoid_scaled(wgs84::to_ecef({lon, 45}, height));
        ++looked;
        if (!hidden_by_horizon({x, y, z}, camera)) continue;
        ++hidden;
        for (const auto& [below, model] : models_) {
          if (below.level != tiles_->layer().maxzoom ||
              below.x >> (below.level - id.level) != id.x ||
              below.y >> (below.level - id.level) != id.y)
            continue;
          for (const Vec3& v : model.mesh.vertices) {
            const Vec3 place = wgs84::to_ecef(place_of(tiling::rect(below), v), v.z);
            EXPECT_TRUE(hidden_by_horizon(ellipsoid_scaled(place), camera)) << id.text();
          }
        }
      }
  }
  EXPECT_GT(looked, 100);
  EXPECT_GT(hidden, 20);
}

TEST_F(Pyramid, NeighboursMeetToTheBitAsAClientDecodesThem) {
  std::map<TileId, std::vector<Vec3>> east, west, north, south;
  for (const auto& [id, model] : models_) {
    const Drawn surface = drawn(id)[0];
    ASSERT_EQ(surface.vertices.size(), model.mesh.vertices.size());
    const auto side = [&](const auto& on) {
      std::map<double, Vec3> line;
      for (std::size_t i = 0; i < model.mesh.vertices.size(); ++i)
        if (const auto t = on(model.mesh.vertices[i])) line[*t] = surface.vertices[i];
      std::vector<Vec3> places;
      for (const auto& [t, place] : line) places.push_back(place);
      return places;
    };
    using At = std::optional<double>;
    west[id] = side([](const Vec3& v) { return v.x == 0 ? At(v.y) : At(); });
    east[id] = side([](const Vec3& v) { return v.x == kTileExtent ? At(v.y) : At(); });
    south[id] = side([](const Vec3& v) { return v.y == 0 ? At(v.x) : At(); });
    north[id] = side([](const Vec3& v) { return v.y == kTileExtent ? At(v.x) : At(); });
  }
  std::size_t edges = 0, vertices = 0;
  const auto compare = [&](const std::vector<Vec3>& a, const std::vector<Vec3>& b, TileId id) {
    EXPECT_EQ(a, b) << id.text();
    ++edges, vertices += a.size();
  };
  for (const auto& [id, model] : models_) {
    if (const TileId other{id.level, id.x + 1, id.y}; models_.contains(other))
      compare(east[id], west[other], id);
    if (const TileId other{id.level, id.x, id.y + 1}; models_.contains(other))
      compare(north[id], south[other], id);
  }
  EXPECT_GT(edges, 40u);
  EXPECT_GT(vertices, 1000u);
}

/// Heights along a side as it is drawn, by the place on it from 0 to 1.
std::map<double, double> profile(const Drawn& surface, const TileModel& model, TileSide side) {
  const bool upright = side == TileSide::west || side == TileSide::east;
  const double at = side == TileSide::east || side == TileSide::north ? kTileExtent : 0;
  std::map<double, Vec3> line;
  for (std::size_t i = 0; i < model.mesh.vertices.size(); ++i) {
    const Vec3& v = model.mesh.vertices[i];
    if ((upright ? v.x : v.y) == at) line[upright ? v.y : v.x] = surface.vertices[i];
  }
  const GeoRect rect = tiling::rect(model.id);
  std::map<double, double> heights;
  for (auto b = std::next(line.begin()); b != line.end(); ++b) {
    const Vec3 from = std::prev(b)->second, way = b->second - from;
    for (int k = 0; k <= 32; ++k) {
      const auto [p, height] = wgs84::from_ecef(from + way * (k / 32.0));
      heights[upright ? (p.lat - rect.south) / rect.height() : (p.lon - rect.west) / rect.width()] =
          height;
    }
  }
  return heights;
}

double height_at(const std::map<double, double>& line, double t) {
  const auto after = line.upper_bound(t);
  if (after == line.end()) return line.rbegin()->second;
  if (after == line.begin()) return after->second;
  const auto before = std::prev(after);
  const double share = (t - before->first) / (after->first - before->first);
  return before->second + share * (after->second - before->second);
}

TEST_F(Pyramid, WallsHideEveryStepBetweenALevelAndTheNext) {
  std::size_t sides = 0;
  double used = 0;
  for (const auto& [id, model] : models_) {
    if (id.level == 0) continue;
    const TileId above = id.parent();
    const auto fine = drawn(id), coarse = drawn(above);
    ASSERT_EQ(fine.size(), 2u);
    EXPECT_EQ(fine[1].json["extras"]["skirt"], true);
    // Whichever of the two is higher, its wall must reach down to the other.
    const double depth = std::min(fine[1].json["extras"]["depth_m"].get<double>(),
                                  coarse[1].json["extras"]["depth_m"].get<double>());
    for (const TileSide side : {TileSide::west, TileSide::south, TileSide::east, TileSide::north}) {
      const bool upright = side == TileSide::west || side == TileSide::east;
      const std::uint32_t across = upright ? id.x % 2 : id.y % 2,
                          along = upright ? id.y % 2 : id.x % 2;
      if (across != (side == TileSide::east || side == TileSide::north ? 1u : 0u)) continue;
      const auto a = profile(fine[0], model, side);
      const auto b = profile(coarse[0], models_.at(above), side);
      ++sides;
      for (double t = 0; t <= 1; t += 1.0 / 256) {
        const double step = std::abs(height_at(a, t) - height_at(b, (along + t) / 2));
        used = std::max(used, step / depth);
        EXPECT_LE(step, depth * (1 + 1e-6)) << id.text();
      }
    }
  }
  EXPECT_GT(sides, 80u);
  EXPECT_GT(used, 0.3) << "deeper than any step needs";
}

TEST_F(Pyramid, WallsHangFromTheBorderAndLookOutwards) {
  for (const auto& [id, model] : models_) {
    const auto parts = drawn(id);
    const Drawn& wall = parts[1];
    const double depth = wall.json["extras"]["depth_m"];
    const std::set<std::array<double, 3>> surface = [&] {
      std::set<std::array<double, 3>> all;
      for (const Vec3& v : parts[0].vertices) all.insert({v.x, v.y, v.z});
      return all;
    }();
    const GeoRect rect = tiling::rect(id);
    const Vec3 middle =
        wgs84::to_ecef({(rect.west + rect.east) / 2, (rect.south + rect.north) / 2}, 0);
    ASSERT_EQ(wall.indices.size() % 6, 0u);
    for (std::size_t k = 0; k + 2 < wall.indices.size(); k += 6) {
      const Vec3 &top = wall.vertices[wall.indices[k]], &foot = wall.vertices[wall.indices[k + 1]],
                 &next = wall.vertices[wall.indices[k + 2]];
      EXPECT_TRUE(surface.contains({top.x, top.y, top.z})) << id.text();
      EXPECT_NEAR(length(top - foot), depth, 2 * glb_lattice(id.level)) << id.text();
      if (id.level <= 4) continue;  // as wide as the earth is round
      EXPECT_GT(dot(cross(foot - top, next - top), top - middle), 0) << id.text();
    }
  }
}

TEST_F(Pyramid, TilesetJsonLeadsToBothHemispheres) {
  const auto text = tileset_json(source());
  ASSERT_TRUE(text) << text.error().what;
  const Json json = Json::parse(*text);
  EXPECT_EQ(json["asset"]["version"], "1.1");
  EXPECT_EQ(json["asset"]["tilesetVersion"], tiles_->layer().version);
  const Json& children = json["root"]["children"];
  ASSERT_EQ(children.size(), 2u);
  EXPECT_EQ(children[0]["content"]["uri"], "west/{level}/{x}/{y}.glb");
  EXPECT_EQ(children[1]["implicitTiling"]["subtrees"]["uri"], "east/{level}/{x}/{y}.subtree");
  EXPECT_EQ(children[0]["implicitTiling"]["availableLevels"], tiles_->layer().maxzoom + 1);
  EXPECT_GT(json["geometricError"], json["root"]["geometricError"]);
  EXPECT_GT(json["root"]["geometricError"], children[0]["geometricError"]);
  const auto all = facts_of_all();
  for (const Json& child : children) {
    EXPECT_LE(child["boundingVolume"]["region"][4], all.at({0, 1, 0}).min_height + 1e-2);
    EXPECT_GE(child["boundingVolume"]["region"][5], all.at({0, 1, 0}).max_height - 1e-2);
  }
}

TEST(Tiles3d, PathsAreThoseOfTheHemisphere) {
  for (const TileId id : {TileId{0, 0, 0}, TileId{0, 1, 0}, TileId{4, 15, 3}, TileId{4, 16, 3}}) {
    const std::string path = path_of(id);
    const std::string hemisphere = path.substr(0, 4);
    int z = 0, x = 0, y = 0;
    ASSERT_EQ(std::sscanf(path.c_str() + 5, "%d/%d/%d", &z, &x, &y), 3) << path;
    EXPECT_EQ(tile_at(hemisphere, z, x, y), id) << path;
  }
  EXPECT_EQ(path_of({4, 16, 3}), "east/4/0/3");
  EXPECT_FALSE(tile_at("west", 4, 16, 3));  // is in the east
  EXPECT_FALSE(tile_at("north", 0, 0, 0));
  EXPECT_FALSE(tile_at("west", -1, 0, 0));
  EXPECT_FALSE(tile_at("west", 99, 0, 0));
  EXPECT_FALSE(tile_at("east", 4, 0, 16));
}

}  // namespace
}  // namespace tind::tiles3d
