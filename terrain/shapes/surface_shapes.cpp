// Files -> polygons and lines on the globe -> one repaired network -> levels -> shores. What
// becomes an edge of tiles is the outline of what is level as a whole: where two polygons of one
// level meet, there is none.

#include "terrain/shapes/surface_shapes.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <map>
#include <numeric>

#include "terrain/base/hash.h"
#include "terrain/base/median.h"
#include "terrain/raster/gdal/vectors/line_datum.h"
#include "terrain/raster/raster_content.h"
#include "terrain/shapes/post_areas.h"

namespace tind {

namespace {

using Index = std::uint32_t;
using Layers = std::span<const std::shared_ptr<const DemSource>>;
constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
constexpr double kMostPosts = 1 << 24;  // that a level is the median of
constexpr double kMostLevel = 16384;    // metres, as of DEMs that are converted
constexpr std::int64_t kPostsAtOnce = 1 << 20;

/// Calls f(height, lon, lat) for the valid posts of a part of a DEM.
template <class F>
Result<void> each_post(const DemSource& source, const PostRect& rect, F&& f) {
  const double cols = double(rect.last_col - rect.col + 1);
  const double rows = double(rect.last_row - rect.row + 1);
  std::int64_t step = 1;
  while (cols / double(step) * (rows / double(step)) > kMostPosts) step *= 2;
  const std::int64_t col = (rect.col + step - 1) / step * step;
  const std::int64_t at_once = std::max<std::int64_t>(1, kPostsAtOnce / (rect.last_col - col + 1));
  for (std::int64_t row = (rect.row + step - 1) / step * step; row <= rect.last_row;
       row += at_once * step) {
    const int n = int(std::min(at_once, (rect.last_row - row) / step + 1));
    const int m = int((rect.last_col - col) / step + 1);
    if (m <= 0) return {};
    const auto posts =
        step == 1 ? source.read(col, row, m, n) : source.read_decimated(col, row, m, n, int(step));
    if (!posts) return std::unexpected(posts.error());
    each_post_place(source, col, row, m, n, int(step), [&](std::size_t k, double lon, double lat) {
      if (const float z = posts->values()[k]; !std::isnan(z)) f(z, lon, lat);
    });
  }
  return {};
}

std::vector<AreaSet::Edge> edges_of(const std::vector<GlobePolygon>& polygons) {
  std::vector<AreaSet::Edge> edges;
  for (Index k = 0; k < polygons.size(); ++k)
    for (const GlobeLine& ring : polygons[k].rings) {
      double west = HUGE_VAL, east = -HUGE_VAL;
      for (const Vec3& p : ring) west = std::min(west, p.x), east = std::max(east, p.x);
      for (const double turn : {0.0, 360.0, -360.0}) {
        if (west + turn > 180 || east + turn < -180) continue;
        for (std::size_t i = 0; i < ring.size(); ++i) {
          const Vec3 &a = ring[i], &b = ring[(i + 1) % ring.size()];
          edges.push_back({{a.x + turn, a.y}, {b.x + turn, b.y}, k});
        }
      }
    }
  return edges;
}

/// Stands for a raster wherever its file lies: what its posts are and where. Of more posts than a
/// daemon may read at its start: which file it is.
Result<std::string> content_of(const DemSource& dem) {
  constexpr std::int64_t kMostRead = std::int64_t(1) << 25;
  constexpr int kSide = 1024;
  const DemInfo& info = dem.info();
  if (info.cols > kMostRead / info.rows) return info.fingerprint;
  const Affine& a = info.post_to_crs;
  std::string text =
      fmt::format("{} {} {} {} {} {} {} {} {} {}\n", info.cols, info.rows, a.x0, a.x_col, a.x_row,
                  a.y0, a.y_col, a.y_row, info.crs_wkt, info.crs_way);
  for (std::int64_t row = 0; row < info.rows; row += kSide)
    for (std::int64_t col = 0; col < info.cols; col += kSide) {
      const auto posts = dem.read(col, row, int(std::min<std::int64_t>(kSide, info.cols - col)),
                                  int(std::min<std::int64_t>(kSide, info.rows - row)));
      if (!posts) return std::unexpected(posts.error());
      const auto values = posts->values();
      text += hash128({reinterpret_cast<const char*>(values.data()), values.size() * sizeof(float)})
                  .text();
    }
  return hash128(text).text();
}

}  // namespace

class ShapesBuilder {
 public:
  ShapesBuilder(Layers layers, const ShapeFiles& files) : layers_(layers) { out_.files_ = files; }

  Result<std::shared_ptr<const SurfaceShapes>> build() {
    if (layers_.front()->info().crs_kind == CrsKind::none)
      return fail(Errc::unsupported, layers_.front()->info().files.front() +
                                         " has no coordinate reference system, so nobody knows "
                                         "where the lines lie in it");
    if (auto done = read_files(); !done) return std::unexpected(done.error());
    if (!flatten_.empty() || !breaklines_.empty())
      if (auto done = build_lines(); !done) return std::unexpected(done.error());
    out_.digest_ = hash128(digest_text_).text();
    return std::shared_ptr<const SurfaceShapes>(new SurfaceShapes(std::move(out_)));
  }

 private:
  Layers layers_;
  SurfaceShapes out_;
  std::vector<GlobePolygon> flatten_;
  std::vector<GlobeLine> breaklines_;
  std::string digest_text_ = "epoch " + std::to_string(kShapeEpoch) + "\n";
  ShapeNetwork net_;

  // --- files -----------------------------------------------------------------------------------

  const DemInfo& info() const { return layers_.front()->info(); }

  void note(const char* role, const GlobeLine& line) {
    digest_text_ += role;
    digest_text_.append(reinterpret_cast<const char*>(line.data()), line.size() * sizeof(Vec3));
    if (digest_text_.size() > 1 << 20) digest_text_ = hash128(digest_text_).text();
  }

  /// Where posts are, and so far around that nothing else can show in what fills voids.
  GeoRect area() const {
    GeoRect all{HUGE_VAL, HUGE_VAL, -HUGE_VAL, -HUGE_VAL};
    double spacing = 0;
    for (const auto& layer : layers_) {
      const GeoRect& b = layer->info().bounds;
      all = {std::min(all.west, b.west), std::min(all.south, b.south), std::max(all.east, b.east),
             std::max(all.north, b.north)};
      spacing = std::max({spacing, layer->info().spacing_x_m, layer->info().spacing_y_m});
    }
    const double margin = 70 * spacing / 111320, lat = std::max(std::abs(all.south), all.north);
    const double wide = margin / std::max(0.05, std::cos(std::min(lat, 89.0) * 0.0174533));
    return {std::max(all.west - wide, -200.0), std::max(all.south - margin, -90.0),
            std::min(all.east + wide, 200.0), std::min(all.north + margin, 90.0)};
  }

  Result<VectorShapes> read(const std::string& path, const char* what) {
    auto read = read_vectors_on_globe(path, info());
    if (!read) return std::unexpected(read.error());
    out_.states_.push_back(std::move(read->files));
    const GeoRect all = area();
    const auto meets = [&](const GlobeLine& line) {
      GeoRect box{HUGE_VAL, HUGE_VAL, -HUGE_VAL, -HUGE_VAL};
      for (const Vec3& p : line) {
        if (std::isnan(p.x + p.y)) continue;
        box = {std::min(box.west, p.x), std::min(box.south, p.y), std::max(box.east, p.x),
               std::max(box.north, p.y)};
      }
      if (!(box.south <= all.north && box.north >= all.south)) return false;
      return std::ranges::any_of(std::array{0.0, 360.0, -360.0}, [&](double turn) {
        return box.west + turn <= all.east && box.east + turn >= all.west;
      });
    };
    const bool any = std::ranges::any_of(read->lines, meets) ||
                     std::ranges::any_of(read->polygons, [&](const GlobePolygon& p) {
                       return std::ranges::any_of(p.rings, meets);
                     });
    if (!any)
      return fail(Errc::bad_data, path + ": nothing in it lies on the DEM (" + what +
                                      "); is its CRS the right one?");
    return read;
  }

  /// The DEM whose datum is known, as far as there is one: two known ones are no surface.
  const DemInfo& info_of_datum() const {
    const auto known = [](const auto& layer) {
      return layer->info().datum != VerticalDatum::unknown;
    };
    const auto found = std::ranges::find_if(layers_, known);
    return found == layers_.end() ? info() : (*found)->info();
  }

  /// What becomes an edge, or level, with its own heights.
  Result<VectorShapes> read_with_heights(const std::string& path, const char* what) {
    auto read = this->read(path, what);
    if (!read || out_.files_.dem_heights) return read;
    const auto doubts = compare_datums(path, read->stated, info_of_datum());
    if (!doubts) return std::unexpected(doubts.error());
    std::ranges::copy(*doubts, std::back_inserter(out_.report_.warnings));
    return read;
  }

  Result<void> add_polygons(const std::string& path, const char* what,
                            std::vector<GlobePolygon>& into) {
    auto read = &into == &flatten_ ? read_with_heights(path, what) : this->read(path, what);
    if (!read) return std::unexpected(read.error());
    if (read->polygons.empty())
      return fail(Errc::bad_data, path + ": has lines only; polygons are needed for " + what);
    if (!read->lines.empty())
      out_.report_.warnings.push_back(fmt::format("{}: {} lines are left out; {} takes polygons",
                                                  path, read->lines.size(), what));
    for (GlobePolygon& polygon : read->polygons) {
      for (GlobeLine& ring : polygon.rings) {
        drop_heights(ring);
        note(what, ring);
      }
      into.push_back(std::move(polygon));
    }
    return {};
  }

  void drop_heights(GlobeLine& line) const {
    if (out_.files_.dem_heights)
      for (Vec3& p : line) p.z = kNone;
  }

  Result<void> add_breaklines(const std::string& path) {
    auto read = read_with_heights(path, "breaklines");
    if (!read) return std::unexpected(read.error());
    for (GlobePolygon& polygon : read->polygons)
      for (GlobeLine& ring : polygon.rings) {
        if (!ring.empty() && ring.front() != ring.back()) ring.push_back(ring.front());
        read->lines.push_back(std::move(ring));
      }
    for (GlobeLine& line : read->lines) {
      drop_heights(line);
      for (const Vec3& p : line)
        if (std::abs(p.z) > kMostLevel) return fail(path, not_of_the_earth(p.z));
      note("breaklines", line);
      breaklines_.push_back(std::move(line));
    }
    return {};
  }

  /// Does it meet the DEM anywhere, whatever turn its longitudes are of?
  bool reaches(const GeoRect& b) const {
    for (const auto& layer : layers_) {
      const GeoRect& own = layer->info().bounds;
      if (!(b.south <= own.north && own.south <= b.north)) continue;
      for (const double turn : {-360., 0., 360.})
        if (b.west + turn <= own.east && own.west <= b.east + turn) return true;
    }
    return false;
  }

  /// A vector file, or a raster.
  Result<void> add_water(const std::string& path, std::vector<GlobePolygon>& polygons) {
    auto read = add_polygons(path, "water", polygons);
    if (read || read.error().code == Errc::not_found) return read;
    DemOptions options;
    const std::string files[] = {path};
    auto raster = DemSource::open(files, options);
    if (!raster) return is_raster(path) ? std::unexpected(raster.error()) : read;
    if ((*raster)->info().crs_kind == CrsKind::none)
      return fail(Errc::bad_data, path + ": a raster without CRS cannot say where water is");
    if (!reaches((*raster)->info().bounds))
      return fail(Errc::bad_data,
                  path + ": nothing in it lies on the DEM (water); is its CRS the right one?");
    const auto content = content_of(**raster);
    if (!content) return fail(path, content.error());
    digest_text_ += "water raster " + *content;
    out_.water_.rasters.push_back(std::move(*raster));
    return {};
  }

  Result<void> read_files() {
    const ShapeFiles& files = out_.files_;
    for (const std::string& path : files.breaklines)
      if (auto ok = add_breaklines(path); !ok) return ok;
    for (const std::string& path : files.flatten)
      if (auto ok = add_polygons(path, "flatten", flatten_); !ok) return ok;
    std::vector<GlobePolygon> boundary, water;
    for (const std::string& path : files.boundary)
      if (auto ok = add_polygons(path, "boundary", boundary); !ok) return ok;
    for (const std::string& path : files.water)
      if (auto ok = add_water(path, water); !ok) return ok;
    out_.boundary_ = AreaSet(edges_of(boundary));
    out_.water_.areas = AreaSet(edges_of(water));
    ShapesReport& r = out_.report_;
    r.breaklines = breaklines_.size(), r.flattened = flatten_.size();
    r.boundaries = boundary.size(), r.waters = water.size() + out_.water_.rasters.size();
    return {};
  }

  // --- levels ----------------------------------------------------------------------------------

  Result<void> build_lines() {
    double spacing = HUGE_VAL;
    for (const auto& layer : layers_)
      spacing = std::min({spacing, layer->info().spacing_x_m, layer->info().spacing_y_m});
    auto net = shape_network(GlobeLattice::make(area(), spacing / 111320), flatten_, breaklines_);
    if (!net) return std::unexpected(net.error());
    net_ = std::move(*net);
    out_.report_.repairs = net_.repairs;
    out_.report_.not_finite = net_.not_finite;
    std::vector<AreaSet::Edge> edges;
    for (const ShapeEdge& e : net_.edges)
      for (const Index polygon : e.polygons) edges.push_back({place(e.a), place(e.b), polygon});
    out_.level_areas_ = AreaSet(std::move(edges));
    if (auto done = find_levels(); !done) return done;
    return make_chains();
  }

  Vec2 place(Index point) const { return {net_.points[point].x, net_.points[point].y}; }

  /// Polygons that touch are joined already; those that lie in one another are here.
  void join_nested() {
    std::vector<Index> holding;
    std::vector<bool> asked(out_.level_areas_.polygons(), false);
    for (const ShapeEdge& e : net_.edges)
      for (const Index polygon : e.polygons) {
        if (asked[polygon]) continue;
        asked[polygon] = true;
        out_.level_areas_.all_holding(net_.points[e.a].x, net_.points[e.a].y, holding);
        for (const Index other : holding) join(other, polygon);
      }
  }
  Index root(Index p) {
    auto& touching = net_.touching;
    while (touching[p] != p) p = touching[p] = touching[touching[p]];
    return p;
  }
  void join(Index p, Index q) {
    p = root(p), q = root(q);
    net_.touching[std::max(p, q)] = std::min(p, q);
  }

  static Error not_of_the_earth(double own_height_m) {
    return {Errc::invalid_argument,
            fmt::format("its own height, {:g} m, is none of the earth (at most {:g} m up or "
                        "down); --line-heights dem takes the DEM's",
                        own_height_m, kMostLevel)};
  }

  Result<double> own_level(Index polygon) {
    if (std::vector<double> heights = own_heights(flatten_[polygon]); !heights.empty()) {
      const auto [least, most] = std::ranges::minmax(heights);
      sloped_.take(most - least, 5, polygon);
      const double own = median(std::move(heights));
      if (std::abs(own) > kMostLevel) return std::unexpected(not_of_the_earth(own));
      if (auto done = compare_with_dem(polygon, own); !done) return std::unexpected(done.error());
      return own;
    }
    if (polygon >= out_.level_areas_.polygons()) return kNone;
    std::vector<float> heights;
    for (std::size_t k = layers_.size(); k-- > 0 && heights.empty();) {
      AreaRow row(one(polygon), *layers_[k]);
      for (const PostRect& rect : post_rects(*layers_[k], out_.level_areas_.bounds(polygon))) {
        auto done = each_post(*layers_[k], rect, [&](float z, double lon, double lat) {
          if (row.holding(lon, lat) != AreaSet::kNone) heights.push_back(z);
        });
        if (!done) return std::unexpected(done.error());
      }
    }
    if (!heights.empty()) return median(std::move(heights));
    constexpr std::size_t kMostPlaces = 10000;
    return outline_level(polygon, kMostPlaces);
  }

  /// How many polygons something is much of, and which has the most of it.
  struct Worst {
    std::size_t count = 0;
    double most = 0;
    Index polygon = 0;

    void take(double much, double too_much, Index p) {
      if (!(much > too_much)) return;
      ++count;
      if (much > most) most = much, polygon = p;
    }
  };
  Worst sloped_, lowered_;

  /// What being level cost polygons that were not, or not alone.
  void warn_of_levels() {
    const auto say = [&](const Worst& worst, const char* what) {
      if (worst.count == 0) return;
      const Vec2 at = place(net_.edges[edges_of_polygon_[worst.polygon].front()].a);
      out_.report_.warnings.push_back(
          fmt::format("{} of {} polygons to be level {}; the most are {:.1f} m, at {:.4f}, {:.4f}",
                      worst.count, flatten_.size(), what, worst.most, at.x, at.y));
    };
    say(sloped_,
        "have own heights that differ by more than 5 m: each is level at the median of its own");
    say(lowered_,
        "touch one, or lie in one, that is more than 1 m lower: they share the lowest level");
  }

  /// Counts levels of which people most likely think that they are above something else.
  Result<void> compare_with_dem(Index polygon, double own) {
    constexpr std::size_t kEnoughPlaces = 64;
    constexpr double kFar_m = 20;  // half of what heights above sea and ellipsoid often differ by
    const auto shore = outline_level(polygon, kEnoughPlaces);
    if (!shore) return std::unexpected(shore.error());
    const double off = own - *shore;
    if (!(std::abs(off) > kFar_m)) return {};
    ++far_levels_;
    far_zeros_ += own == 0;
    if (std::abs(off) <= std::abs(farthest_m_)) return {};
    farthest_m_ = off;
    farthest_ = place(net_.edges[edges_of_polygon_[polygon].front()].a);
    return {};
  }
  std::size_t far_levels_ = 0, far_zeros_ = 0;
  double farthest_m_ = 0;
  Vec2 farthest_;

  void warn_of_far_levels() {
    if (far_levels_ == 0) return;
    const std::string why =
        far_zeros_ == 0
            ? "are they above what the tiles' heights are above?"
            : fmt::format(
                  "{} of these {} exactly 0, which Shapefiles hold where no height was given;",
                  far_zeros_, far_zeros_ == 1 ? "is" : "are");
    out_.report_.warnings.push_back(fmt::format(
        "{} of {} polygons to be level have own heights more than 20 m from the DEM along their "
        "outlines, {:.0f} m {} it at {:.4f}, {:.4f} the most: {} --line-heights dem takes the "
        "DEM's instead",
        far_levels_, flatten_.size(), std::abs(farthest_m_), farthest_m_ < 0 ? "below" : "above",
        farthest_.x, farthest_.y, why));
  }

  Result<double> outline_level(Index polygon, std::size_t most_places) {
    std::vector<float> heights;
    const auto& edges = edges_of_polygon_[polygon];
    const std::size_t step = edges.size() / most_places + 1;
    for (std::size_t k = layers_.size(); k-- > 0 && heights.empty();)
      for (std::size_t i = 0; i < edges.size(); i += step) {
        const Vec2 p = place(net_.edges[edges[i]].a);
        const auto at = height_at(*layers_[k], {p.x, p.y});
        if (!at) return std::unexpected(at.error());
        if (at->coverage == Coverage::value) heights.push_back(float(at->height_m));
      }
    return median(std::move(heights));
  }

  /// A polygon alone.
  const AreaSet& one(Index polygon) {
    std::vector<AreaSet::Edge> edges;
    for (const Index e : edges_of_polygon_[polygon])
      edges.push_back({place(net_.edges[e].a), place(net_.edges[e].b), 0});
    one_ = AreaSet(std::move(edges));
    return one_;
  }
  AreaSet one_;
  std::vector<std::vector<Index>> edges_of_polygon_;

  Result<void> find_levels() {
    edges_of_polygon_.resize(flatten_.size());
    for (Index e = 0; e < net_.edges.size(); ++e)
      for (const Index polygon : net_.edges[e].polygons) edges_of_polygon_[polygon].push_back(e);
    join_nested();
    std::vector<double> lowest(flatten_.size(), kNone), levels = lowest;
    for (Index p = 0; p < flatten_.size(); ++p) {
      if (edges_of_polygon_[p].empty()) continue;  // beyond the DEM
      const auto own = own_level(p);
      if (!own) {
        const Vec3& first = flatten_[p].rings.front().front();
        return fail(fmt::format("the level of the polygon at {:.5f} {:.5f}", first.x, first.y),
                    own.error());
      }
      levels[p] = *own;
      double& low = lowest[root(p)];
      if (std::isnan(low) || *own < low) low = *own;
    }
    for (Index p = 0; p < flatten_.size(); ++p) lowered_.take(levels[p] - lowest[root(p)], 1, p);
    warn_of_far_levels();
    warn_of_levels();
    out_.levels_.assign(out_.level_areas_.polygons(), 0);
    std::string text;
    for (Index p = 0; p < out_.levels_.size(); ++p) {
      if (edges_of_polygon_[p].empty()) continue;
      const double level = double(float(lowest[root(p)]));
      out_.levels_[p] = std::isnan(level) ? 0 : level;
      out_.report_.without_level += std::isnan(level);
      text += fmt::format(" {}", out_.levels_[p]);
    }
    out_.level_digest_ = hash128(text).text();
    return {};
  }

  // --- chains ----------------------------------------------------------------------------------

  double level_beside(const Vec2& a, const Vec2& b, double side) const {
    const double dx = b.x - a.x, dy = b.y - a.y, length = std::hypot(dx, dy);
    const double off = side * std::min(length / 1024, 1e-7) / length;
    const auto level = out_.level_at({(a.x + b.x) / 2 - dy * off, (a.y + b.y) / 2 + dx * off});
    return level ? *level : kNone;
  }

  struct Line {
    Index a, b;
    double level;     // NaN: a breakline
    bool water_left;  // from a to b
  };

  /// Shores and breaklines; where both run, the shore.
  std::vector<Line> lines_of_network() const {
    std::vector<Line> lines;
    for (const ShapeEdge& e : net_.edges) {
      const Vec2 a = place(e.a), b = place(e.b);
      const double left = level_beside(a, b, 1), right = level_beside(a, b, -1);
      if (!std::isnan(left) && !std::isnan(right)) continue;  // within water
      const double level = std::isnan(left) ? right : left;
      if (!std::isnan(level) && !e.polygons.empty())
        lines.push_back({e.a, e.b, level, !std::isnan(left)});
      else if (e.line != AreaSet::kNone && std::isnan(level))
        lines.push_back({e.a, e.b, kNone, false});
    }
    return lines;
  }

  /// Lines between points where other than two meet, or all around; and what hangs together.
  Result<void> make_chains() {
    const std::vector<Line> lines = lines_of_network();
    const auto same = [](double p, double q) { return p == q || (std::isnan(p) && std::isnan(q)); };
    std::vector<std::vector<Index>> at(net_.points.size());
    for (Index k = 0; k < lines.size(); ++k)
      at[lines[k].a].push_back(k), at[lines[k].b].push_back(k);
    const auto water_left_from = [&](Index line, Index point) {
      return lines[line].water_left == (lines[line].a == point);
    };
    const auto passes = [&](Index point) {
      if (at[point].size() != 2) return false;
      const Index k = at[point][0], l = at[point][1];
      return same(lines[k].level, lines[l].level) &&
             (std::isnan(lines[k].level) || water_left_from(k, point) != water_left_from(l, point));
    };
    std::vector<Index> group(net_.points.size());
    std::iota(group.begin(), group.end(), 0);
    const auto root_of = [&](Index p) {
      while (group[p] != p) p = group[p] = group[group[p]];
      return p;
    };
    for (const Line& l : lines) group[root_of(l.a)] = root_of(l.b);
    std::map<Index, Index> number;  // of what hangs together
    std::vector<ShapeChain> chains;
    std::vector<bool> used(lines.size(), false);
    const auto follow = [&](Index line, Index from) {
      ShapeChain chain;
      chain.level_m = lines[line].level;
      chain.water_left = water_left_from(line, from);
      chain.network = number.try_emplace(root_of(from), Index(number.size())).first->second;
      chain.points.push_back(net_.points[from]);
      for (Index point = from;;) {
        used[line] = true;
        point = lines[line].a == point ? lines[line].b : lines[line].a;
        chain.points.push_back(net_.points[point]);
        if (point == from || !passes(point)) break;
        line = at[point][0] == line ? at[point][1] : at[point][0];
      }
      chains.push_back(std::move(chain));
    };
    for (Index k = 0; k < lines.size(); ++k)
      for (const Index end : {lines[k].a, lines[k].b})
        if (!used[k] && !passes(end)) follow(k, end);
    for (Index k = 0; k < lines.size(); ++k)
      if (!used[k]) follow(k, lines[k].a);
    auto networks = extents(chains, number.size());
    if (!networks) return std::unexpected(networks.error());
    out_.report_.chains = chains.size();
    for (const ShapeChain& c : chains) out_.report_.points += c.points.size();
    out_.lines_ = ShapeLines(std::move(chains), std::move(*networks));
    return {};
  }

  Result<std::vector<ShapeExtent>> extents(const std::vector<ShapeChain>& chains,
                                           std::size_t count) {
    std::vector<GeoRect> boxes(count, {HUGE_VAL, HUGE_VAL, -HUGE_VAL, -HUGE_VAL});
    for (const ShapeChain& c : chains)
      for (const Vec3& p : c.points) {
        GeoRect& b = boxes[c.network];
        b = {std::min(b.west, p.x), std::min(b.south, p.y), std::max(b.east, p.x),
             std::max(b.north, p.y)};
      }
    std::vector<ShapeExtent> extents(count);
    for (std::size_t k = 0; k < count; ++k) {
      const GeoRect& b = boxes[k];
      const double lat = (b.south + b.north) / 2 * 0.017453292519943295;
      extents[k].size_deg = std::max(b.height(), b.width() * std::max(0.01, std::cos(lat)));
    }
    if (auto done = find_reliefs(chains, boxes, extents); !done)
      return std::unexpected(done.error());
    return extents;
  }

  /// Of islands and the like: posts that an outline surrounds without being level. Where that is
  /// much to read, the outline is large and needs no relief to count.
  Result<void> find_reliefs(const std::vector<ShapeChain>& chains,
                            const std::vector<GeoRect>& boxes, std::vector<ShapeExtent>& extents) {
    constexpr double kMuch = 1 << 20;  // posts
    std::vector<std::vector<AreaSet::Edge>> edges(extents.size());
    std::vector<double> level(extents.size(), kNone);
    for (const ShapeChain& c : chains) {
      if (!c.shore()) continue;
      level[c.network] = c.level_m;
      for (std::size_t i = 1; i < c.points.size(); ++i)
        edges[c.network].push_back(
            {{c.points[i - 1].x, c.points[i - 1].y}, {c.points[i].x, c.points[i].y}, 0});
    }
    for (std::size_t k = 0; k < extents.size(); ++k) {
      if (edges[k].empty()) continue;
      const AreaSet outline(std::move(edges[k]));
      for (const auto& layer : layers_) {
        AreaRow row(outline, *layer);
        for (const PostRect& rect : post_rects(*layer, boxes[k])) {
          const double posts =
              double(rect.last_col - rect.col + 1) * double(rect.last_row - rect.row + 1);
          if (posts > kMuch) continue;
          auto read = each_post(*layer, rect, [&](float z, double lon, double lat) {
            if (row.holding(lon, lat) == AreaSet::kNone || out_.level_at({lon, lat})) return;
            extents[k].relief_m = std::max(extents[k].relief_m, std::abs(double(z) - level[k]));
          });
          if (!read) return read;
        }
      }
    }
    return {};
  }
};

std::optional<double> SurfaceShapes::level_at(Geographic p) const {
  const std::uint32_t polygon = level_areas_.holding(p.lon, p.lat);
  if (polygon == AreaSet::kNone) return {};
  return levels_[polygon];
}

bool SurfaceShapes::outside(Geographic p) const {
  return !boundary_.empty() && boundary_.holding(p.lon, p.lat) == AreaSet::kNone;
}

Result<void> SurfaceShapes::unchanged() const {
  for (const FileStates& states : states_)
    if (auto same = states.unchanged(); !same) return same;
  for (const auto& raster : water_.rasters)
    if (auto same = raster->unchanged(); !same) return same;
  return {};
}

Result<std::shared_ptr<const SurfaceShapes>> SurfaceShapes::make(Layers layers,
                                                                 const ShapeFiles& files) {
  return ShapesBuilder(layers, files).build();
}

}  // namespace tind
