// The file says the content as text that its own encoder makes again: whatever else is in it, or is
// written otherwise, has another hash.

#include "terrain/pyramid/shards/shard_plan.h"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <optional>

#include "proto/base64.h"
#include "proto/json_member.h"
#include "proto/json_text.h"
#include "terrain/base/sha256.h"
#include "terrain/raster/source_blocks.h"
#include "terrain/store/copy/copy_store.h"
#include "terrain/store/pmtiles/pmtiles_seal.h"

namespace tind {

namespace {

using Json = nlohmann::ordered_json;

constexpr int kFormat = 1;

std::unexpected<Error> bad(const std::string& why) {
  return fail(Errc::bad_data, "no plan of tind plan-build, or damaged: " + why);
}

Json content_of(const ShardPlan& p) {
  Json j;
  j["record"] = encode(p.record);
  j["layer"] = p.layer_text;
  std::string blocks;
  proto::put_base64(blocks, p.blocks);
  j["blocks"] = blocks;
  j["level"] = p.level;
  j["top_tiles"] = p.top_tiles;
  j["shards"] = Json::array();
  for (const ShardPlan::Shard& s : p.shards) j["shards"].push_back({s.subtrees, s.tiles, s.cost});
  return j;
}

Json source_of(const PlannedSource& s) {
  Json j;
  j["files"] = s.files;
  Json options = Json::array();
  for (const auto& [name, text] : s.options) options.push_back({name, text});
  j["options"] = options;
  j["layers"] = s.layers, j["blends"] = s.blends, j["layer_errors"] = s.layer_errors;
  j["layer_options"] = s.layer_options;
  j["breaklines"] = s.shapes.breaklines, j["flatten"] = s.shapes.flatten;
  j["boundary"] = s.shapes.boundary, j["water"] = s.shapes.water;
  j["dem_heights"] = s.shapes.dem_heights;
  j["allow_vrt"] = s.allow_vrt;
  return j;
}

bool take_texts(const Json& j, const char* name, std::vector<std::string>& to) {
  const Json* const list = json::member(j, name);
  if (!list || !list->is_array()) return false;
  for (const Json& value : *list) {
    auto text = json::as_text(value);
    if (!text) return false;
    to.push_back(std::move(*text));
  }
  return true;
}

bool take_flag(const Json& j, const char* name, bool& to) {
  const Json* const value = json::member(j, name);
  if (!value || !value->is_boolean()) return false;
  to = *value;
  return true;
}

std::optional<PlannedSource> source_in(const Json& j) {
  PlannedSource s;
  const Json* const options = json::member(j, "options");
  const bool lists =
      take_texts(j, "files", s.files) && take_texts(j, "layers", s.layers) &&
      take_texts(j, "blends", s.blends) && take_texts(j, "layer_errors", s.layer_errors) &&
      take_texts(j, "breaklines", s.shapes.breaklines) &&
      take_texts(j, "flatten", s.shapes.flatten) && take_texts(j, "boundary", s.shapes.boundary) &&
      take_texts(j, "water", s.shapes.water) && take_flag(j, "dem_heights", s.shapes.dem_heights) &&
      take_flag(j, "allow_vrt", s.allow_vrt);
  if (!lists || !options || !options->is_array()) return {};
  // Plans of before it could be said have none.
  if (json::member(j, "layer_options") && !take_texts(j, "layer_options", s.layer_options))
    return {};
  for (const Json& option : *options) {
    if (!option.is_array() || option.size() != 2) return {};
    const auto name = json::as_text(option[0]), text = json::as_text(option[1]);
    if (!name || !text) return {};
    s.options.emplace_back(*name, *text);
  }
  return s;
}

/// As it is said; whether it holds together is another question.
Result<ShardPlan> content_in(const Json& j) {
  ShardPlan p;
  const auto record = json::text(j, "record"), layer = json::text(j, "layer"),
             blocks = json::text(j, "blocks");
  const auto level = json::whole(j, "level", 0, tiling::kMaxLevel);
  const auto top = json::whole(j, "top_tiles", 0, std::int64_t(kMostCopiedTiles));
  const Json* const shards = json::member(j, "shards");
  if (!record || !layer || !blocks || !level || !top || !shards || !shards->is_array())
    return bad("a member is missing, or of another kind");
  auto made = decode_build_record(*record);
  auto bytes = proto::decode_base64(*blocks);
  if (!made || encode(*made) != *record || !bytes) return bad("its record");
  p.record = std::move(*made), p.blocks = std::move(*bytes), p.layer_text = *layer;
  if (!SourceBlocks::whole(p.blocks, p.record.heights)) return bad("its hashes of heights");
  p.level = int(*level), p.top_tiles = std::uint64_t(*top);
  if (shards->empty() || shards->size() > kMostShards) return bad("its number of shards");
  for (const Json& s : *shards) {
    if (!s.is_array() || s.size() != 3) return bad("a shard");
    const auto subtrees = json::as_whole(s[0], 1, std::int64_t(kMostSubtrees)),
               tiles = json::as_whole(s[1], 1, std::int64_t(kMostCopiedTiles)),
               cost = json::as_whole(s[2], 0);
    if (!subtrees || !tiles || !cost) return bad("a shard");
    p.shards.push_back({std::uint64_t(*subtrees), std::uint64_t(*tiles), std::uint64_t(*cost)});
  }
  return p;
}

Result<void> holds_together(const ShardPlan& p) {
  const auto tiles = ShardTiles::of(p);
  if (!tiles) return std::unexpected(tiles.error());
  for (std::size_t i = 0; i <= p.shards.size(); ++i) {
    const bool top = i == p.shards.size();
    std::uint64_t count = 0;
    for (const TileArea& area : tiles->areas(top ? ShardTiles::kTop : i)) count += area.size();
    if (count != (top ? p.top_tiles : p.shards[i].tiles)) return bad("its numbers of tiles");
  }
  return {};
}

std::vector<proto::TileRange> on_the_wire(std::span<const TileRange> ranges) {
  std::vector<proto::TileRange> out;
  for (const TileRange& r : ranges) out.push_back({r.west, r.south, r.east, r.north});
  return out;
}

}  // namespace

std::uint64_t ShardPlan::tiles() const {
  std::uint64_t count = top_tiles;
  for (const Shard& s : shards) count += s.tiles;
  return count;
}

std::string ShardPlan::hash() const {
  return hex_of(
      sha256("tind plan " + std::to_string(kFormat) + "\n" + json::to_text(content_of(*this))));
}

std::string encode(const ShardPlan& p) {
  Json j;
  j["tind_plan"] = kFormat;
  j["hash"] = p.hash();
  j["source"] = source_of(p.source);
  j["content"] = content_of(p);
  return json::to_text(j, 1) + "\n";
}

Result<ShardPlan> decode_shard_plan(std::string_view text) {
  const Json j = json::parse<Json>(text);
  if (!j.is_object()) return bad("it is no JSON object");
  if (json::whole(j, "tind_plan") != std::optional<std::int64_t>(kFormat))
    return bad("it is of another version; make it again with this one");
  const Json *const content = json::member(j, "content"), *const from = json::member(j, "source");
  if (!content || !from || j.size() != 4) return bad("a member is missing");
  auto plan = content_in(*content);
  if (!plan) return plan;
  auto source = source_in(*from);
  if (!source) return bad("what it says of its source");
  plan->source = std::move(*source);
  if (content->size() != 6 || json::text(j, "hash").value_or("") != plan->hash())
    return bad("its hash is another one");
  if (auto ok = holds_together(*plan); !ok) return std::unexpected(ok.error());
  return plan;
}

std::uint64_t curve_number(TileId id) { return proto::pmtiles_number(pmtiles::place_of(id)); }

Result<ShardTiles> ShardTiles::of(const ShardPlan& plan) {
  ShardTiles t;
  t.plan_ = &plan;
  auto layer = proto::decode_layer_json(plan.layer_text);
  if (!layer) return bad("its layer: " + layer.error().what);
  t.layer_ = std::move(*layer);
  std::uint64_t all = 0;
  if (t.layer_.available.size() > std::size_t(tiling::kMaxLevel) + 1) return bad("its levels");
  for (std::size_t z = 0; z < t.layer_.available.size(); ++z) {
    std::vector<TileRange> ranges;
    for (const proto::TileRange& r : t.layer_.available[z]) {
      if (r.end_x >= tiling::columns(int(z)) || r.end_y >= tiling::rows(int(z)) ||
          r.start_x > r.end_x || r.start_y > r.end_y)
        return bad("a tile of its layer");
      ranges.push_back({r.start_x, r.start_y, r.end_x, r.end_y});
    }
    t.areas_.emplace_back(std::move(ranges));
    if (on_the_wire(t.areas_.back().ranges()) != t.layer_.available[z]) return bad("its layer");
    all += t.areas_.back().size();
  }
  if (all != plan.tiles()) return bad("its number of tiles");
  if (std::size_t(plan.level) >= t.areas_.size()) return bad("the level of its shards");
  const TileArea& level = t.areas_[std::size_t(plan.level)];
  t.begins_ = {0};
  for (const ShardPlan::Shard& s : plan.shards) t.begins_.push_back(t.begins_.back() + s.subtrees);
  if (level.size() > kMostSubtrees || t.begins_.back() != level.size())
    return bad("its number of subtrees");
  for (std::uint64_t i = 0; i < level.size(); ++i) {
    const auto [x, y] = level[i];
    t.roots_.push_back({plan.level, x, y});
  }
  std::ranges::sort(t.roots_, {}, curve_number);
  return t;
}

std::vector<TileId> ShardTiles::roots(std::size_t shard) const {
  if (shard == kTop) return {};
  return {roots_.begin() + std::ptrdiff_t(begins_[shard]),
          roots_.begin() + std::ptrdiff_t(begins_[shard + 1])};
}

std::map<TileId, std::size_t> ShardTiles::first_shards(int level) const {
  std::map<TileId, std::size_t> first;
  const int up = plan_->level - level;
  if (up < 0) return first;
  for (std::size_t shard = 0; shard + 1 < begins_.size(); ++shard)
    for (auto k = begins_[shard]; k < begins_[shard + 1]; ++k)
      first.emplace(TileId{level, roots_[k].x >> up, roots_[k].y >> up}, shard);
  return first;
}

std::vector<TileArea> ShardTiles::areas(std::size_t shard) const {
  std::vector<TileArea> out(areas_.size());
  const auto level = std::size_t(plan_->level);
  if (shard == kTop) {
    std::copy_n(areas_.begin(), level, out.begin());
    return out;
  }
  const auto mine = roots(shard);
  for (std::size_t z = level; z < areas_.size(); ++z) {
    const auto down = z - level;
    std::vector<TileRange> ranges;
    for (const TileId root : mine) {
      const TileRange below{root.x << down, root.y << down, ((root.x + 1) << down) - 1,
                            ((root.y + 1) << down) - 1};
      for (const TileRange& r : areas_[z].within(below)) ranges.push_back(r);
    }
    out[z] = TileArea(std::move(ranges));
  }
  return out;
}

std::vector<TileId> ShardTiles::in_order(std::size_t shard) const {
  std::vector<TileId> ids;
  for (std::size_t z = 0; const TileArea& area : areas(shard)) {
    const auto first = std::ptrdiff_t(ids.size());
    for (std::uint64_t i = 0; i < area.size(); ++i) {
      const auto [x, y] = area[i];
      ids.push_back({int(z), x, y});
    }
    std::ranges::sort(ids.begin() + first, ids.end(), {}, curve_number);
    ++z;
  }
  return ids;
}

std::size_t ShardTiles::shard_of(TileId id) const {
  if (id.level < plan_->level) return kTop;
  const int up = id.level - plan_->level;
  const std::uint64_t root = curve_number({plan_->level, id.x >> up, id.y >> up});
  const auto at = std::ranges::lower_bound(roots_, root, {}, curve_number) - roots_.begin();
  return std::size_t(std::ranges::upper_bound(begins_, std::uint64_t(at)) - begins_.begin()) - 1;
}

proto::LayerJson ShardTiles::layer_of(std::size_t shard) const {
  proto::LayerJson layer = layer_;
  for (std::size_t z = 0; const TileArea& area : areas(shard))
    layer.available[z++] = on_the_wire(area.ranges());
  return layer;
}

}  // namespace tind
