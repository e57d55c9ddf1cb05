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
#include "tests/support/drawn_glb.h"
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
  std::vector<Drawn> drawn;
  for (const test::DrawnPart& part : test::read_glb(bytes).parts) {
    drawn.push_back({part.vertices, {}, part.json});
    for (const auto& t : part.triangles)
      drawn.back().indices.insert(drawn.back().indices.end(), t.begin(), t.end());
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

/// Of every tile that can be come to from the roots.
std::map<TileId, proto::Tile3d> facts_of_all(const Source& source) {
  std::map<TileId, proto::Tile3d> all;
  std::vector<TileId> roots = {{0, 0, 0}, {0, 1, 0}};
  while (!roots.empty()) {
    const TileId root = roots.back();
    roots.pop_back();
    const auto made = subtree(source, root);
    EXPECT_TRUE(made) << made.error().what;
    const DecodedSubtree tree = decode_subtree(*made, root);
    all.insert(tree.tiles.begin(), tree.tiles.end());
    roots.insert(roots.end(), tree.children.begin(), tree.children.end());
  }
  return all;
}

/// Each test with contents as they are, and compressed.
class Pyramid : public ::testing::TestWithParam<GlbCompression> {
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
    return {*tiles_, [this](TileId id) -> Result<TileModel> { return models_.at(id); }, GetParam()};
  }
  std::vector<Drawn> drawn(TileId id) const {
    const auto made = content(source(), id);
    EXPECT_TRUE(made);
    return decode_content(*made);
  }
  std::map<TileId, proto::Tile3d> facts_of_all() const { return tiles3d::facts_of_all(source()); }

  test::MadeUpSource source_{test::rough_terrain(260, 200, 3), {7.1, 45.9}, 4e-4};
  std::unique_ptr<DemTiles> tiles_;
  std::map<TileId, TileModel> models_;
};

TEST_P(Pyramid, SubtreesNameEveryTileAndNoOther) {
  const auto all = facts_of_all();
  ASSERT_GT(models_.size(), 40u);
  ASSERT_EQ(all.size(), models_.size());
  for (const auto& [id, says] : all) EXPECT_TRUE(models_.contains(id)) << id.text();
}

TEST_P(Pyramid, WhatASubtreeSaysOfATileHoldsForAllThatIsDrawnBelow) {
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

TEST_P(Pyramid, AnOcclusionPointHidesNoTileBelowItThatCouldBeSeen) {
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

TEST_P(Pyramid, NeighboursMeetToTheBitAsAClientDecodesThem) {
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

TEST_P(Pyramid, WallsHideEveryStepBetweenALevelAndTheNext) {
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

TEST_P(Pyramid, WallsHangFromTheBorderAndLookOutwards) {
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
      EXPECT_NEAR(length(top - foot), depth, 2 * glb_lattice(id.level, GetParam())) << id.text();
      if (id.level <= 4) continue;  // as wide as the earth is round
      EXPECT_GT(dot(cross(foot - top, next - top), top - middle), 0) << id.text();
    }
  }
}

TEST_P(Pyramid, TilesetJsonLeadsToBothHemispheres) {
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

TEST_P(Pyramid, NoPostIsFartherFromAContentAsItIsDrawnThanItStates) {
  std::map<int, int> posts;  // by level
  double used = 0;
  for (const auto& [id, model] : models_) {
    const test::DrawnGlb glb = test::read_glb(*content(source(), id));
    const test::DrawnError error = test::drawn_error(glb.parts[0], source_, tiling::rect(id));
    const double stated = glb.extras["max_error_m"];
    EXPECT_LE(error.worst_m, stated) << id.text();
    posts[id.level] += error.posts;
    used = std::max(used, error.worst_m / stated);
  }
  const int there = source_.grid().cols() * source_.grid().rows();
  for (const auto& [level, count] : posts)  // the tiles of a level have nearly all of them
    EXPECT_GT(count, level < 6 ? there / 2 : there * 49 / 50) << level;
  EXPECT_GT(used, 0.8) << "what is stated is far from what is";
}

/// Over a void no post holds a tile near its parent, and what fills it lies far below the plateau
/// around.
TEST(Tiles3d, VolumesOfASubtreeHoldWhatFillsVoids) {
  HeightGrid plateau(257, 257, 0);
  for (int r = 0; r < plateau.rows(); ++r)
    for (int c = 0; c < plateau.cols(); ++c)
      plateau.at(c, r) = c >= 30 && c <= 226 && r >= 30 && r <= 226
                             ? HeightGrid::kVoid
                             : float(2000 + (c * 7 + r * 3) % 5);
  constexpr double kStep = 180.0 / (1 << 24);  // its rim is tiles' edges
  const test::MadeUpSource source(std::move(plateau), {0, 256 * kStep}, kStep);
  TileSetOptions options;
  options.effort = Effort::fast;
  const auto tiles = open_dem_tiles(source, options);
  ASSERT_TRUE(tiles) << tiles.error().what;
  const Source made{**tiles, [&](TileId id) -> Result<TileModel> {
                      const auto bytes = (*tiles)->tile(id, {});
                      if (!bytes) return std::unexpected(bytes.error());
                      return decode_tile(id, bytes->bytes);
                    }};
  double lowest = 1e9;
  const auto all = facts_of_all(made);
  for (const auto& [id, own] : all) {
    const auto bytes = content(made, id);
    ASSERT_TRUE(bytes);
    for (const Drawn& part : decode_content(*bytes))
      for (const Vec3& place : part.vertices) {
        const double height = wgs84::from_ecef(place).height_m;
        lowest = std::min(lowest, height);
        for (TileId above = id;; above = above.parent()) {
          const proto::Tile3d& says = all.at(above);
          const Vec3 center{says.sphere[0], says.sphere[1], says.sphere[2]};
          ASSERT_LE(length(place - center), says.sphere[3]) << id.text() << " in " << above.text();
          ASSERT_GE(height, says.min_height - 1e-3) << id.text() << " in " << above.text();
          ASSERT_LE(height, says.max_height + 1e-3) << id.text() << " in " << above.text();
          if (above.level % kSubtreeLevels == 0) break;
        }
      }
  }
  EXPECT_LT(lowest, 500);
}

/// Deep levels only where fine layers are: many rectangles.
TEST(Tiles3d, SubtreesOfLayersNameTheTilesOfEveryRectangleAndNoOther) {
  const auto layer = [](int posts, unsigned seed, Geographic corner, double spacing) {
    return std::make_shared<test::MadeUpSource>(test::rough_terrain(posts, posts, seed), corner,
                                                spacing);
  };
  const auto surface = Surface::of_layers({{"base", layer(40, 1, {9, 51}, 0.05)},
                                           {"north", layer(30, 2, {9.3, 50.8}, 0.002)},
                                           {"east", layer(30, 3, {10.7, 50.3}, 0.002)},
                                           {"city", layer(30, 4, {9.6, 49.5}, 0.0005)}});
  ASSERT_TRUE(surface) << surface.error().what;
  TileSetOptions options;
  options.effort = Effort::fast;
  const auto tiles = open_dem_tiles(*surface, options);
  ASSERT_TRUE(tiles) << tiles.error().what;
  std::size_t rectangles = 0, there = 0;
  std::set<TileId> wanted;
  const auto& available = (*tiles)->layer().available;
  for (std::size_t z = 0; z < available.size(); ++z) {
    rectangles = std::max(rectangles, available[z].size());
    for (const proto::TileRange& r : available[z])
      for (auto x = r.start_x; x <= r.end_x; ++x)
        for (auto y = r.start_y; y <= r.end_y; ++y, ++there)
          wanted.insert({int(z), std::uint32_t(x), std::uint32_t(y)});
  }
  EXPECT_GE(rectangles, 3u);
  EXPECT_EQ(wanted.size(), there) << "rectangles overlap";
  const auto all = facts_of_all({**tiles, [&](TileId id) -> Result<TileModel> {
                                   const auto made = (*tiles)->tile(id, {});
                                   if (!made) return std::unexpected(made.error());
                                   return decode_tile(id, made->bytes);
                                 }});
  std::set<TileId> named;
  for (const auto& [id, says] : all) named.insert(id);
  EXPECT_EQ(named, wanted);
}

TEST(Tiles3d, CompressedContentsAreSmallAndOfTheSameTiles) {
  const test::MadeUpSource source(test::rough_terrain(260, 200, 3), {7.1, 45.9}, 4e-4);
  const auto tiles = open_dem_tiles(source, {});
  ASSERT_TRUE(tiles);
  std::size_t plain = 0, packed = 0, count = 0;
  for (const TileId id : {TileId{0, 1, 0}, TileId{5, 33, 24}, TileId{9, 532, 386}}) {
    if (!(*tiles)->available(id)) continue;
    ++count;
    const TileModel model = *decode_tile(id, (*tiles)->tile(id, {})->bytes);
    const Bytes a = content(model, nullptr, GlbCompression::none);
    const Bytes b = content(model, nullptr, GlbCompression::meshopt);
    plain += a.size(), packed += b.size();
    const test::DrawnGlb in_a = test::read_glb(a), in_b = test::read_glb(b);
    EXPECT_EQ(in_b.json["extensionsRequired"],
              Json::array({"EXT_meshopt_compression", "KHR_mesh_quantization"}));
    for (const std::size_t k : {0u, 1u}) {
      ASSERT_EQ(in_a.parts[k].vertices.size(), in_b.parts[k].vertices.size());
      ASSERT_EQ(in_a.parts[k].triangles.size(), in_b.parts[k].triangles.size());
      for (std::size_t i = 0; i < in_a.parts[k].vertices.size(); ++i) {
        const double moved = length(in_a.parts[k].vertices[i] - in_b.parts[k].vertices[i]);
        const double most = glb_lattice(id.level, GlbCompression::meshopt);
        EXPECT_TRUE(moved <= most || k == 1) << moved;  // walls hang as deep as these contents need
        EXPECT_GT(dot(in_a.parts[k].normals[i], in_b.parts[k].normals[i]), 0.9998);  // 1.1 degrees
      }
    }
    for (const char* side : {"left", "bottom", "right", "top"}) {
      const auto edge = [&](const test::DrawnGlb& glb) {
        return glb.indices(glb.parts[0].json["extensions"]["CESIUM_tile_edges"][side]);
      };
      EXPECT_EQ(edge(in_a), edge(in_b));
    }
  }
  EXPECT_EQ(count, 3u);
  EXPECT_LT(packed, plain / 2);
}

/// For CesiumJS's terrain, which takes the first node's matrix and fractions of 65535.
TEST(Tiles3d, TheFirstNodeOfACompressedContentHoldsForFractions) {
  const test::MadeUpSource source(test::rough_terrain(100, 100, 3), {7.1, 45.9}, 4e-4);
  const auto tiles = open_dem_tiles(source, {});
  const TileModel model = *decode_tile({8, 266, 193}, (*tiles)->tile({8, 266, 193}, {})->bytes);
  const Json json = test::read_glb(content(model, nullptr, GlbCompression::meshopt)).json;
  ASSERT_EQ(json["nodes"].size(), 2u);
  EXPECT_EQ(json["scenes"][0]["nodes"], Json::array({1}));
  const auto a = json["nodes"][0]["matrix"].get<std::vector<double>>();
  const auto b = json["nodes"][1]["matrix"].get<std::vector<double>>();
  for (std::size_t i = 0; i < 16; ++i) EXPECT_EQ(a[i], i < 12 ? b[i] * 65535 : b[i]) << i;
}

/// Heights that no place on earth has: on the lattice all the same.
TEST(Tiles3d, ATileOfMoreReliefThanSixteenBitsIsLeftUncompressed) {
  HeightGrid cliff = test::rough_terrain(60, 60, 3);
  for (int row = 0; row < cliff.rows(); ++row)
    for (int col = 30; col < cliff.cols(); ++col) cliff.at(col, row) += 60000;
  const test::MadeUpSource source(cliff, {7.1, 45.9}, 4e-4);
  const auto tiles = open_dem_tiles(source, {});
  ASSERT_TRUE(tiles);
  const int level = (*tiles)->layer().maxzoom;
  const double side = tiling::tile_degrees(level);
  const TileId id =
      *tiling::tile(level, std::int64_t((7.112 + 180) / side), std::int64_t((45.888 + 90) / side));
  const TileModel model = *decode_tile(id, (*tiles)->tile(id, {})->bytes);
  const test::DrawnGlb glb = test::read_glb(content(model, nullptr, GlbCompression::meshopt));
  EXPECT_FALSE(glb.json.contains("extensionsRequired"));
  const double step = glb_lattice(level, GlbCompression::meshopt);
  for (const Vec3& v : glb.parts[0].vertices)
    for (const double x : {v.x, v.y, v.z}) EXPECT_EQ(std::fmod(x, step), 0) << x;
}

INSTANTIATE_TEST_SUITE_P(Of, Pyramid,
                         ::testing::Values(GlbCompression::none, GlbCompression::meshopt),
                         [](const auto& of) { return name_of(of.param); });

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
