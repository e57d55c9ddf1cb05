// layer.json is read as plain JSON, field by field: proto/tile/layer_json.cpp refuses what this has
// to describe.

#include "terrain/check/check_files.h"

#include <algorithm>

#include "proto/json_member.h"
#include "proto/json_text.h"
#include "terrain/base/caught.h"

namespace tind {

namespace {

using Json = nlohmann::json;

constexpr std::uint64_t kMostTiles = 20'000'000;  // of a URL
const std::string kLayer = "layer.json";

// ---- layer.json ----

struct Range {
  std::int64_t x0 = 0, y0 = 0, x1 = 0, y1 = 0;
  bool holds(TileId t) const { return t.x >= x0 && t.x <= x1 && t.y >= y0 && t.y <= y1; }
};
using Ranges = std::vector<std::vector<Range>>;

class LayerCheck {
 public:
  LayerCheck(const Json& json, Findings& findings) : json_(json), findings_(findings) {}

  /// `begins`: the first level that there is meant to be.
  void run(int begins) {
    text("format", rule("layer.format"), "quantized-mesh-1.0");
    text("projection", rule("layer.projection"), "EPSG:4326");
    text("scheme", rule("layer.scheme"), "tms");
    text("version", rule("layer.version"), "");
    text("attribution", rule("layer.attribution"), "");
    tiles();
    bounds();
    available(begins);
    zooms();
    extensions();
  }
  const Ranges& ranges() const { return ranges_; }
  const std::vector<std::string>& names() const { return names_; }

 private:
  void report(std::size_t r, const std::string& detail) { findings_.add(r, kLayer, detail); }

  void text(const char* key, std::size_t r, const std::string& wanted) {
    const Json* const it = json::member(json_, key);
    if (!it) return report(r, "missing");
    if (!it->is_string() || (!wanted.empty() && *it != wanted)) report(r, it->dump());
  }

  void tiles() {
    const auto it = json_.find("tiles");
    bool good = it != json_.end() && it->is_array() && !it->empty();
    if (good)
      for (const Json& item : *it)
        for (const char* part : {"{z}", "{x}", "{y}"})
          good &= item.is_string() && item.get<std::string>().find(part) != std::string::npos;
    if (!good) report(rule("layer.tiles"), it == json_.end() ? "missing" : it->dump());
  }

  void bounds() {
    const auto it = json_.find("bounds");
    if (it == json_.end()) return report(rule("layer.bounds"), "missing");
    bool good = it->is_array() && it->size() == 4;
    if (good) good = std::ranges::all_of(*it, [](const Json& x) { return x.is_number(); });
    if (good) {
      const double west = (*it)[0], south = (*it)[1], east = (*it)[2], north = (*it)[3];
      good = -180 <= west && west < east && east <= 180 && -90 <= south && south < north &&
             north <= 90;
    }
    if (!good) report(rule("layer.bounds"), it->dump());
  }

  void available(int begins) {
    const auto it = json_.find("available");
    if (it == json_.end() || !it->is_array())
      return report(rule("layer.available"), it == json_.end() ? "missing" : "not an array");
    for (const Json& level : *it) {
      ranges_.emplace_back();
      if (!level.is_array()) {
        report(rule("layer.available"), "level " + std::to_string(ranges_.size() - 1));
        continue;
      }
      for (const Json& item : level) range(item, int(ranges_.size()) - 1);
    }
    const auto root = [&](std::uint32_t x) {
      return !ranges_.empty() && std::ranges::any_of(ranges_[0], [&](const Range& r) {
        return r.holds({0, x, 0});
      });
    };
    if (begins == 0 && (!root(0) || !root(1))) report(rule("layer.roots"), "");
  }

  void range(const Json& item, int level) {
    const char* const keys[] = {"startX", "startY", "endX", "endY"};
    std::int64_t n[4] = {};
    for (int i = 0; i < 4; ++i) {
      const auto found = json::whole(item, keys[i]);
      if (!found)
        return report(rule("layer.available"),
                      "level " + std::to_string(level) + ": " + item.dump());
      n[i] = *found;
    }
    const Range r{n[0], n[1], n[2], n[3]};
    if (r.x0 > r.x1 || r.y0 > r.y1 || !tiling::tile(level, r.x0, r.y0) ||
        !tiling::tile(level, r.x1, r.y1))
      return report(rule("layer.range"), "level " + std::to_string(level) + ": " + item.dump());
    ranges_.back().push_back(r);
  }

  void zooms() {
    int deepest = -1;
    for (std::size_t z = 0; z < ranges_.size(); ++z)
      if (!ranges_[z].empty()) deepest = int(z);
    const auto max = json_.find("maxzoom"), min = json_.find("minzoom");
    const bool has_max = max != json_.end() && max->is_number_integer();
    if (!has_max)
      report(rule("layer.maxzoom"), "missing");
    else if (deepest >= 0 && *max != deepest)
      report(rule("layer.maxzoom"), max->dump() + ", deepest level " + std::to_string(deepest));
    const bool has_min = min != json_.end() && min->is_number_integer();
    if (!has_min)
      report(rule("layer.minzoom"), "missing");
    else if (*min < 0 || (has_max && *min > *max))
      report(rule("layer.minzoom"), min->dump());
  }

  void extensions() {
    const auto it = json_.find("extensions");
    if (it == json_.end()) return;
    if (!it->is_array()) return report(rule("layer.extensions"), "not an array");
    for (const Json& name : *it)
      if (name.is_string()) names_.push_back(name.get<std::string>());
  }

  const Json& json_;
  Findings& findings_;
  Ranges ranges_;
  std::vector<std::string> names_;
};

// ---- one against the other ----

/// Tiles of a column whose rows lie in [y0, y1].
std::int64_t count_in_column(const std::vector<TileId>& level, int z, const Range& r,
                             std::int64_t x) {
  const TileId low{z, std::uint32_t(x), std::uint32_t(r.y0)};
  const TileId high{z, std::uint32_t(x), std::uint32_t(r.y1)};
  return std::ranges::upper_bound(level, high) - std::ranges::lower_bound(level, low);
}

/// Looks at tiles that are there and at a few that are not: layer.json can call more available than
/// one could ever count.
void check_missing(const TileListing& listing, const Ranges& ranges, Findings& findings) {
  static const std::vector<TileId> kNone;
  for (std::size_t z = 0; z < ranges.size(); ++z) {
    const auto& level = z < listing.levels.size() ? listing.levels[z] : kNone;
    for (const Range& r : ranges[z]) {
      const auto count = std::uint64_t(r.y1 - r.y0 + 1);
      std::uint64_t missing = count * std::uint64_t(r.x1 - r.x0 + 1);
      for (std::int64_t x = r.x0; x <= r.x1; ++x) {
        const auto next = std::ranges::lower_bound(level, TileId{int(z), std::uint32_t(x), 0});
        if (next == level.end() || next->x > r.x1) break;
        x = next->x;
        missing -= std::uint64_t(count_in_column(level, int(z), r, x));
      }
      std::uint64_t named = 0;
      const std::uint64_t wanted = std::min<std::uint64_t>(missing, Findings::kExamples);
      for (std::int64_t x = r.x0; named < wanted; ++x)
        for (std::int64_t y = r.y0; named < wanted && y <= r.y1; ++y) {
          const TileId id{int(z), std::uint32_t(x), std::uint32_t(y)};
          if (listing.find(id) >= 0) continue;
          findings.add(rule("available.missing"), id.text(), "");
          ++named;
        }
      findings.count(rule("available.missing"), missing - named);
    }
  }
}

void check_unlisted(const TileListing& listing, const Ranges& ranges, int first,
                    Findings& findings) {
  for (const auto& level : listing.levels)
    for (const TileId id : level) {
      const auto z = std::size_t(id.level);
      const bool listed = z < ranges.size() && std::ranges::any_of(ranges[z], [&](const Range& r) {
                            return r.holds(id);
                          });
      if (!listed) findings.add(rule("available.unlisted"), id.text(), "");
      if (id.level > first && listing.find(id.parent()) < 0)
        findings.add(rule("available.orphan"), id.text(), "no " + id.parent().text());
    }
}

/// What layer.json calls available, once each.
Result<void> list_available(TileListing& listing, const Ranges& ranges, int first, int last) {
  std::uint64_t count = 0;
  const auto levels = std::min(ranges.size(), std::size_t(std::min(last, tiling::kMaxLevel)) + 1);
  listing.levels.resize(levels);
  for (std::size_t z = std::size_t(first); z < levels; ++z) {
    auto& level = listing.levels[z];
    for (const Range& r : ranges[z]) {
      count += std::uint64_t(r.x1 - r.x0 + 1) * std::uint64_t(r.y1 - r.y0 + 1);
      if (count > kMostTiles)
        return fail(Errc::out_of_range,
                    listing.store.name() + " lists more than " +
                        std::to_string(kMostTiles / 1'000'000) +
                        " million tiles: look at some levels, e.g. --levels 0-8");
      for (std::int64_t x = r.x0; x <= r.x1; ++x)
        for (std::int64_t y = r.y0; y <= r.y1; ++y)
          level.push_back({int(z), std::uint32_t(x), std::uint32_t(y)});
    }
    std::ranges::sort(level);
    const auto twice = std::ranges::unique(level);
    level.erase(twice.begin(), twice.end());
  }
  return {};
}

/// The levels asked for must hold a tile, where any level does: nothing looked at is nothing found.
Result<void> hold_any(const TileListing& listing, const Ranges& ranges, int first, int last) {
  int coarsest = -1, deepest = -1;
  const std::size_t levels = std::max(listing.levels.size(), ranges.size());
  for (std::size_t z = 0; z < levels; ++z) {
    const bool there = (z < listing.levels.size() && !listing.levels[z].empty()) ||
                       (z < ranges.size() && !ranges[z].empty());
    if (!there) continue;
    if (int(z) >= first && int(z) <= last) return {};
    if (coarsest < 0) coarsest = int(z);
    deepest = int(z);
  }
  if (coarsest < 0) return {};
  return fail(Errc::out_of_range, "--levels " + std::to_string(first) + "-" + std::to_string(last) +
                                      ": " + listing.store.name() +
                                      " has no tile of those; it has levels " +
                                      std::to_string(coarsest) + " to " + std::to_string(deepest));
}

void keep_levels(TileListing& listing, int first, int last) {
  if (std::size_t(last) + 1 < listing.levels.size()) listing.levels.resize(std::size_t(last) + 1);
  for (std::size_t z = 0; z < std::min(std::size_t(first), listing.levels.size()); ++z)
    listing.levels[z].clear();
}

/// What the store says is wrong with what it keeps beside the tiles.
void report_faults(const TileStore& store, Findings& findings) {
  for (const StoreFault& fault : store.faults()) {
    const bool ledger = fault.in == StoreFault::In::ledger;
    findings.add(ledger ? rule("tile.ledger") : rule("build.blocks"), fault.name, fault.what);
  }
}

}  // namespace

std::int64_t TileListing::find(TileId id) const {
  if (id.level < 0 || std::size_t(id.level) >= levels.size()) return -1;
  const auto& level = levels[std::size_t(id.level)];
  const auto it = std::ranges::lower_bound(level, id);
  return it != level.end() && *it == id ? it - level.begin() : -1;
}

bool read_tile_file(const TileListing& listing, TileId id, std::vector<std::uint8_t>& bytes,
                    Findings& findings) {
  auto read = listing.store.look_at(id);
  if (!read) {
    const Error& why = read.error();
    if (why.code == Errc::not_found)
      findings.add(rule("available.missing"), id.text(), "");
    else
      findings.add(may_pass(why) ? rule("tile.unread") : rule("tile.readable"), id.text(),
                   why.what);
    return false;
  }
  bytes = std::move(read->bytes);
  if (read->vouched == Vouched::not_listed)
    findings.add(rule("tile.ledger"), id.text(), "not in it");
  if (read->vouched == Vouched::other_bytes)
    findings.add(rule("tile.ledger"), id.text(), "other bytes");
  if (gunzip(bytes)) return true;
  findings.add(rule("tile.gzip"), id.text(), "");
  return false;
}

Result<TileListing> check_files(const TileStore& store, int first, int last, Findings& findings) {
  TileListing listing{.store = store, .levels = {}, .extensions = {}};
  auto there = store.list();
  if (!there) return std::unexpected(there.error());
  const bool listed = there->has_value();
  if (listed) {
    listing.levels = std::move((*there)->levels);
    for (const std::string& stray : (*there)->strays)
      findings.add(rule("available.stray"), stray, "");
  }
  report_faults(store, findings);
  const auto bytes = store.layer_json();
  if (!bytes && (!listed || may_pass(bytes.error()))) return std::unexpected(bytes.error());
  const Json json = bytes ? json::parse<Json>(*bytes) : Json();
  if (!json.is_object()) {
    findings.add(rule("layer.readable"), kLayer, bytes ? "not a JSON object" : "cannot be read");
    if (auto any = hold_any(listing, {}, first, last); !any) return std::unexpected(any.error());
    keep_levels(listing, first, last);
    return listing;
  }
  LayerCheck layer(json, findings);
  // Levels that others make, of a build that was shared out.
  const auto record = store.record();
  if (!record) return std::unexpected(record.error());
  const int begins = *record ? std::clamp((*record)->first_level, 0, tiling::kMaxLevel) : 0;
  layer.run(begins);
  listing.extensions = layer.names();
  if (auto any = hold_any(listing, layer.ranges(), first, last); !any)
    return std::unexpected(any.error());
  if (listed) {
    check_missing(listing, layer.ranges(), findings);
  } else if (auto done = list_available(listing, layer.ranges(), first, last); !done) {
    return std::unexpected(done.error());
  }
  check_unlisted(listing, layer.ranges(), std::max(listed ? 0 : first, begins), findings);
  keep_levels(listing, first, last);
  return listing;
}

}  // namespace tind
