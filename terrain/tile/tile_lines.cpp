// Lines are thinned by [Douglas, Peucker: Algorithms for the reduction of the number of points
// required to represent a digitized line, The Canadian Cartographer 10(2), 1973].

#include "terrain/tile/tile_lines.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <tuple>

#include "terrain/surface/post_warp.h"

namespace tind {

namespace {

bool same_height(double p, double q) { return p == q || (std::isnan(p) && std::isnan(q)); }
bool same_place(const Vec3& p, const Vec3& q) { return p.x == q.x && p.y == q.y; }

double distance_to(const Vec3& p, const Vec3& a, const Vec3& b, double x_scale) {
  const double bx = (b.x - a.x) * x_scale, by = b.y - a.y;
  const double px = (p.x - a.x) * x_scale, py = p.y - a.y;
  const double length2 = bx * bx + by * by;
  const double t = length2 > 0 ? std::clamp((px * bx + py * by) / length2, 0.0, 1.0) : 0;
  return std::hypot(px - t * bx, py - t * by);
}

/// Marks what stays of points[first..last], its ends apart.
void thin(const std::vector<Vec3>& points, std::size_t first, std::size_t last, double tolerance,
          double x_scale, std::vector<bool>& stays) {
  std::vector<std::pair<std::size_t, std::size_t>> todo{{first, last}};
  while (!todo.empty()) {
    const auto [from, to] = todo.back();
    todo.pop_back();
    double worst = tolerance;
    std::size_t at = 0;
    for (std::size_t i = from + 1; i < to; ++i) {
      const double d = distance_to(points[i], points[from], points[to], x_scale);
      if (d > worst) worst = d, at = i;
    }
    if (at == 0) continue;
    stays[at] = true;
    todo.push_back({from, at});
    todo.push_back({at, to});
  }
}

std::vector<Vec3> thinned(const std::vector<Vec3>& points, bool closed, double tolerance,
                          double x_scale) {
  if (points.size() < 3) return points;
  std::vector<bool> stays(points.size(), false);
  stays.front() = stays.back() = true;
  std::size_t middle = 0;
  if (closed) {  // two halves, from the point that is farthest from the first
    double farthest = 0;
    for (std::size_t i = 1; i + 1 < points.size(); ++i) {
      const double d = std::hypot((points[i].x - points[0].x) * x_scale, points[i].y - points[0].y);
      if (d > farthest) farthest = d, middle = i;
    }
    stays[middle] = true;
    thin(points, 0, middle, tolerance, x_scale, stays);
  }
  thin(points, middle, points.size() - 1, tolerance, x_scale, stays);
  std::vector<Vec3> kept;
  for (std::size_t i = 0; i < points.size(); ++i)
    if (stays[i]) kept.push_back(points[i]);
  return kept;
}

Vec3 on_side(int side, double t) {
  switch (TileSide(side)) {
    case TileSide::west:
      return {0, t, 0};
    case TileSide::south:
      return {t, 0, 0};
    case TileSide::east:
      return {kTileExtent, t, 0};
    case TileSide::north:
      return {t, kTileExtent, 0};
  }
  return {};
}

class LinesOfTile {
 public:
  LinesOfTile(TileId id, const LineScale& scale, std::span<const CrossingVertices> crossings,
              double tolerance)
      : scale_(scale), crossings_(crossings), tolerance_(tolerance) {
    const GeoRect rect = tiling::rect(id);
    x_scale_ = std::max(0.1, std::cos((rect.south + rect.north) / 2 * std::numbers::pi / 180));
  }

  void add(const ShapePiece& piece) {
    const ShapeChain& chain = *piece.chain;
    const double height = chain.shore() ? scale_.level(chain.level_m) : 0;
    std::vector<Vec3> given, line;  // as it is, and on the grid
    const auto end = [&](const ShapePiece::End& at) {
      if (at.side < 0) return;
      given.push_back(on_side(at.side, at.t));
      if (const auto* vertex = crossings_[std::size_t(at.side)].of(at.t)) {
        Vec3 p = on_side(at.side, vertex->t);
        p.z = vertex->height_m;
        put(line, p);
      }
    };
    end(piece.from);
    for (const Vec3& p : piece.points) {
      given.push_back(p);
      put(line, {inside(p.x), inside(p.y), chain.shore() ? height : p.z});
    }
    end(piece.to);
    if (line.size() < 2) return;
    const bool closed = same_place(line.front(), line.back());
    line = thinned(line, closed, tolerance_, x_scale_);
    if (closed && line.size() < 4) line.clear();  // nothing but a spike is left of it
    std::uint32_t between = AreaSet::kNone;
    if (chain.shore()) between = note_between(given, line, height);
    if (line.size() >= 2) out_.lines.push_back({std::move(line), chain.shore(), closed, between});
  }

  TileLines take() {
    out_.between = AreaSet(edges_);
    out_.edges_between = std::move(edges_);
    return std::move(out_);
  }

 private:
  const LineScale& scale_;
  std::span<const CrossingVertices> crossings_;
  double tolerance_, x_scale_ = 1;
  TileLines out_;
  std::vector<AreaSet::Edge> edges_;

  /// Borders belong to both neighbours: nothing but crossings stands on them.
  static double inside(double v) { return std::clamp(std::round(v), 1.0, kTileExtent - 1); }
  static void put(std::vector<Vec3>& line, const Vec3& p) {
    if (line.empty() || !same_place(line.back(), p)) line.push_back(p);
  }

  std::uint32_t note_between(const std::vector<Vec3>& given, const std::vector<Vec3>& line,
                             double level) {
    const auto number = std::uint32_t(out_.level_between.size());
    out_.level_between.push_back(level);
    const auto add = [&](const Vec3& a, const Vec3& b) {
      edges_.push_back({{a.x, a.y}, {b.x, b.y}, number});
    };
    for (std::size_t i = 1; i < given.size(); ++i) add(given[i - 1], given[i]);
    for (std::size_t i = 1; i < line.size(); ++i) add(line[i - 1], line[i]);
    if (line.empty()) {
      add(given.back(), given.front());
    } else {
      add(given.front(), line.front());
      add(given.back(), line.back());
    }
    return number;
  }
};

}  // namespace

CrossingVertices::CrossingVertices(std::span<const ShapeCrossing> crossings, int gap) {
  for (const ShapeCrossing& c : crossings) {
    const int t = int(std::clamp(std::round(c.t), 1.0, kTileExtent - 1));
    if (!vertices_.empty()) {
      Vertex& last = vertices_.back();
      const bool alike = last.shore == c.shore && same_height(last.height_m, c.height_m);
      if (t <= last.t || (alike && t < last.t + gap)) {
        // A shore decides over a breakline, the lower of two waters over the other.
        if (c.shore && (!last.shore || c.height_m < last.height_m))
          last.crossing = c.t, last.height_m = c.height_m, last.shore = true;
        continue;
      }
    }
    vertices_.push_back({c.t, c.t, t, c.height_m, c.shore});
  }
}

const CrossingVertices::Vertex* CrossingVertices::of(double t) const {
  const auto after = std::ranges::upper_bound(vertices_, t + 1e-6, {}, &Vertex::first);
  return after == vertices_.begin() ? nullptr : &*std::prev(after);
}

double line_tolerance(int level, double error_m) {
  const double unit_m = tiling::tile_degrees(level) / kTileExtent * 111320;
  return std::clamp(error_m / unit_m, 1.0, 128.0);
}

namespace {

constexpr double kBesideShore = 3;  // units of the grid
constexpr double kStrip = 64;

}  // namespace

ShoreBender::ShoreBender(const TileLines& lines) : strips_(std::size_t(kTileExtent / kStrip) + 2) {
  for (std::uint32_t l = 0; l < lines.lines.size(); ++l) {
    const TileLine& line = lines.lines[l];
    for (std::uint32_t i = 0; line.shore && i + 1 < line.points.size(); ++i) {
      const Vec3 &a = line.points[i], &b = line.points[i + 1];
      const auto strip = [](double v) {
        return std::size_t(std::clamp(v, 0.0, kTileExtent) / kStrip);
      };
      const std::size_t last = strip(std::max(a.y, b.y) + kBesideShore);
      for (std::size_t s = strip(std::min(a.y, b.y) - kBesideShore); s <= last; ++s)
        strips_[s].push_back(std::uint32_t(segments_.size()));
      segments_.push_back({l, i, a, b});
    }
  }
}

void ShoreBender::meet(const Vec3& post, double most) {
  if (!(post.y >= 0 && post.y <= kTileExtent)) return;
  for (const std::uint32_t k : strips_[std::size_t(post.y / kStrip)]) {
    const Segment& s = segments_[k];
    if (std::abs(post.z - s.a.z) <= most || distance_to(post, s.a, s.b, 1) > kBesideShore) continue;
    const double dx = s.b.x - s.a.x, dy = s.b.y - s.a.y;
    const double along = (post.x - s.a.x) * dx + (post.y - s.a.y) * dy;
    if (along > 0 && along < dx * dx + dy * dy)
      beside_segment_[{s.line, s.at}].push_back(post);
    else
      beside_point_.try_emplace({s.line, s.at + (along > 0)}, post);
  }
}

namespace {

/// A bend of a shore towards a post goes back into the water.
void move_point(TileLines& lines, std::uint32_t l, std::uint32_t at, const Vec3& post,
                const std::function<bool(double, double)>& wet) {
  TileLine& line = lines.lines[l];
  if (at == 0 || at + 1 >= line.points.size()) return;  // on the border, or where a ring begins
  const Vec3 a = line.points[at - 1], b = line.points[at + 1], from = line.points[at];
  const double dx = from.x - post.x, dy = from.y - post.y, length = std::hypot(dx, dy);
  if (!(length > 0)) return;
  const double go = kBesideShore + 1;
  const Vec3 to{std::clamp(std::round(from.x + dx / length * go), 1.0, kTileExtent - 1),
                std::clamp(std::round(from.y + dy / length * go), 1.0, kTileExtent - 1), from.z};
  if (!wet(to.x, to.y) || same_place(to, a) || same_place(to, b)) return;
  const auto add = [&](const Vec3& p, const Vec3& q) {
    lines.edges_between.push_back({{p.x, p.y}, {q.x, q.y}, line.between});
  };
  add(a, to), add(to, b), add(b, from), add(from, a);
  line.points[at] = to;
}

}  // namespace

void ShoreBender::bend(TileLines& lines, const std::function<bool(double u, double v)>& wet) const {
  for (const auto& [where, post] : beside_point_)
    move_point(lines, where.first, where.second, post, wet);
  for (auto it = beside_segment_.rbegin(); it != beside_segment_.rend();
       ++it) {  // so that numbers before it hold
    const auto [l, at] = it->first;
    TileLine& line = lines.lines[l];
    const Vec3 a = line.points[at], b = line.points[at + 1];
    const double dx = b.x - a.x, dy = b.y - a.y, length = std::hypot(dx, dy);
    std::vector<std::pair<double, Vec3>> way;  // by the share of the way
    for (const Vec3& p : it->second)
      for (const double side : {kBesideShore + 1, -kBesideShore - 1}) {
        const Vec3 q{std::clamp(std::round(p.x - dy / length * side), 1.0, kTileExtent - 1),
                     std::clamp(std::round(p.y + dx / length * side), 1.0, kTileExtent - 1), a.z};
        if (!wet(q.x, q.y)) continue;
        way.push_back({((q.x - a.x) * dx + (q.y - a.y) * dy) / (length * length), q});
        break;
      }
    std::ranges::sort(way, {}, [](const auto& step) {
      return std::tuple(step.first, step.second.x, step.second.y);
    });
    std::vector<Vec3> bent;
    for (const auto& [share, q] : way)
      if (share > 0 && share < 1 && !same_place(q, a) && !same_place(q, b)) bent.push_back(q);
    const auto add = [&](const Vec3& p, const Vec3& q) {
      lines.edges_between.push_back({{p.x, p.y}, {q.x, q.y}, line.between});
    };
    for (std::size_t i = 0; i <= bent.size(); ++i)
      if (!bent.empty()) add(i == 0 ? a : bent[i - 1], i == bent.size() ? b : bent[i]);
    if (!bent.empty()) add(b, a);
    line.points.insert(line.points.begin() + at + 1, bent.begin(), bent.end());
  }
  lines.between = AreaSet(lines.edges_between);
}

TileLines tile_lines(const ShapeLines& shapes, TileId id, const LineScale& scale,
                     std::span<const CrossingVertices> crossings, double tolerance) {
  LinesOfTile lines(id, scale, crossings, tolerance);
  for (const ShapePiece& piece : shapes.pieces(tiling::rect(id), scale)) lines.add(piece);
  return lines.take();
}

}  // namespace tind
