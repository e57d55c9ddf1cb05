// OGC 22-025r4 (3D Tiles 1.1), read as its text says and not as tind writes it.

#include "terrain/check/check_tileset.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <optional>
#include <set>
#include <string_view>

#include "proto/json_member.h"
#include "proto/json_text.h"
#include "terrain/base/caught.h"
#include "terrain/check/check_glb.h"
#include "terrain/check/subtree.h"

namespace tind {
namespace {

using Json = nlohmann::json;

constexpr const char* kTileset = "tileset.json";
constexpr int kDeepest = 30;                     // level of a tile
constexpr std::size_t kMostValues = 10'000'000;  // of JSON; each takes up to 100 bytes
constexpr std::size_t kLongestUri = 4096;

const Json& list(const Json& object, const char* name) {
  static const Json kNone = Json::array();
  const Json* const found = json::member(object, name);
  return found && found->is_array() ? *found : kNone;
}

struct Place {
  int level = 0;
  std::uint64_t x = 0, y = 0;
};

/// As OGC 22-025r4, 7.1.5, demands it: else a million tiles would share one file.
bool is_template(const std::string& uri) {
  return uri.size() <= kLongestUri && uri.find("{level}") != uri.npos &&
         uri.find("{x}") != uri.npos && uri.find("{y}") != uri.npos;
}

std::string named(std::string text, const Place& at) {
  for (const auto& [what, number] :
       {std::pair<std::string_view, std::uint64_t>{"{level}", std::uint64_t(at.level)},
        {"{x}", at.x},
        {"{y}", at.y}})
    for (std::size_t i = text.find(what); i != text.npos; i = text.find(what, i))
      text.replace(i, what.size(), std::to_string(number));
  return text.starts_with("./") ? text.substr(2) : text;
}

// ---- all of it ----

/// An object, or what is wrong with the text.
Result<Json> read_tileset(const std::string& text) {
  if (json::count_values(text) > kMostValues)
    return fail(Errc::out_of_range,
                "has more than " + std::to_string(kMostValues) + " JSON values");
  if (json::too_deep(text))
    return fail(Errc::out_of_range,
                "is nested more than " + std::to_string(json::kDeepest) +
                    " deep, and is not read: keep its tiles less deep in each other, or in several "
                    "tilesets");
  Json json = json::parse<Json>(text);
  if (!json.is_object()) return fail(Errc::bad_data, "is no JSON object");
  return json;
}

class TilesetCheck {
 public:
  TilesetCheck(const TilesetFiles& files, const Progress& progress)
      : files_(files), progress_(progress) {}

  Result<TilesetReport> run() {
    const auto text = files_.read(kTileset);
    if (!text && may_pass(text.error())) return std::unexpected(text.error());
    const auto tileset = text ? read_tileset(*text) : std::unexpected(text.error());
    seen_.insert(kTileset);
    if (tileset)
      head(*tileset);
    else
      found(kTileset, tileset.error().what);
    if (progress_.stopped()) return fail(Errc::cancelled, "stopped");
    if (tileset && !subtree_unread_)  // else nothing leads anywhere, or nobody knows where
      for (const auto& [name, size] : files_.sizes())
        if (!enough() && !seen_.contains(name) &&
            (name.ends_with(".glb") || name.ends_with(".subtree")))
          found(name, "no tile leads to it");
    if (files_.archive()) {
      const auto wrong = files_.wrong_index();
      if (!wrong)
        unread("the archive's index", wrong.error().what);
      else if (!wrong->empty())
        found("the archive's index", *wrong);
    }
    return std::move(report_);
  }

 private:
  const TilesetFiles& files_;
  const Progress& progress_;
  TilesetReport report_;
  std::set<std::string> seen_;
  bool subtree_unread_ = false;

  bool enough() const { return progress_.stopped() || report_.ended_early(); }

  void found(const std::string& where, const std::string& what) {
    ++report_.violations;
    if (report_.examples.size() < TilesetReport::kExamples)
      report_.examples.push_back(where + ": " + what);
  }

  void unread(const std::string& where, const std::string& what) {
    ++report_.unread;
    if (report_.unread_examples.size() < TilesetReport::kExamples)
      report_.unread_examples.push_back(where + ": " + what);
  }

  void head(const Json& tileset) {
    const Json* const asset = json::member(tileset, "asset");
    const std::string version = asset ? json::text(*asset, "version").value_or("") : "";
    if (version != "1.0" && version != "1.1") found(kTileset, "asset.version is not 1.0 or 1.1");
    if (!json::number(tileset, "geometricError", 0)) found(kTileset, "has no geometricError");
    const Json* const root = json::member(tileset, "root");
    if (!root) return found(kTileset, "has no root");
    tile(*root, HUGE_VAL, 0);
  }

  void tile(const Json& t, double parents_error, int depth) {
    if (depth > 200) return found(kTileset, "has tiles within tiles more than 200 deep");
    const auto error = json::number(t, "geometricError", 0);
    if (!error) found(kTileset, "a tile has no geometricError");
    if (error && *error > parents_error) found(kTileset, "a tile's error is above its parent's");
    if (!json::member(t, "boundingVolume")) found(kTileset, "a tile has no boundingVolume");
    const Json* const content = json::member(t, "content");
    const std::string uri = content ? json::text(*content, "uri").value_or("") : "";
    if (const Json* const tiling = json::member(t, "implicitTiling")) return implicit(*tiling, uri);
    if (content) look_at(uri);
    for (const Json& child : list(t, "children"))
      tile(child, error.value_or(parents_error), depth + 1);
  }

  void implicit(const Json& tiling, const std::string& content) {
    const auto levels = json::whole(tiling, "subtreeLevels", 1, kMostSubtreeLevels);
    const auto all = json::whole(tiling, "availableLevels", 1, kDeepest);
    const Json* const subtrees = json::member(tiling, "subtrees");
    const std::string uri = subtrees ? json::text(*subtrees, "uri").value_or("") : "";
    if (json::text(tiling, "subdivisionScheme").value_or("") != "QUADTREE" || !levels || !all ||
        uri.empty())
      return found(kTileset, "implicitTiling is no quadtree, or lacks its levels or subtrees");
    if (!is_template(uri) || (!content.empty() && !is_template(content)))
      return found(kTileset, "implicitTiling has a URI without {level}, {x} or {y}");
    std::vector<Place> waiting{{0, 0, 0}};
    while (!waiting.empty() && !enough()) {
      const Place at = waiting.back();
      waiting.pop_back();
      const std::string name = named(uri, at);
      const std::uint64_t unread_before = report_.unread;
      const auto bytes = file(name);
      subtree_unread_ |= report_.unread > unread_before;
      if (!bytes) continue;
      ++report_.subtrees;
      const auto subtree = read_subtree(*bytes, int(*levels));
      if (!subtree) {
        found(name, subtree.error().what);
        continue;
      }
      contents_of(*subtree, at, int(*levels), int(*all), name, content);
      const std::uint64_t side = std::uint64_t(1) << *levels;
      for (std::uint64_t y = 0; y < side; ++y)
        for (std::uint64_t x = 0; x < side && !enough(); ++x) {
          if (!subtree->children.at(subtree_morton(x, y))) continue;
          const Place child{at.level + int(*levels), at.x * side + x, at.y * side + y};
          if (child.level >= *all)
            found(name, "has a subtree below the deepest level");
          else if (is_there(named(uri, child)))
            waiting.push_back(child);
        }
    }
  }

  void contents_of(const ReadSubtree& subtree, const Place& root, int levels, int all,
                   const std::string& name, const std::string& content) {
    std::uint64_t first = 0;  // of the level
    for (int depth = 0; depth < levels; ++depth) {
      const std::uint64_t side = std::uint64_t(1) << depth;
      for (std::uint64_t y = 0; y < side; ++y)
        for (std::uint64_t x = 0; x < side && !enough(); ++x) {
          const std::uint64_t i = first + subtree_morton(x, y);
          const bool tile = subtree.tiles.at(i);
          const std::uint64_t parent =
              depth > 0 ? first - side * side / 4 + subtree_morton(x / 2, y / 2) : 0;
          const Place at{root.level + depth, root.x * side + x, root.y * side + y};
          if (tile && depth > 0 && !subtree.tiles.at(parent))
            found(name, "has a tile without its parent: " + named("{level}/{x}/{y}", at));
          if (tile && at.level >= all) found(name, "has a tile below the deepest level");
          if (!subtree.contents.at(i)) continue;
          if (!tile) found(name, "has a content without its tile");
          look_at(named(content, at));
        }
      first += side * side;
    }
  }

  /// A finding where it is not. What is not there is not kept: a subtree of a hundred bytes can
  /// name a million files.
  bool is_there(const std::string& name) {
    if (files_.sizes().contains(name)) return true;
    found(name, "is not there");
    return false;
  }

  /// Once; nothing, and a finding, where it cannot be had.
  std::optional<std::string> file(const std::string& name) {
    if (!is_there(name) || !seen_.insert(name).second) return {};
    auto bytes = files_.read(name);
    const auto done = double(seen_.size()), all = double(files_.sizes().size());
    progress_.at(std::min(1.0, done / std::max(all, 1.0)));
    if (bytes) return std::move(*bytes);
    if (may_pass(bytes.error()))
      unread(name, bytes.error().what);
    else
      found(name, bytes.error().what);
    return {};
  }

  void look_at(const std::string& uri) {
    if (enough()) return;
    const std::string name = uri.substr(0, uri.find_first_of("?#"));
    if (name.empty() || name.find("://") != name.npos) return;  // somebody else's
    const auto bytes = file(name);
    if (!bytes) return;
    ++report_.contents;
    if (!name.ends_with(".glb")) return;
    if (const std::string wrong = wrong_with_glb(*bytes); !wrong.empty()) found(name, wrong);
  }
};

/// Of ".../LEVEL/X/Y.glb".
std::optional<int> level_in(std::string_view name) {
  for (int part = 0; part < 2; ++part) {
    const std::size_t slash = name.rfind('/');
    if (slash == name.npos) return {};
    name = name.substr(0, slash);
  }
  name = name.substr(name.rfind('/') + 1);
  int level = 0;
  const auto [end, error] = std::from_chars(name.data(), name.data() + name.size(), level);
  if (error != std::errc() || end != name.data() + name.size() || level < 0 || level > kDeepest)
    return {};
  return level;
}

bool is_implicit(const Json& tile, int depth = 0) {
  if (json::member(tile, "implicitTiling")) return true;
  return depth < 20 && std::ranges::any_of(list(tile, "children"), [&](const Json& child) {
           return is_implicit(child, depth + 1);
         });
}

}  // namespace

Result<TilesetFacts> tileset_facts(const TilesetFiles& files) {
  const auto text = files.read(kTileset);
  if (!text) return std::unexpected(text.error());
  const auto read = read_tileset(*text);
  if (!read) return fail(read.error().code, std::string(kTileset) + " " + read.error().what);
  const Json& tileset = *read;
  const Json* const asset = json::member(tileset, "asset");
  if (!asset) return fail(Errc::bad_data, "tileset.json is none of 3D Tiles: it has no asset");
  TilesetFacts facts;
  facts.version = json::text(*asset, "version").value_or("");
  facts.tileset_version = json::text(*asset, "tilesetVersion").value_or("");
  if (const Json* const extras = json::member(*asset, "extras")) {
    facts.generator = json::text(*extras, "generator").value_or("");
    facts.name = json::text(*extras, "name").value_or("");
    facts.attribution = json::text(*extras, "attribution").value_or("");
  }
  if (const Json* const root = json::member(tileset, "root")) facts.implicit = is_implicit(*root);
  std::array<TilesetLevel, kDeepest + 1> levels{};
  for (const auto& [name, size] : files.sizes()) {
    if (name.ends_with(".subtree")) ++facts.subtrees;
    if (!name.ends_with(".glb")) continue;
    if (facts.contents++ == 0)
      if (const auto bytes = files.read(name)) facts.compression = glb_compression(*bytes);
    if (const auto level = level_in(name)) {
      ++levels[std::size_t(*level)].contents;
      levels[std::size_t(*level)].bytes += size;
    }
  }
  for (int z = 0; z <= kDeepest; ++z)
    if (TilesetLevel& level = levels[std::size_t(z)]; level.contents > 0) {
      level.level = z;
      facts.levels.push_back(level);
    }
  return facts;
}

Result<TilesetReport> check_tileset(const TilesetFiles& files, const Progress& progress) {
  return TilesetCheck(files, progress).run();
}

}  // namespace tind
