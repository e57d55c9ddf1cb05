#include "terrain/check/explain.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <set>

#include "proto/json_member.h"
#include "proto/json_text.h"
#include "terrain/check/check_decode.h"
#include "terrain/check/check_surface.h"
#include "terrain/pyramid/plan/line_scale.h"
#include "terrain/shapes/surface_shapes.h"
#include "terrain/surface/height_field.h"
#include "terrain/surface/tile_posts.h"

namespace tind {

namespace {

constexpr double kEnd = 32767;
constexpr std::int64_t kChunkPosts = 1 << 20;
constexpr std::int64_t kLoadPosts = 16 << 20;  // H's window is kept in memory up to this size
constexpr int kFilledCells = 128;              // a side, to see how much of a tile is filled

std::string metres(double x) {
  char text[40];
  std::snprintf(text, sizeof text, "%.6g m", x);
  return text;
}

/// Reads and decodes a tile; why not, when it cannot be.
Result<CheckedTile> decoded(const TileStore& store, TileId id, std::uint64_t* size = nullptr) {
  auto stored = store.look_at(id);
  if (!stored) return std::unexpected(stored.error());
  std::vector<std::uint8_t>& bytes = stored->bytes;
  if (!gunzip(bytes)) return fail(Errc::bad_data, store.tile_name(id) + ": damaged gzip data");
  Findings findings;
  CheckedTile tile;
  bool good = check_decode(bytes, id.text(), tile, findings);
  for (const auto& triangle : tile.triangles)
    for (const std::uint32_t i : triangle) good &= i < tile.u.size();
  if (!good)
    return fail(Errc::bad_data, store.tile_name(id) + " is not a whole tile; tind check says more");
  if (size) *size = bytes.size();
  return tile;
}

// ---- what the set was made with ----

struct MadeWith {
  TileSetOptions options;
  int deepest = -1;
  bool recorded = false;  // by tind build, beside the tiles
  std::string method;     // so recorded
};

Result<MadeWith> made_with(const TileStore& store, double error_factor) {
  MadeWith made;
  made.options.error_factor = error_factor;
  const auto layer = store.layer_json();
  if (!layer) return std::unexpected(layer.error());
  const auto json = json::parse<nlohmann::json>(*layer);
  made.deepest = int(json::whole(json, "maxzoom").value_or(made.deepest));
  const auto read = store.record();
  if (!read) return std::unexpected(read.error());
  const auto& record = *read;
  if (!record) return made;
  made.recorded = true;
  made.method = record->method.empty() ? BoundedOptions::kName : record->method;
  made.options.max_error_m = record->max_error_m;
  if (record->error_factor > 0) made.options.error_factor = record->error_factor;
  // What somebody's server says can be anything.
  if (record->deepest_level >= 0 && record->deepest_level <= tiling::kMaxLevel)
    made.deepest = made.options.max_level = record->deepest_level;
  made.options.side = enum_named<Side>(record->side).value_or(Side::both);
  return made;
}

// ---- vertices ----

bool on_border(const CheckedTile& t, std::size_t i) {
  return t.u[i] == 0 || t.v[i] == 0 || t.u[i] == kEnd || t.v[i] == kEnd;
}

void count_vertices(TileExplanation& story, int lattice_cells) {
  std::set<std::int32_t> lines;
  for (int k = 1; k < lattice_cells; ++k)
    lines.insert(std::int32_t(std::lround(k * kEnd / lattice_cells)));
  for (std::size_t i = 0; i < story.mesh.u.size(); ++i) {
    if (on_border(story.mesh, i))
      ++story.border_vertices;
    else if (lines.contains(story.mesh.u[i]) && lines.contains(story.mesh.v[i]))
      ++story.lattice_vertices;
    else
      ++story.free_vertices;
  }
}

/// Places of an ancestor's vertices.
using Places = std::set<std::pair<std::int32_t, std::int32_t>>;

/// Is there one within half a step of the ancestor's own grid?
bool holds(const Places& places, double u, double v) {
  for (const double x : {std::floor(u), std::ceil(u)})
    for (const double y : {std::floor(v), std::ceil(v)})
      if (std::abs(u - x) <= 0.5 && std::abs(v - y) <= 0.5 &&
          places.contains({std::int32_t(x), std::int32_t(y)}))
        return true;
  return false;
}

/// Walks up as long as the ancestors have a vertex in the same place.
std::vector<std::pair<int, std::size_t>> origins(const TileStore& store, TileId id,
                                                 const CheckedTile& tile) {
  std::vector<std::size_t> left(tile.u.size());
  for (std::size_t i = 0; i < left.size(); ++i) left[i] = i;
  std::vector<std::pair<int, std::size_t>> by_level;
  TileId at = id;
  while (!left.empty()) {
    std::vector<std::size_t> older;
    const auto parent = at.level > 0 ? decoded(store, at.parent()) : fail(Errc::not_found, "");
    if (parent) {
      Places places;
      for (std::size_t i = 0; i < parent->u.size(); ++i) places.emplace(parent->u[i], parent->v[i]);
      const TileId up = at.parent();
      const int down = id.level - up.level;
      const double scale = std::exp2(-down);
      const double x = (id.x - (std::uint64_t(up.x) << down)) * kEnd;
      const double y = (id.y - (std::uint64_t(up.y) << down)) * kEnd;
      for (const std::size_t i : left)
        if (holds(places, (tile.u[i] + x) * scale, (tile.v[i] + y) * scale)) older.push_back(i);
    }
    if (left.size() > older.size()) by_level.emplace_back(at.level, left.size() - older.size());
    left = std::move(older);
    if (at.level == 0) break;
    at = at.parent();
  }
  std::ranges::reverse(by_level);
  return by_level;
}

// ---- posts ----

/// Of one window; see below.
template <class F>
Result<void> each_post_in(const HeightField& field, std::size_t layer, const GeoRect& rect,
                          const PostWindow& w, const Progress& progress, F&& f) {
  const DemSource& source = *field.surface().layers()[layer].source;
  const std::int64_t rows_at_once = std::clamp<std::int64_t>(kChunkPosts / w.cols, 1, w.rows);
  std::vector<Vec2> at;
  std::vector<Geographic> places;
  for (std::int64_t r = 0; r < w.rows; r += rows_at_once) {
    if (progress.stopped()) return fail(Errc::cancelled, "stopped");
    const int rows = int(std::min(rows_at_once, w.rows - r)), cols = int(w.cols);
    const auto heights = source.read(w.col, w.row + r, cols, rows);
    if (!heights) return std::unexpected(heights.error());
    at.clear();
    for (int j = 0; j < rows; ++j)
      for (int i = 0; i < cols; ++i) at.push_back({double(w.col + i), double(w.row + r + j)});
    places.resize(at.size());
    source.to_geographic(at, places);
    std::vector<double> own(heights->values().begin(), heights->values().end()), z = own;
    if (!field.surface().only()) field.raise(layer, places, z);
    for (std::size_t k = 0; k < at.size(); ++k) {
      if (std::isnan(z[k]) && !std::isnan(own[k])) continue;  // replaced
      double lon = places[k].lon;
      while (lon < rect.west - 1e-9) lon += 360;
      while (lon > rect.east + 1e-9) lon -= 360;
      const double u = (lon - rect.west) / rect.width() * kEnd;
      const double v = (places[k].lat - rect.south) / rect.height() * kEnd;
      constexpr double kHair = 1e-6;
      if (!(u >= -kHair && u <= kEnd + kHair && v >= -kHair && v <= kEnd + kHair)) continue;
      f(u, v, z[k], std::int64_t(at[k].x), std::int64_t(at[k].y), Geographic{lon, places[k].lat});
    }
    progress.at(double(r) / double(w.rows));
  }
  if (const auto error = field.error()) return std::unexpected(*error);
  return {};
}

/// Calls f(u, v, height, col, row, place) for each post in the closed rectangle; voids are NaN. Of
/// a layer among others: for those that no higher one replaces, at the height that H has there.
template <class F>
Result<void> each_post(const HeightField& field, std::size_t layer, TileId id,
                       const Progress& progress, F&& f) {
  const DemSource& source = *field.surface().layers()[layer].source;
  const GeoRect rect = tiling::rect(id);
  for (const PostWindow& w : post_windows(source, rect))
    if (auto done = each_post_in(field, layer, rect, w, progress, f); !done) return done;
  return {};
}

Result<std::uint64_t> valid_posts(const DemSource& source, TileId id, const Progress& progress) {
  std::uint64_t valid = 0;
  auto done = each_post(HeightField(source), 0, id, progress,
                        [&](double, double, double z, std::int64_t, std::int64_t, Geographic) {
                          valid += !std::isnan(z);
                        });
  if (!done) return std::unexpected(done.error());
  return valid;
}

/// Of several files the first with a valid post wins: so a file's share is what it adds to those
/// before it.
Result<std::vector<PostStatistics::File>> shares(const ExplainOptions& o, TileId id,
                                                 const SurfaceShapes* shapes,
                                                 const Progress& progress) {
  const auto shaped = [shapes](std::shared_ptr<const DemSource> dem) {
    return shapes ? shaped_dem(std::move(dem), {std::shared_ptr<void>(), shapes}) : dem;
  };
  std::vector<PostStatistics::File> files;
  std::vector<std::string> so_far;
  std::uint64_t before = 0;
  for (const std::string& file : o.files) {
    const auto alone = DemSource::open({&file, 1}, o.dem);
    if (!alone) return std::unexpected(alone.error());
    if (o.files.size() > 1 && post_window(**alone, tiling::rect(id)).empty()) continue;
    so_far.push_back(file);
    const auto together = DemSource::open(so_far, o.dem);
    if (!together) return std::unexpected(together.error());
    const auto posts = valid_posts(*shaped(*together), id, progress);
    if (!posts) return std::unexpected(posts.error());
    if (*posts > before) files.push_back({file, *posts - before});
    before = *posts;
  }
  return files;
}

Result<PostStatistics> posts_of(const Surface& source, const TileExplanation& story,
                                const Progress& progress) {
  PostStatistics p;
  const TileSurface surface(story.mesh);
  std::vector<float> errors;  // for the histogram, whose range is known last
  double squares = 0, sum = 0;
  p.above_m = p.below_m = -HUGE_VAL;
  const auto take = [&](double u, double v, double z, std::int64_t col, std::int64_t row,
                        Geographic place) {
    if (std::isnan(z)) return void(++p.voids);
    ++p.posts;
    const auto gap = surface.gap_at(std::clamp(u, 0.0, kEnd), std::clamp(v, 0.0, kEnd), z);
    if (!gap) return;
    const double error = gap->worst();
    p.above_m = std::max(p.above_m, gap->high);
    p.below_m = std::max(p.below_m, -gap->low);
    sum += std::abs(error);
    squares += error * error;
    p.near_budget += std::abs(error) > 0.9 * story.budget_m;
    errors.push_back(float(error));
    if (p.posts > 1 && std::abs(error) <= p.max_error_m) return;
    p.max_error_m = std::abs(error);
    p.worst = {place, col, row, z, error};
  };
  const HeightField field(source);
  for (std::size_t k = 0; k < source.layers().size(); ++k) {
    const std::uint64_t before = p.posts;
    if (auto done = each_post(field, k, story.id, progress, take); !done)
      return std::unexpected(done.error());
    if (!source.only() && p.posts > before)
      p.files.push_back({source.layers()[k].name, p.posts - before});
  }
  if (!errors.empty()) {
    p.mean_m = sum / double(errors.size());
    p.rms_m = std::sqrt(squares / double(errors.size()));
  }
  for (const float e : errors) {
    const double share = p.max_error_m > 0 ? (double(e) / p.max_error_m + 1) / 2 : 0.5;
    ++p.histogram[std::size_t(
        std::clamp(int(share * PostStatistics::kBins), 0, PostStatistics::kBins - 1))];
  }
  const auto heights = heights_over(source, story.rect, kFilledCells, kFilledCells);
  if (!heights) return std::unexpected(heights.error());
  p.filled_share =
      double(std::ranges::count_if(heights->values(), [](float z) { return std::isnan(z); })) /
      (kFilledCells * kFilledCells);
  return p;
}

// ---- lines ----

double distance_to_line(const Vec2& p, const std::vector<Vec2>& line) {
  double least = HUGE_VAL;
  for (std::size_t i = 1; i < line.size(); ++i) {
    const double dx = line[i].x - line[i - 1].x, dy = line[i].y - line[i - 1].y;
    const double length2 = dx * dx + dy * dy;
    const double along = (p.x - line[i - 1].x) * dx + (p.y - line[i - 1].y) * dy;
    const double t = length2 > 0 ? std::clamp(along / length2, 0.0, 1.0) : 0;
    least = std::min(least, std::hypot(p.x - line[i - 1].x - t * dx, p.y - line[i - 1].y - t * dy));
  }
  return least;
}

/// One piece: its points (units of the grid), those of them that are vertices, and how far the
/// others are from the way along those. A piece without vertices is not in the mesh.
void follow(const ShapePiece& piece, const std::set<std::pair<int, int>>& vertices, double unit_m,
            LineStory& story) {
  std::vector<Vec2> kept;
  const auto end = [&](const ShapePiece::End& at) {
    const Vec2 ends[] = {{0, at.t}, {at.t, 0}, {kEnd, at.t}, {at.t, kEnd}};
    if (at.side >= 0) kept.push_back(ends[at.side]);
  };
  end(piece.from);
  for (const Vec3& p : piece.points)
    if (vertices.contains({int(std::lround(p.x)), int(std::lround(p.y))}))
      kept.push_back({p.x, p.y}), ++story.vertices;
  if (piece.closed && !kept.empty()) kept.push_back(kept.front());
  end(piece.to);
  story.points += piece.points.size();
  if (kept.size() < 2) return;
  for (const Vec3& p : piece.points)
    story.farthest_m = std::max(story.farthest_m, unit_m * distance_to_line({p.x, p.y}, kept));
}

std::optional<LineStory> lines_of(const ShapeLines& lines, const TilePlan& plan,
                                  const TileExplanation& story) {
  constexpr LineScale kAll;
  std::set<std::pair<int, int>> vertices;
  for (std::size_t i = 0; i < story.mesh.u.size(); ++i)
    vertices.emplace(story.mesh.u[i], story.mesh.v[i]);
  const double unit_m = story.rect.height() / kEnd * 111320;
  const LineScale scale = line_scale(plan, story.id.level);
  LineStory told{.tolerance_m = plan.level(story.id.level).line_tolerance * unit_m};
  for (const ShapePiece& piece : lines.pieces(story.rect, kAll)) {
    const bool counts = lines.counts(*piece.chain, scale);
    ++(counts ? told.lines : told.too_small);
    if (counts) follow(piece, vertices, unit_m, told);
  }
  if (told.lines + told.too_small == 0) return {};
  return told;
}

// ---- why ----

void find_limit(TileExplanation& s, double assumed_m, double fit_error_m, int lattice_cells,
                bool recorded) {
  const double stated = s.stated.max_error_m.value_or(s.posts ? s.posts->max_error_m : 0);
  const std::string used = metres(stated) + " of " + metres(s.budget_m);
  if (stated > s.budget_m * (1 + 1e-9)) {
    s.limited_by = "grid";
    s.because = "its error is over its budget (" + used +
                "): the format's integer grid cannot follow the slopes here";
  } else if (s.free_vertices == 0 && s.lattice_vertices > 0) {
    s.limited_by = "curvature";
    s.because = "only the lattice of " + std::to_string(lattice_cells) + " x " +
                std::to_string(lattice_cells) +
                " cells that every tile of this level keeps against the earth's curvature";
  } else if (s.free_vertices == 0) {
    s.limited_by = s.border_vertices > 4 ? "border" : "nothing";
    s.because = s.border_vertices > 4
                    ? "its edges need vertices (neighbours share them), its inside none"
                    : "two triangles are enough: " + used;
  } else if (fit_error_m < 0.999 * s.budget_m && !s.stated.residual_m) {
    s.limited_by = "cap";
    s.because = "clients would take " + metres(s.budget_m) + " at this level; it is fitted to " +
                metres(fit_error_m) + ", so that a globe seen from afar has its mountains";
  } else if (s.deepest && recorded && !s.posts && s.budget_m == assumed_m) {
    s.limited_by = "max-error";
    s.because =
        "the bound at the deepest level, by default 1/32 of the posts' spacing (--source "
        "tells how much that is)";
  } else if (s.budget_m < 0.999 * assumed_m) {
    s.limited_by = "max-error";
    s.because = s.deepest ? "the bound asked for at the deepest level: " + used + " used"
                          : "the bound where a layer ends: " + used + " used";
  } else {
    s.limited_by = "level";
    s.because =
        "what globe clients assume of level " + std::to_string(s.id.level) + ": " + used + " used";
  }
}

}  // namespace

Result<HeightGrid> heights_over(const Surface& surface, const GeoRect& rect, int width,
                                int height) {
  HeightField field(surface);
  const auto windows = surface_windows(surface, rect);
  if (!windows) return std::unexpected(windows.error());
  for (const auto& [layer, w, step, alone] : *windows) {
    if (w.cols * w.rows > kLoadPosts) continue;
    if (auto done = field.load(layer, w.col, w.row, int(w.cols), int(w.rows)); !done)
      return std::unexpected(done.error());
  }
  HeightGrid grid(width, height);
  std::vector<Geographic> places(std::size_t(width), Geographic{});
  std::vector<double> heights(places.size());
  for (int j = 0; j < height; ++j) {
    for (int i = 0; i < width; ++i)
      places[std::size_t(i)] = {rect.west + (i + 0.5) / width * rect.width(),
                                rect.north - (j + 0.5) / height * rect.height()};
    field.at(places, heights);
    for (int i = 0; i < width; ++i) grid.at(i, j) = float(heights[std::size_t(i)]);
  }
  if (field.error()) return std::unexpected(*field.error());
  return grid;
}

Result<TileExplanation> explain_tile(const TileStore& store, TileId id, const ExplainOptions& o,
                                     const Progress& progress) {
  const auto made = made_with(store, o.error_factor);
  if (!made) return std::unexpected(made.error());
  TileExplanation story;
  story.id = id;
  story.rect = tiling::rect(id);
  auto tile = decoded(store, id, &story.bytes);
  if (!tile) return std::unexpected(tile.error());
  story.mesh = std::move(*tile);
  Findings ignored;  // tind check is for those
  story.stated = check_tile(story.mesh, id, made->options.error_factor, ignored);
  story.origins = origins(store, id, story.mesh);
  story.deepest = id.level == made->deepest;
  story.method = made->method;

  const double assumed = assumed_level_error(id.level) * made->options.error_factor;
  story.budget_m = assumed;
  if (story.deepest && made->options.max_error_m > 0)
    story.budget_m = std::min(assumed, made->options.max_error_m);
  double fit_error = story.budget_m;
  int lattice_cells = 1;
  std::optional<Surface> source = o.surface;
  if (!source && !o.files.empty()) {
    auto opened = DemSource::open(o.files, o.dem);
    if (!opened) return std::unexpected(opened.error());
    source.emplace(*opened);
  }
  if (source) {
    // Heights decide neither budgets nor lattices: no need to read them all.
    const HeightRange range{story.mesh.min_height, story.mesh.max_height, 1};
    const auto plan = TilePlan::make(*source, range, made->options);
    if (plan && id.level <= plan->max_level()) {
      const LevelPlan& level = plan->level(id);
      story.budget_m = level.budget_m;
      fit_error = level.fit_error_m;
      lattice_cells = level.curvature_cells;
      if (source->shapes()) story.lines = lines_of(source->shapes()->lines(), *plan, story);
    }
  }
  count_vertices(story, lattice_cells);
  if (source) {
    auto posts = posts_of(*source, story, progress);
    if (!posts) return std::unexpected(posts.error());
    if (source->only()) {
      auto files = shares(o, id, source->shapes(), progress);
      if (!files) return std::unexpected(files.error());
      posts->files = std::move(*files);
    }
    story.posts = std::move(*posts);
  }
  find_limit(story, assumed, fit_error, lattice_cells, made->recorded);
  return story;
}

}  // namespace tind
