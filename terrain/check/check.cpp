// A level is gone through in chunks of whole columns. Of each tile only its four edges outlive the
// chunk, and only for one column: the next one's western neighbours.

#include "terrain/check/check.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>

#include "terrain/base/parallel.h"
#include "terrain/check/check_decode.h"
#include "terrain/check/check_files.h"
#include "terrain/check/check_source.h"
#include "terrain/check/check_tile.h"
#include "terrain/check/source_note.h"
#include "terrain/shapes/surface_shapes.h"
#include "terrain/store/open/open_store.h"

namespace tind {

namespace {

constexpr std::size_t kChunkTiles = 1024;
constexpr int kRemoteThreads = 8;  // mostly waiting for answers
constexpr double kEnd = 32767;
enum { kWest, kSouth, kEast, kNorth };

std::string metres(double x) {
  char text[40];
  std::snprintf(text, sizeof text, "%.9g m", x);
  return text;
}

// ---- edges ----

struct EdgePoint {
  double along = 0;  // in the tile's grid
  double height = 0;
  std::array<std::uint8_t, 2> normal{};
  friend bool operator<(const EdgePoint& a, const EdgePoint& b) {
    return std::pair(a.along, a.height) < std::pair(b.along, b.height);
  }
};
using Edge = std::vector<EdgePoint>;

/// The vertices on one side, whatever the tile's own lists say.
Edge edge_of(const CheckedTile& t, int side) {
  const auto& across = side % 2 == 0 ? t.u : t.v;
  const auto& along = side % 2 == 0 ? t.v : t.u;
  const std::int32_t place = side < 2 ? 0 : 32767;
  Edge edge;
  for (std::size_t i = 0; i < across.size(); ++i)
    if (across[i] == place)
      edge.push_back({double(along[i]), t.height(i),
                      t.normals.empty() ? std::array<std::uint8_t, 2>{} : t.normals[i]});
  std::sort(edge.begin(), edge.end());
  return edge;
}

/// The mesh along a line near the middle of the tile, where its children meet: south to north at
/// u = place, or west to east at v = place.
Edge line_through(const CheckedTile& t, bool northward, std::int32_t place) {
  const auto& across = northward ? t.u : t.v;
  const auto& along = northward ? t.v : t.u;
  Edge line;
  for (const auto& triangle : t.triangles) {
    for (int k = 0; k < 3; ++k) {
      const auto a = triangle[std::size_t(k)], b = triangle[std::size_t((k + 1) % 3)];
      if (across[a] == place) line.push_back({double(along[a]), t.height(a), {}});
      if ((across[a] < place) == (across[b] < place) || across[a] == place || across[b] == place)
        continue;
      const double s = (double(place) - across[a]) / (double(across[b]) - across[a]);
      line.push_back({along[a] + s * (double(along[b]) - along[a]),
                      t.height(a) + s * (t.height(b) - t.height(a)),
                      {}});
    }
  }
  std::sort(line.begin(), line.end());
  return line;
}

/// The middle lies between two columns, or rows, of places: vertices can stand on either.
constexpr std::array<std::int32_t, 2> kMiddles = {16383, 16384};

/// Height of the line at a place along it. REQUIRES: two points or more.
double height_along(const Edge& edge, double at) {
  const auto after = std::ranges::upper_bound(edge, at, {}, &EdgePoint::along);
  const auto right = after == edge.end() ? after - 1 : std::max(after, edge.begin() + 1);
  const EdgePoint &a = *(right - 1), &b = *right;
  if (a.along == b.along) return b.height;
  return a.height + (at - a.along) / (b.along - a.along) * (b.height - a.height);
}

/// The largest difference of two lines, the second one's places mapped by scale and shift.
double distance(const Edge& a, const Edge& b, double scale, double shift) {
  double gap = 0;
  for (const EdgePoint& p : a) {
    const double at = (p.along - shift) / scale;
    if (at >= 0 && at <= kEnd) gap = std::max(gap, std::abs(p.height - height_along(b, at)));
  }
  for (const EdgePoint& p : b) {
    const double at = p.along * scale + shift;
    if (at >= 0 && at <= kEnd) gap = std::max(gap, std::abs(p.height - height_along(a, at)));
  }
  return gap;
}

/// What is kept of a tile after it has been looked at.
struct TileSummary {
  bool good = false, has_normals = false;
  std::array<Edge, 4> edges;
  std::array<std::array<Edge, 2>, 2> middles;  // northward, eastward; of parents
  StatedError stated;
  double min_height = 0, max_height = 0;
};

// ---- one level ----

/// Of 16 x 16 cells: one that lies in a polygon with all corners and its middle, and that no
/// outline touches, is water; one that lies outside all, is none.
void check_water(const CheckedTile& tile, TileId id, const WaterSource& water, Findings& findings) {
  if (water.empty()) return;
  if (!tile.has_water_mask)
    return findings.add(rule("source.water"), id.text(), "it has no water mask");
  if (!water.rasters.empty() || tile.water_mask.empty()) return;
  const GeoRect r = tiling::rect(id);
  const double side = r.width() / 256;
  for (int row = 8; row < 256; row += 16)
    for (int col = 8; col < 256; col += 16) {
      const double west = r.west + col * side, north = r.north - row * side;
      if (water.areas.crosses({west, north - side, west + side, north})) continue;
      const bool wet = water.areas.holding(west + side / 2, north - side / 2) != AreaSet::kNone;
      const std::size_t cell = tile.water_mask.size() == 1 ? 0 : std::size_t(row * 256 + col);
      if (tile.water_mask[cell] == (wet ? 255 : 0)) continue;
      return findings.add(rule("source.water"), id.text(),
                          "row " + std::to_string(row) + ", column " + std::to_string(col) +
                              " is " + std::to_string(tile.water_mask[cell]));
    }
}

class LevelCheck {
 public:
  LevelCheck(const TileListing& listing, std::size_t z, const CheckOptions& options,
             const std::vector<std::vector<MeasuredTile>>* measured, CheckReport& report)
      : listing_(listing),
        tiles_(listing.levels[z]),
        options_(options),
        measured_(measured ? &(*measured)[z] : nullptr),
        report_(report) {
    level_.level = int(z);
    level_.tiles = tiles_.size();
    level_.budget_m = assumed_level_error(int(z)) * options.error_factor;
  }

  void run(const Progress& progress, double share_before, double share) {
    for (std::size_t begin = 0; begin < tiles_.size() && !progress.stopped();) {
      const std::size_t end = chunk_end(begin);
      chunk(begin, end);
      begin = end;
      progress.at(share_before + share * double(begin) / double(tiles_.size()));
    }
    around_the_globe();
    if (!tiles_.empty()) report_.levels.push_back(level_);
  }

 private:
  /// Whole columns, until there is enough to share out.
  std::size_t chunk_end(std::size_t begin) const {
    std::size_t end = std::min(begin + kChunkTiles, tiles_.size());
    while (end < tiles_.size() && tiles_[end].x == tiles_[end - 1].x) ++end;
    return end;
  }

  struct Looked {
    TileSummary summary;
    Findings findings;
    std::uint64_t triangles = 0, bytes = 0;
  };

  Looked look_at(TileId id) const {
    Looked l;
    std::vector<std::uint8_t> bytes;
    CheckedTile tile;
    if (!read_tile_file(listing_, id, bytes, l.findings)) return l;
    l.bytes = bytes.size();
    if (!check_decode(bytes, id.text(), tile, l.findings)) return l;
    l.triangles = tile.triangles.size();
    l.summary.stated = check_tile(tile, id, options_.error_factor, l.findings);
    l.summary.good = true;
    l.summary.has_normals = !tile.normals.empty();
    l.summary.min_height = tile.min_height;
    l.summary.max_height = tile.max_height;
    for (int side = 0; side < 4; ++side) l.summary.edges[std::size_t(side)] = edge_of(tile, side);
    for (const auto& [name, there] : {std::pair{"octvertexnormals", l.summary.has_normals},
                                      {"watermask", tile.has_water_mask},
                                      {"metadata", !tile.metadata.empty()}})
      if (there && std::ranges::find(listing_.extensions, name) == listing_.extensions.end())
        l.findings.add(rule("layer.extensions"), id.text(), std::string("carries ") + name);
    if (options_.source && options_.source->shapes())
      check_water(tile, id, options_.source->shapes()->water(), l.findings);
    return l;
  }

  void chunk(std::size_t begin, std::size_t end) {
    std::vector<Looked> looked(end - begin);
    parallel_for(looked.size(), options_.threads,
                 [&](std::size_t i) { looked[i] = look_at(tiles_[begin + i]); });
    for (Looked& l : looked) {
      report_.findings.merge(l.findings);
      level_.triangles += l.triangles;
      level_.bytes += l.bytes;
    }
    for (std::size_t i = 0; i < looked.size(); ++i) neighbours(begin, i, looked);
    parents(begin, looked);
    for (std::size_t i = 0; i < looked.size(); ++i) errors(begin + i, looked[i].summary);
    keep_columns(begin, looked);
  }

  const TileSummary* summary_of(TileId id, std::size_t begin,
                                const std::vector<Looked>& looked) const {
    const std::int64_t place = listing_.find(id) - std::int64_t(begin);
    if (place >= 0 && place < std::int64_t(looked.size()))
      return &looked[std::size_t(place)].summary;
    const auto it = last_column_.find(id);
    return it == last_column_.end() ? nullptr : &it->second;
  }

  /// Each pair is compared once: with the tile to the west and the one to the south.
  void neighbours(std::size_t begin, std::size_t i, const std::vector<Looked>& looked) {
    const TileId id = tiles_[begin + i];
    const TileSummary& here = looked[i].summary;
    if (id.x > 0)
      if (const TileSummary* west = summary_of({id.level, id.x - 1, id.y}, begin, looked))
        compare(id, here, kWest, {id.level, id.x - 1, id.y}, *west, kEast);
    if (id.y > 0)
      if (const TileSummary* south = summary_of({id.level, id.x, id.y - 1}, begin, looked))
        compare(id, here, kSouth, {id.level, id.x, id.y - 1}, *south, kNorth);
  }

  void compare(TileId id, const TileSummary& here, int side, TileId other_id,
               const TileSummary& other, int other_side) {
    if (!here.good || !other.good) return;
    const Edge &a = here.edges[std::size_t(side)], &b = other.edges[std::size_t(other_side)];
    if (a.size() < 2 || b.size() < 2) return;  // edge.short says it
    const bool same_places = std::ranges::equal(a, b, [](const EdgePoint& p, const EdgePoint& q) {
      return p.along == q.along && p.height == q.height;
    });
    const std::string pair = id.text() + " and " + other_id.text();
    if (!same_places) {
      const double gap = distance(a, b, 1, 0);
      level_.crack_m = std::max(level_.crack_m, gap);
      report_.findings.add(rule("crack.position"), pair, metres(gap));
    } else if (here.has_normals && other.has_normals &&
               !std::ranges::equal(a, b, {}, &EdgePoint::normal, &EdgePoint::normal)) {
      report_.findings.add(rule("crack.normal"), pair, "");
    }
  }

  /// The two sides that a tile has in common with its parent.
  void parents(std::size_t begin, const std::vector<Looked>& looked) {
    if (level_.level == 0) return;
    std::vector<TileId> ids;
    ids.reserve(looked.size());
    for (std::size_t i = 0; i < looked.size(); ++i) ids.push_back(tiles_[begin + i].parent());
    std::ranges::sort(ids);
    const auto twice = std::ranges::unique(ids);
    ids.erase(twice.begin(), twice.end());
    std::vector<TileSummary> summaries(ids.size());
    parallel_for(ids.size(), options_.threads,
                 [&](std::size_t i) { summaries[i] = parent_edges(ids[i]); });
    for (std::size_t i = 0; i < looked.size(); ++i) {
      const TileId id = tiles_[begin + i];
      const auto place = std::ranges::lower_bound(ids, id.parent()) - ids.begin();
      const TileSummary& parent = summaries[std::size_t(place)];
      if (!looked[i].summary.good || !parent.good) continue;
      gap_to_parent(id, looked[i].summary, parent, id.x % 2 ? kEast : kWest, id.y % 2);
      gap_to_parent(id, looked[i].summary, parent, id.y % 2 ? kNorth : kSouth, id.x % 2);
      gap_to_stand_in(id, looked[i].summary, parent);
      refines(id, looked[i].summary, parent);
    }
  }

  /// A client that takes `geometricerror` for the tile's error and the level's where there is none
  /// - or no tile, only a quarter of the parent - goes on only to children that are better.
  void refines(TileId id, const TileSummary& child, const TileSummary& parent) {
    const double assumed = assumed_level_error(id.level);
    double mine = child.stated.geometric_error_m.value_or(assumed);
    if (!whole_family(id)) mine = std::max(mine, assumed);
    const double its = parent.stated.geometric_error_m.value_or(2 * assumed);
    if (mine >= its)
      report_.findings.add(rule("error.refines"), id.parent().text(),
                           metres(its) + ", a child's is " + metres(mine));
  }

  bool whole_family(TileId id) const {
    return has({id.level, id.x ^ 1, id.y}) && has({id.level, id.x, id.y ^ 1}) &&
           has({id.level, id.x ^ 1, id.y ^ 1});
  }

  TileSummary parent_edges(TileId id) const {
    TileSummary r;
    Findings ignored;  // the parent's own level has reported them
    std::vector<std::uint8_t> bytes;
    CheckedTile tile;
    if (!read_tile_file(listing_, id, bytes, ignored)) return r;
    if (!check_decode(bytes, id.text(), tile, ignored)) return r;
    r.stated = check_tile(tile, id, options_.error_factor, ignored);
    for (int side = 0; side < 4; ++side) r.edges[std::size_t(side)] = edge_of(tile, side);
    for (std::size_t k = 0; k < 2; ++k) {
      r.middles[0][k] = line_through(tile, true, kMiddles[k]);
      r.middles[1][k] = line_through(tile, false, kMiddles[k]);
    }
    r.good = true;
    return r;
  }

  bool has(TileId id) const { return std::ranges::binary_search(tiles_, id); }

  void gap_to_parent(TileId id, const TileSummary& child, const TileSummary& parent, int side,
                     int half) {
    const double gap = gap_to(parent.edges[std::size_t(side)], child, side, half);
    level_.gap_m = std::max(level_.gap_m, gap);
    // What a tile says of its edges counts more than what it says of its posts.
    const StatedError &mine = child.stated, &its = parent.stated;
    if (mine.edge_error_m && its.edge_error_m)
      report_gap(rule("crack.stated"), id.text(), gap, *mine.edge_error_m + *its.edge_error_m);
    else if (mine.max_error_m && its.max_error_m)
      report_gap(rule("crack.level"), id.text(), gap, *mine.max_error_m + *its.max_error_m);
  }

  /// Where a neighbour is missing, its parent's part is drawn in its stead.
  void gap_to_stand_in(TileId id, const TileSummary& child, const TileSummary& parent) {
    const auto& mine =
        child.stated.edge_error_m ? child.stated.edge_error_m : child.stated.max_error_m;
    const auto look = [&](TileId missing, bool northward, int side, int half) {
      if (std::ranges::binary_search(tiles_, missing)) return;
      const auto& lines = parent.middles[northward ? 0 : 1];
      const double gap =
          std::min(gap_to(lines[0], child, side, half), gap_to(lines[1], child, side, half));
      level_.gap_m = std::max(level_.gap_m, gap);
      if (!mine || !parent.stated.max_error_m) return;
      const double its =
          std::max(*parent.stated.max_error_m, parent.stated.edge_error_m.value_or(0));
      report_gap(rule("crack.stand-in"), id.text() + " without " + missing.text(), gap,
                 *mine + its);
    };
    look({id.level, id.x ^ 1, id.y}, true, id.x % 2 ? kWest : kEast, id.y % 2);
    look({id.level, id.x, id.y ^ 1}, false, id.y % 2 ? kSouth : kNorth, id.x % 2);
  }

  /// Between a side of a tile and a line of its parent; 0 where one of the two is no line
  /// (edge.short says it).
  static double gap_to(const Edge& line, const TileSummary& child, int side, int half) {
    const Edge& edge = child.edges[std::size_t(side)];
    if (line.size() < 2 || edge.size() < 2) return 0;
    return distance(line, edge, 0.5, half * kEnd / 2);
  }

  void report_gap(std::size_t rule_number, const std::string& where, double gap, double allowed) {
    if (gap > allowed * (1 + 1e-9))
      report_.findings.add(rule_number, where,
                           metres(gap) + ", the errors together are " + metres(allowed));
  }

  /// Heights of one level decode to one number but for rounding, and levels are brought to the
  /// steps that heights have on borders, 1 m at most.
  static constexpr double kLevel_m = 2e-3, kLevelOff_m = 0.51;

  void errors(std::size_t place, const TileSummary& r) {
    if (!r.good) return;
    if (r.stated.max_error_m) level_.stated_m = std::max(level_.stated_m, *r.stated.max_error_m);
    if (!measured_) return;
    const MeasuredTile& m = (*measured_)[place];
    const std::string where = tiles_[place].text();
    level_.measured_m = std::max(level_.measured_m, m.max_error_m);
    level_.posts += m.posts;
    if (m.uncovered)
      report_.findings.add(rule("source.error"), where,
                           std::to_string(m.uncovered) + " posts are over no triangle");
    // Arithmetic in slivers, more where they are steep; the sixth digit is the last stated.
    const double rounding_m = 1e-6 + 2e-9 * m.max_error_m;
    side(r, m, where, rounding_m + options_.source->info().rounding_m);
    const double assumed = assumed_level_error(tiles_[place].level) * options_.error_factor;
    if (!r.stated.max_error_m && m.max_error_m > assumed + rounding_m)
      report_.findings.add(rule("source.error"), where,
                           "post " + std::to_string(m.col) + ", " + std::to_string(m.row) + ": " +
                               metres(m.max_error_m) + ", none stated, and clients assume " +
                               metres(assumed));
    if (r.stated.max_error_m && m.max_error_m > *r.stated.max_error_m + rounding_m)
      report_.findings.add(rule("source.error"), where,
                           "post " + std::to_string(m.col) + ", " + std::to_string(m.row) + ": " +
                               metres(m.max_error_m) + ", stated " + metres(*r.stated.max_error_m));
    // What a maker may add for the rounding of heights and places.
    const double slack = options_.source->info().rounding_m + 2e-6 + 1e-3 * m.max_error_m;
    if (r.stated.exact && *r.stated.max_error_m > m.max_error_m + slack)
      report_.findings.add(rule("source.exact"), where,
                           metres(m.max_error_m) + ", stated " + metres(*r.stated.max_error_m));
    for (const auto& [level, range] : m.flat)
      if (range.high - range.low > kLevel_m || std::max(range.high, -range.low) > kLevelOff_m)
        report_.findings.add(rule("source.flat"), where,
                             "water at " + metres(level) + " is from " + metres(level + range.low) +
                                 " to " + metres(level + range.high));
    if (m.posts && (m.low_m < r.min_height || m.high_m > r.max_height))
      report_.findings.add(rule("source.height"), where,
                           "posts " + metres(m.low_m) + ".." + metres(m.high_m) + ", stated " +
                               metres(r.min_height) + ".." + metres(r.max_height));
  }

  /// A one-sided tile may touch posts on its other side, and no more.
  void side(const TileSummary& r, const MeasuredTile& m, const std::string& where, double slack) {
    const double wrong = r.stated.side == Side::above   ? m.below_m
                         : r.stated.side == Side::below ? m.above_m
                                                        : 0;
    if (m.posts && wrong > slack)
      report_.findings.add(
          rule("source.side"), where,
          "a post is " + metres(wrong) + " " + name_of(r.stated.side) + " the mesh");
  }

  void keep_columns(std::size_t begin, std::vector<Looked>& looked) {
    last_column_.clear();
    for (std::size_t i = 0; i < looked.size(); ++i) {
      const TileId id = tiles_[begin + i];
      if (id.x == 0) first_column_[id] = looked[i].summary;
      if (id.x == tiles_[begin + looked.size() - 1].x) last_column_[id] = looked[i].summary;
    }
  }

  /// The antimeridian: the first column's western neighbours are in the last one.
  void around_the_globe() {
    const std::uint32_t last = tiling::columns(level_.level) - 1;
    for (const auto& [id, here] : first_column_) {
      const auto it = last_column_.find({id.level, last, id.y});
      if (it != last_column_.end()) compare(id, here, kWest, it->first, it->second, kEast);
    }
  }

  const TileListing& listing_;
  const std::vector<TileId>& tiles_;
  const CheckOptions& options_;
  const std::vector<MeasuredTile>* measured_;
  CheckReport& report_;
  CheckLevel level_;
  std::map<TileId, TileSummary> first_column_, last_column_;
};

/// Tiles that are missing can only be known by the posts that they would hold.
void find_missing(const MeasuredTiles& measured, const Surface& source, const std::string& where,
                  Findings& findings) {
  const auto of = [&](std::uint64_t posts) {
    return std::to_string(posts) + " of " + std::to_string(measured.posts) + " posts";
  };
  if (measured.nowhere > 0)
    findings.add(rule("source.missing"), where, of(measured.nowhere) + " lie in no tile");
  if (!source.only()) return;  // fine layers have levels of their own
  for (std::size_t z = 0; z < measured.tiles.size(); ++z)
    if (!measured.tiles[z].empty() && measured.outside[z] > measured.nowhere)
      findings.add(rule("source.sparse"), "level " + std::to_string(z),
                   of(measured.outside[z]) + " lie in no tile of it");
}

}  // namespace

Result<CheckReport> check_tiles(const std::string& where, const CheckOptions& wanted,
                                const Progress& progress) {
  CheckReport report;
  const auto store = open_store(where);
  CheckOptions options = wanted;
  if (options.threads == 0 && store->remote()) options.threads = kRemoteThreads;
  const auto listing =
      check_files(*store, options.first_level, options.last_level, report.findings);
  if (!listing) return std::unexpected(listing.error());
  MeasuredTiles measured;
  const double source_share = options.source ? 0.8 : 0;
  if (options.source) {
    Progress part{[&](double share) { progress.at(share * source_share); }, progress.stop};
    auto result = measure_against_source(*listing, *options.source, options.threads, part);
    if (!result) return std::unexpected(result.error());
    measured = std::move(*result);
  }
  std::size_t total = 0, before = 0;
  for (const auto& level : listing->levels) total += level.size();
  for (std::size_t z = 0; z < listing->levels.size(); ++z) {
    const double unit = (1 - source_share) / double(std::max<std::size_t>(total, 1));
    LevelCheck level(*listing, z, options, options.source ? &measured.tiles : nullptr, report);
    level.run(progress, source_share + unit * double(before),
              unit * double(listing->levels[z].size()));
    before += listing->levels[z].size();
  }
  if (progress.stopped()) return fail(Errc::cancelled, "stopped");
  std::uint64_t posts = 0;
  for (const CheckLevel& level : report.levels) posts += level.posts;
  const bool all_read = !measured.unread && report.findings.total(Severity::unread) == 0;
  if (measured.unread && report.findings.total(Severity::unread) == 0)  // only now
    report.findings.add(rule("tile.unread"), where, "a tile, when it was read once more");
  // Whether posts lie in a tile that could not be read, nobody knows.
  if (options.source && all_read && posts == 0)
    report.findings.add(rule("source.overlap"), where, "no post lies in any tile");
  else if (options.source && all_read)
    find_missing(measured, *options.source, where, report.findings);
  if (!options.source) return report;
  const auto record = store->record();
  if (!record) return std::unexpected(record.error());
  if (!*record) return report;
  auto note = source_note(**record, *options.source, !report.ok(), options.threads,
                          {nullptr, progress.stop});
  if (!note) return std::unexpected(note.error());
  report.source_note = std::move(*note);
  return report;
}

}  // namespace tind
