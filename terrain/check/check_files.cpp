// layer.json is read as plain JSON, field by field: proto/layer_json.cpp refuses what this has
// to describe.

#include "terrain/check/check_files.h"

#include <algorithm>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "terrain/raster/source_blocks.h"

namespace tind {

namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

constexpr std::uint64_t kMostTiles = 20'000'000;  // of a URL
const std::string kLayer = "layer.json";

// ---- listing ----

Result<void> list_directory(TileListing& listing, Findings& findings) {
  const std::string& directory = listing.location.base();
  std::error_code error;
  std::vector<std::string> strays;
  fs::recursive_directory_iterator it(directory, error), end;
  if (error) return fail(Errc::not_found, "cannot look into " + directory + ": " + error.message());
  for (; it != end; it.increment(error)) {
    if (error) return fail(Errc::io, "cannot look into " + directory + ": " + error.message());
    const fs::path relative = it->path().lexically_relative(directory);
    if (relative.string().starts_with("tind-update") && it->is_directory(error))
      it.disable_recursion_pending();  // an update on the way: no part of the set yet
    if (it->path().extension() != ".terrain") continue;
    if (const auto id = tile_of_path(relative)) {
      if (listing.levels.size() <= std::size_t(id->level)) listing.levels.resize(id->level + 1u);
      listing.levels[std::size_t(id->level)].push_back(*id);
    } else {
      strays.push_back(relative.string());
    }
  }
  for (auto& level : listing.levels) std::ranges::sort(level);
  std::ranges::sort(strays);
  for (const std::string& stray : strays) findings.add(rule("available.stray"), stray, "");
  return {};
}

// ---- layer.json ----

struct Range {
  std::int64_t x0 = 0, y0 = 0, x1 = 0, y1 = 0;
  bool holds(TileId t) const { return t.x >= x0 && t.x <= x1 && t.y >= y0 && t.y <= y1; }
};
using Ranges = std::vector<std::vector<Range>>;

class LayerCheck {
 public:
  LayerCheck(const Json& json, Findings& findings) : json_(json), findings_(findings) {}

  void run() {
    text("format", rule("layer.format"), "quantized-mesh-1.0");
    text("projection", rule("layer.projection"), "EPSG:4326");
    text("scheme", rule("layer.scheme"), "tms");
    text("version", rule("layer.version"), "");
    text("attribution", rule("layer.attribution"), "");
    tiles();
    bounds();
    available();
    zooms();
    extensions();
  }
  const Ranges& ranges() const { return ranges_; }
  const std::vector<std::string>& names() const { return names_; }

 private:
  void report(std::size_t r, const std::string& detail) { findings_.add(r, kLayer, detail); }

  void text(const char* key, std::size_t r, const std::string& wanted) {
    const auto it = json_.find(key);
    if (it == json_.end()) return report(r, "missing");
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

  void available() {
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
    if (!root(0) || !root(1)) report(rule("layer.roots"), "");
  }

  void range(const Json& item, int level) {
    const char* const keys[] = {"startX", "startY", "endX", "endY"};
    std::int64_t n[4] = {};
    for (int i = 0; i < 4; ++i) {
      if (!item.is_object() || !item.contains(keys[i]) || !item[keys[i]].is_number_integer())
        return report(rule("layer.available"),
                      "level " + std::to_string(level) + ": " + item.dump());
      n[i] = item[keys[i]].get<std::int64_t>();
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
                    listing.location.base() + " lists more than " +
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

/// The first template that names a tile, and the version to put into it.
void use_template(TileListing& listing, const Json& json) {
  const auto tiles = json.find("tiles"), version = json.find("version");
  if (tiles == json.end() || !tiles->is_array() || tiles->empty() || !(*tiles)[0].is_string())
    return;
  listing.location.use_template(
      (*tiles)[0].get<std::string>(),
      version != json.end() && version->is_string() ? version->get<std::string>() : "");
}

void keep_levels(TileListing& listing, int first, int last) {
  if (std::size_t(last) + 1 < listing.levels.size()) listing.levels.resize(std::size_t(last) + 1);
  for (std::size_t z = 0; z < std::min(std::size_t(first), listing.levels.size()); ++z)
    listing.levels[z].clear();
}

/// The hashes of blocks that the record of a build names: without them there is no update.
void check_blocks(const TileLocation& location, Findings& findings) {
  const auto text = location.read(location.file("tind-build.json"));
  if (!text) return;
  const Json record = Json::parse(*text, nullptr, false);
  if (!record.is_object() || !record.contains("heights") || !record["heights"].is_string()) return;
  const std::string digest = record["heights"], file = "tind-blocks-" + digest;
  const auto bytes = location.read(location.file(file));
  if (!bytes)
    findings.add(rule("build.blocks"), file, "cannot be read");
  else if (!SourceBlocks::whole({reinterpret_cast<const char*>(bytes->data()), bytes->size()},
                                digest))
    findings.add(rule("build.blocks"), file, "damaged");
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
  auto read = listing.location.read(listing.location.tile(id));
  if (!read) {
    const bool missing = read.error().code == Errc::not_found;
    findings.add(missing ? rule("available.missing") : rule("tile.readable"), id.text(),
                 listing.location.remote() && !missing ? read.error().what : "");
    return false;
  }
  bytes = std::move(*read);
  if (listing.ledger) {
    const auto entry = listing.ledger->find(id);
    if (!entry)
      findings.add(rule("tile.ledger"), id.text(), "not in it");
    else if (!entry->vouches_for({reinterpret_cast<const char*>(bytes.data()), bytes.size()}))
      findings.add(rule("tile.ledger"), id.text(), "other bytes");
  }
  if (gunzip(bytes)) return true;
  findings.add(rule("tile.gzip"), id.text(), "");
  return false;
}

Result<TileListing> check_files(const TileLocation& location, int first, int last,
                                Findings& findings) {
  TileListing listing{.location = location, .levels = {}, .extensions = {}, .ledger = {}};
  if (!location.remote()) {
    if (auto listed = list_directory(listing, findings); !listed)
      return std::unexpected(listed.error());
    auto ledger = TileLedger::open(location.file(kLedgerFile));
    if (ledger)
      listing.ledger = std::make_shared<const TileLedger>(std::move(*ledger));
    else if (ledger.error().code != Errc::not_found)
      findings.add(rule("tile.ledger"), kLedgerFile, "damaged");
    check_blocks(location, findings);
  }
  const auto bytes = location.read(location.file(kLayer));
  if (!bytes && location.remote()) return std::unexpected(bytes.error());
  const Json json = bytes ? Json::parse(*bytes, nullptr, false) : Json();
  if (!json.is_object()) {
    findings.add(rule("layer.readable"), kLayer, bytes ? "not a JSON object" : "cannot be read");
    keep_levels(listing, first, last);
    return listing;
  }
  LayerCheck layer(json, findings);
  layer.run();
  listing.extensions = layer.names();
  if (location.remote()) {
    use_template(listing, json);
    if (auto listed = list_available(listing, layer.ranges(), first, last); !listed)
      return std::unexpected(listed.error());
  } else {
    check_missing(listing, layer.ranges(), findings);
  }
  check_unlisted(listing, layer.ranges(), location.remote() ? first : 0, findings);
  keep_levels(listing, first, last);
  return listing;
}

}  // namespace tind
