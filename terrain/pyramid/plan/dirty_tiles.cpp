// By footprint: the window of posts that a tile reads, in blocks, against the blocks that changed.
// Of a layer that is new or gone, by what it can reach. What else a tile depends on is its plan,
// which is compared as a whole; of layers, which tiles rest on the residual index.

#include "terrain/pyramid/plan/dirty_tiles.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <memory>
#include <set>
#include <utility>

#include "terrain/geo/extent_box.h"
#include "terrain/pyramid/plan/height_steps.h"
#include "terrain/surface/tile_posts.h"
#include "terrain/surface/void_fill.h"

namespace tind {

double bent_m(const Surface& surface) {
  if (surface.only()) return 0;
  double sum = 0;
  for (const SurfaceLayer& layer : surface.layers())
    sum += 1.1 * layer.blend_m + 2.2 * layer.coarsest_m();
  return sum;
}

namespace {

constexpr int kFillReach = VoidFill::kReach + 2;
constexpr int kNormalCells = 512;  // a side of the coarsest lattice that normals are taken from
constexpr double kDegree_m = 111320, kRadian = 0.017453292519943295;

std::int64_t floor_div(std::int64_t a, std::int64_t b) { return a / b - (a % b < 0); }

// --- a layer in its two grids, which begin at the same post
// ---------------------------------------

/// A DEM as if its grid reached as far as it does and as it did: for windows of posts.
class BothGrids : public DemSource {
 public:
  BothGrids(const DemSource& now, const LayerRecord& before) : now_(now), info_(now.info()) {
    info_.cols = std::max(info_.cols, before.cols);
    info_.rows = std::max(info_.rows, before.rows);
    const GeoRect& b = before.bounds;
    info_.bounds = {std::min(info_.bounds.west, b.west), std::min(info_.bounds.south, b.south),
                    std::max(info_.bounds.east, b.east), std::max(info_.bounds.north, b.north)};
  }
  const DemInfo& info() const override { return info_; }
  Result<HeightGrid> read(std::int64_t col, std::int64_t row, int cols, int rows) const override {
    return now_.read(col, row, cols, rows);
  }
  Result<HeightGrid> read_decimated(std::int64_t col, std::int64_t row, int cols, int rows,
                                    int step) const override {
    return now_.read_decimated(col, row, cols, rows, step);
  }
  void to_post(std::span<const Geographic> in, std::span<Vec2> out) const override {
    now_.to_post(in, out);
  }
  void to_geographic(std::span<const Vec2> in, std::span<Geographic> out) const override {
    now_.to_geographic(in, out);
  }
  bool is_plain_geographic() const override { return now_.is_plain_geographic(); }

 private:
  const DemSource& now_;
  DemInfo info_;
};

/// Marks of blocks, and how many there are in a rectangle of them, at once.
class BlockCounts {
 public:
  template <class Marks>  // bool(i, j)
  BlockCounts(const DemInfo& info, int side, Marks&& marked)
      : info_(info),
        side_(side),
        across_((info.cols + side - 1) / side),
        down_((info.rows + side - 1) / side) {
    sums_.resize(std::size_t((across_ + 1) * (down_ + 1)));
    for (std::int64_t j = 0; j < down_; ++j)
      for (std::int64_t i = 0; i < across_; ++i)
        at(i + 1, j + 1) = marked(i, j) + at(i, j + 1) + at(i + 1, j) - at(i, j);
  }

  std::int64_t total() const { return sums_.back(); }

  /// Is there a marked block that has posts of the window? Windows may lie outside, wholly too.
  bool any(PostWindow w) const {
    if (w.empty()) return false;
    if (!info_.wraps_longitude) return any_in(w.col, w.cols, w);
    const std::int64_t period = std::llround(info_.period_cols);
    if (w.cols >= period) return any_in(0, info_.cols, w);
    const std::int64_t col = w.col - floor_div(w.col, period) * period;
    return any_in(col, w.cols, w) || any_in(col - period, w.cols, w);
  }

 private:
  const DemInfo& info_;
  std::int64_t side_, across_, down_;
  std::vector<std::int64_t> sums_;  // of all blocks to the north-west

  std::int64_t& at(std::int64_t i, std::int64_t j) {
    return sums_[std::size_t(j * (across_ + 1) + i)];
  }
  bool any_in(std::int64_t col, std::int64_t cols, const PostWindow& w) const {
    const auto block = [&](std::int64_t post, std::int64_t end) {
      return std::clamp<std::int64_t>(floor_div(post, side_), 0, end);
    };
    if (col + cols <= 0 || w.row + w.rows <= 0 || col >= info_.cols || w.row >= info_.rows)
      return false;
    const std::int64_t i0 = block(col, across_ - 1), i1 = block(col + cols - 1, across_ - 1) + 1;
    const std::int64_t j0 = block(w.row, down_ - 1), j1 = block(w.row + w.rows - 1, down_ - 1) + 1;
    const auto sum = [&](std::int64_t i, std::int64_t j) {
      return sums_[std::size_t(j * (across_ + 1) + i)];
    };
    return sum(i1, j1) - sum(i0, j1) - sum(i1, j0) + sum(i0, j0) > 0;
  }
};

PostWindow grown(PostWindow w, std::int64_t posts) {
  w.col -= posts, w.cols += 2 * posts;
  w.row -= posts, w.rows += 2 * posts;
  return w;
}

/// Has a block changed that can say what stands beyond the source's ends near the window?
bool changed_beyond(const BlockCounts& changed, const PostWindow& posts, const DemInfo& info) {
  const PostWindow around = grown(posts, 1), reach = grown(posts, kFillReach);
  const auto strip = [&](std::int64_t col, std::int64_t row, std::int64_t cols, std::int64_t rows) {
    PostWindow w;
    w.col = std::max(col, reach.col), w.row = std::max(row, reach.row);
    w.cols = std::min(col + cols, reach.col + reach.cols) - w.col;
    w.rows = std::min(row + rows, reach.row + reach.rows) - w.row;
    return changed.any(w);
  };
  // All columns of a source that goes around the globe are inside.
  const std::int64_t first = info.wraps_longitude ? reach.col : 0;
  const std::int64_t cols = info.wraps_longitude ? reach.cols : info.cols;
  return (around.row < 0 && strip(first, 0, cols, kFillReach)) ||
         (around.row + around.rows > info.rows &&
          strip(first, info.rows - kFillReach, cols, kFillReach)) ||
         (!info.wraps_longitude && ((around.col < 0 && strip(0, 0, kFillReach, info.rows)) ||
                                    (around.col + around.cols > info.cols &&
                                     strip(info.cols - kFillReach, 0, kFillReach, info.rows))));
}

/// Of a layer in both surfaces: which blocks are not as they were, and which have voids that those
/// can fill.
struct ChangedBlocks {
  BlockCounts changed, filled;

  ChangedBlocks(const DemInfo& both, const SourceBlocks& before, const SourceBlocks& after)
      : changed(both, after.side(),
                [&](std::int64_t i, std::int64_t j) {
                  return after.differs(i, j, before) || ends(i, j, before, after);
                }),
        filled(both, after.side(), [&](std::int64_t i, std::int64_t j) {
          const auto has_void = [&](const SourceBlocks& b) {
            return i >= b.across() || j >= b.down() || b.has_void(i, j);
          };
          if (!has_void(before) && !has_void(after)) return false;
          const std::int64_t side = after.side();
          const PostWindow block{.col = i * side, .row = j * side, .cols = side, .rows = side};
          return changed.any(grown(block, kFillReach));
        }) {}

 private:
  /// Does a grid end at this block where the other goes on? The outermost posts count on for half
  /// a spacing where nothing follows.
  static bool ends(std::int64_t i, std::int64_t j, const SourceBlocks& before,
                   const SourceBlocks& after) {
    const std::int64_t side = after.side();
    const auto at = [&](std::int64_t block, std::int64_t a, std::int64_t b) {
      return a != b && block == (std::min(a, b) - 1) / side;
    };
    return (at(i, before.cols(), after.cols()) || at(j, before.rows(), after.rows())) &&
           !(before.all_void(i, j) && after.all_void(i, j));
  }
};

/// Posts of the source in a metre, at most: those of longitudes lie closer away from the equator
/// than in the middle.
double posts_per_metre(const DemInfo& info) {
  const auto cosine = [](double lat) { return std::cos(std::min(std::abs(lat), 89.0) * kRadian); };
  const double middle = cosine((info.bounds.south + info.bounds.north) / 2);
  const double least = std::min(cosine(info.bounds.south), cosine(info.bounds.north));
  const double shrunk = info.crs_kind == CrsKind::geographic ? least / middle : 1;
  return 1 / std::min({info.spacing_x_m * shrunk, info.spacing_x_m, info.spacing_y_m});
}

double margin_m(const MadeOf& made) {
  double coarsest = 0;
  for (const SurfaceLayer& layer : made.surface.layers())
    coarsest = std::max(coarsest, layer.coarsest_m());
  return made.surface.only() ? 0 : 5 * coarsest;
}

/// What marks share.
struct Marking {
  const MadeOf &before, &after;
  const TileOrder& ids;
  double bent_m;
  double margin_m;  // the posts that a window has more than a tile, of the coarsest layer
  std::vector<std::uint8_t>& dirty;
};

bool meet(const GeoRect& a, const GeoRect& b) {
  if (a.south > b.north || b.south > a.north) return false;
  return std::ranges::any_of(std::array{0.0, 360.0, -360.0}, [&](double turn) {
    return a.west + turn <= b.east && b.west <= a.east + turn;
  });
}

/// Where a tile looks whether a layer above could have a say in its posts: around the window of the
/// posts that it reads, and a tenth of it more (tile_posts.cpp).
GeoRect looked_at(const Marking& m, const GeoRect& rect) {
  const double lon = 0.2 * rect.width(), lat = 0.2 * rect.height();
  return grown(GeoRect{rect.west - lon, rect.south - lat, rect.east + lon, rect.north + lat},
               m.margin_m);
}

/// The extents that only one of two records of a layer has, with what is near them.
std::vector<GeoRect> other_extents(const LayerRecord& a, const LayerRecord& b, double near_m) {
  std::vector<GeoRect> others;
  const auto add = [&](const LayerRecord& from, const LayerRecord& in) {
    for (const GeoRect& r : from.extents)
      if (std::ranges::find(in.extents, r) == in.extents.end()) others.push_back(grown(r, near_m));
  };
  add(a, b);
  add(b, a);
  return others;
}

/// Can what lies near a tile of a level decide on the steps of its heights, before or after? Then
/// so can what lies near the eight around it.
bool steps_by_posts(const Marking& m, int level) {
  return std::ranges::any_of(std::array{&m.before.plan, &m.after.plan}, [&](const TilePlan* plan) {
    return plan->local_steps() && level <= plan->max_level() &&
           plan->step_of_all(level) != plan->level(level).border_step_m;
  });
}

/// Has a post changed that can? Those of children that are missing are the next level's.
bool other_steps(const Marking& m, const DemSource& source, const BlockCounts& changed, TileId id) {
  if (!steps_by_posts(m, id.level) && !steps_by_posts(m, id.level + 1)) return false;
  const GeoRect r = tiling::rect(id);
  const GeoRect around{r.west - r.width(), std::max(-90.0, r.south - r.height()),
                       r.east + r.width(), std::min(90.0, r.north + r.height())};
  const auto any = [&](const PostWindow& posts) { return changed.any(posts); };
  const auto posts = post_windows(source, around);
  if (posts.empty()) return std::ranges::any_of(windows_beside(source, around, kStepReach), any);
  return std::ranges::any_of(posts, any, [](const PostWindow& w) { return grown(w, kStepReach); });
}

/// Marks the tiles that depend on what changed of layer j, which was layer i.
void mark_changed(const Marking& m, std::size_t i, std::size_t j) {
  const LayerRecord& was = m.before.layers[i];
  const BothGrids source(*m.after.surface.layers()[j].source, was);
  const DemInfo& info = source.info();
  const SourceBlocks &old = m.before.blocks.layers()[i], &now = m.after.blocks.layers()[j];
  const ChangedBlocks blocks(info, old, now);
  const auto& [changed, filled] = blocks;
  const bool same_ends = old.cols() == now.cols() && old.rows() == now.rows();
  const SurfaceLayer& layer = m.after.surface.layers()[j];
  const std::vector<GeoRect> others =
      other_extents(was, m.after.layers[j], 1.2 * layer.blend_m + 4 * layer.coarsest_m());
  if (changed.total() == 0 && same_ends && others.empty()) return;
  const double per_metre = posts_per_metre(info);
  // Where layers end, what fills voids of one is bent to another.
  const double farther = m.after.surface.only() ? 0 : m.bent_m * per_metre + kFillReach;
  for (std::size_t k = 0; k < m.ids.size(); ++k) {
    if (m.dirty[k]) continue;
    const TileId id = m.ids[k];
    const GeoRect rect = tiling::rect(id);
    const auto windows = post_windows(source, rect);
    const bool indexed = id.level < m.after.plan.index_depth().level();
    // Normals from the index need the nodes around, and what fills voids there.
    const double degrees = m.after.plan.level(id.level).normal_reach_deg +
                           (indexed ? tiling::tile_degrees(id.level) / kNormalCells : 0);
    const double reach = degrees * kDegree_m * per_metre + (indexed ? kFillReach : 0) + farther;
    const std::int64_t around = 2 + std::int64_t(std::ceil(reach));
    // How many of its posts a tile skips goes by its window, which ends where the grid does.
    const std::int64_t cols = std::min(old.cols(), now.cols()),
                       rows = std::min(old.rows(), now.rows());
    const auto goes_on = [&](const PostWindow& posts) {
      return (old.cols() != now.cols() && posts.col + posts.cols > cols) ||
             (old.rows() != now.rows() && posts.row + posts.rows > rows);
    };
    if (!same_ends && std::ranges::any_of(windows, goes_on) &&
        (m.before.surface.reaches(i, rect) || m.after.surface.reaches(j, rect)))
      m.dirty[k] = true;
    m.dirty[k] |=
        std::ranges::any_of(others, [&](const GeoRect& r) { return meet(looked_at(m, rect), r); });
    m.dirty[k] |= other_steps(m, source, changed, id);
    const bool wide = indexed || farther > 0;
    for (const PostWindow& posts : windows) {
      const PostWindow near = grown(posts, around), &filled_in = wide ? near : posts;
      m.dirty[k] |=
          changed.any(near) || filled.any(filled_in) || changed_beyond(changed, filled_in, info);
    }
    if (!windows.empty()) continue;
    for (const PostWindow& beside :
         windows_beside(source, rect, std::max<std::int64_t>(2 * kFillReach, around)))
      m.dirty[k] |= changed.any(beside);
  }
}

// --- layers that were not there, or are there no more
// ---------------------------------------------

/// Marks the tiles in which layer k of one of the surfaces can have a say.
void mark_reached(const Marking& m, const MadeOf& made, std::size_t k) {
  const LayerRecord& layer = made.layers[k];
  std::vector<GeoRect> extents = layer.extents;
  if (extents.empty()) extents.push_back(layer.bounds);
  const double fills =
      (kFillReach + 2) * 1.1 * std::max(layer.spacing_x_m, layer.spacing_y_m) + m.bent_m;
  std::vector<std::vector<GeoRect>> reached;  // by level
  for (std::size_t n = 0; n < m.ids.size(); ++n) {
    if (m.dirty[n]) continue;
    const int z = m.ids[n].level;
    if (reached.size() <= std::size_t(z)) reached.resize(std::size_t(z) + 1);
    auto& rects = reached[std::size_t(z)];
    if (rects.empty())
      for (const GeoRect& r : extents)
        rects.push_back(grown(r, fills + m.after.plan.level(z).normal_reach_deg * kDegree_m));
    const GeoRect tile = looked_at(m, tiling::rect(m.ids[n]));
    m.dirty[n] = std::ranges::any_of(rects, [&](const GeoRect& r) { return meet(tile, r); });
  }
}

// --- layers that have a residual index
// ----------------------------------------------------------

/// Marks the tiles that rest on the index now and did not, or the other way, those above them, and
/// those beside these, whose normals at their edges are as theirs.
void mark_other_depth(const Marking& m) {
  const auto before = m.before.plan.index_depth().tiles(),
             after = m.after.plan.index_depth().tiles();
  std::vector<TileId> other;
  std::ranges::set_symmetric_difference(before, after, std::back_inserter(other));
  std::set<TileId> reached;
  for (TileId id : other)
    for (; id.level >= 0 && reached.insert(id).second; id = id.parent()) {
    }
  for (std::size_t n = 0; n < m.ids.size(); ++n) {
    if (m.dirty[n]) continue;
    const TileId id = m.ids[n];
    const std::uint32_t columns = tiling::columns(id.level);
    for (int part = 0; part < 9; ++part)
      m.dirty[n] |= reached.contains(
          {id.level, (id.x + columns + std::uint32_t(part % 3) - 1) % columns,
           id.y + std::uint32_t(part / 3) - 1});  // a row beyond a pole is no tile's
  }
}

// --- plans
// ----------------------------------------------------------------------------------------

bool same_of_level(const TilePlan& a, const TilePlan& b, int z) {
  return z <= std::min(a.max_level(), b.max_level()) && a.level(z) == b.level(z) &&
         (z < a.max_level()) == (z < b.max_level());
}

bool same_of_tile(const TilePlan& a, const TilePlan& b, TileId id) {
  if (a.available(id) != b.available(id)) return false;
  if (!a.available(id)) return true;
  if (a.level(id) != b.level(id) || a.local_steps() != b.local_steps()) return false;
  if (a.local_steps() && a.rests_on_all_heights(id) &&
      a.step_of_all(id.level) != b.step_of_all(id.level))
    return false;
  for (const TileSide side : {TileSide::west, TileSide::south, TileSide::east, TileSide::north})
    if (a.level(id, side) != b.level(id, side)) return false;
  return true;
}

bool same_range(const HeightRange& a, const HeightRange& b) {
  return a.min_m == b.min_m && a.max_m == b.max_m && a.of_levels == b.of_levels;
}

/// Do two plans say the same of a tile, of the sides that it shares, and of its children, for which
/// it stands in where they are missing?
bool same_plan(const TilePlan& a, const TilePlan& b, TileId id) {
  if (!same_of_level(a, b, id.level) || !a.available(id) || !same_of_tile(a, b, id)) return false;
  if (a.descendants(id) != b.descendants(id)) return false;
  if (id.level >= a.max_level()) return true;
  if (!same_of_level(a, b, id.level + 1)) return false;
  for (int part = 0; part < 4; ++part)
    if (!same_of_tile(a, b, id.child(part % 2, part / 2))) return false;
  return true;
}

// --- which layer is which
// -------------------------------------------------------------------------

bool same_layer(const MadeOf& a, std::size_t i, const MadeOf& b, std::size_t j) {
  const SurfaceLayer &p = a.surface.layers()[i], &q = b.surface.layers()[j];
  return a.layers[i].same_lattice(b.layers[j]) && p.blend_m == q.blend_m &&
         p.spacing_m.x == q.spacing_m.x && p.spacing_m.y == q.spacing_m.y &&
         a.blocks.layers()[i].side() == b.blocks.layers()[j].side();
}

/// The layer of `a` that is layer j of `b` but for its blend; none: the end of `a`'s.
std::size_t with_another_blend(const MadeOf& a, const MadeOf& b, std::size_t j) {
  const auto same = [&](const LayerRecord& r) {
    return r.same_lattice(b.layers[j]) && r.blend_m != b.layers[j].blend_m;
  };
  return std::size_t(std::ranges::find_if(a.layers, same) - a.layers.begin());
}

/// As many pairs as there are in the same order.
std::vector<std::pair<std::size_t, std::size_t>> pairs_of(const MadeOf& a, const MadeOf& b) {
  const std::size_t n = a.layers.size(), m = b.layers.size();
  std::vector<std::vector<std::size_t>> most(n + 1, std::vector<std::size_t>(m + 1));
  for (std::size_t i = n; i-- > 0;)
    for (std::size_t j = m; j-- > 0;)
      most[i][j] = same_layer(a, i, b, j) ? most[i + 1][j + 1] + 1
                                          : std::max(most[i + 1][j], most[i][j + 1]);
  std::vector<std::pair<std::size_t, std::size_t>> pairs;
  for (std::size_t i = 0, j = 0; i < n && j < m;) {
    if (same_layer(a, i, b, j))
      pairs.emplace_back(i++, j++);
    else
      ++(most[i + 1][j] >= most[i][j + 1] ? i : j);
  }
  return pairs;
}

/// Why every tile may be another one; empty where that is not so.
std::string changes_everything(const MadeOf& before, const MadeOf& after, bool same_grids,
                               std::size_t pairs) {
  if ((before.surface.only() != nullptr) != (after.surface.only() != nullptr))
    return "tiles of layers are made otherwise than those of one DEM";
  if (pairs == 0 && before.layers.size() == after.layers.size() &&
      with_another_blend(before, after, 0) == 0)
    return "layers blend otherwise";
  if (pairs == 0) return "the grid begins elsewhere, or its posts are rounded to another spacing";
  if (before.surface.info().rounding_m != after.surface.info().rounding_m)
    return "heights are stored less exactly, or more, than they were";
  if (before.surface.is_plain_geographic() != after.surface.is_plain_geographic())
    return "posts that are placed by a projection are there for the first time, or no more";
  if (after.surface.only() && before.plan.index_depth().level() != after.plan.index_depth().level())
    return "the residual index serves other levels";
  if (!same_grids && after.surface.shapes())
    return "lines and water are laid out by the extent of the posts";
  return {};
}

}  // namespace

DirtyTiles dirty_tiles(const MadeOf& before, const MadeOf& after, const TileOrder& ids) {
  DirtyTiles found;
  found.flags.resize(ids.size());
  const auto pairs = pairs_of(before, after);
  bool same_errors = true;
  for (const auto& [i, j] : pairs)
    same_errors = same_errors && before.layers[i].max_error_m == after.layers[j].max_error_m;
  const bool same_grids =
      pairs.size() == before.layers.size() && pairs.size() == after.layers.size() &&
      std::ranges::all_of(pairs, [&](const auto& pair) {
        const LayerRecord &a = before.layers[pair.first], &b = after.layers[pair.second];
        return a.cols == b.cols && a.rows == b.rows && a.extents == b.extents;
      });
  found.everything = changes_everything(before, after, same_grids, pairs.size());
  if (!found.everything.empty()) {
    std::ranges::fill(found.flags, 1);
    return found;
  }
  const Marking marking{before,
                        after,
                        ids,
                        std::max(bent_m(before.surface), bent_m(after.surface)),
                        std::max(margin_m(before), margin_m(after)),
                        found.flags};
  std::vector<bool> kept(before.layers.size()), known(after.layers.size());
  for (const auto& [i, j] : pairs) kept[i] = known[j] = true;
  // A plan is a function of grids, bounds of errors, the range of heights and the options.
  if (!same_grids || !same_errors || !same_range(before.plan.range(), after.plan.range()))
    for (std::size_t k = 0; k < ids.size(); ++k)
      found.flags[k] = !same_plan(before.plan, after.plan, ids[k]);
  mark_other_depth(marking);  // after what sets all flags
  for (std::size_t i = 0; i < kept.size(); ++i)
    if (!kept[i]) mark_reached(marking, before, i);
  for (std::size_t j = 0; j < known.size(); ++j) {
    if (known[j]) continue;
    mark_reached(marking, after, j);
    const std::size_t was = with_another_blend(before, after, j);
    const bool bent = was < kept.size() && !kept[was];
    if (bent) kept[was] = true;
    (bent ? found.bent_layers : found.new_layers).push_back(j);
  }
  found.gone_layers = std::size_t(std::ranges::count(kept, false));
  for (const auto& [i, j] : pairs) mark_changed(marking, i, j);
  return found;
}

}  // namespace tind
