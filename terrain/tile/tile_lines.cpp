#include "terrain/tile/tile_lines.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <tuple>

#include "terrain/surface/post_warp.h"
#include "terrain/tile/thin_line.h"

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

std::vector<Vec3> thinned(const std::vector<Vec3>& points, bool closed, double tolerance,
                          double x_scale) {
  if (points.size() < 3) return points;
  const auto off = [&](std::size_t from, std::size_t to, std::size_t i) {
    return distance_to(points[i], points[from], points[to], x_scale);
  };
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
    mark_needed(0, middle, tolerance, stays, off);
  }
  mark_needed(middle, points.size() - 1, tolerance, stays, off);
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
    if (line.size() < 2) return;
    out_.lines.push_back({std::move(line), chain.shore(), chain.water_left, closed, between});
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
    const auto known = std::ranges::find(out_.level_between, level);
    const auto number = std::uint32_t(known - out_.level_between.begin());
    if (known == out_.level_between.end()) out_.level_between.push_back(level);
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

constexpr double kLeastClear = 4, kMostClear = 100;  // units of the grid
/// However much farther shores are asked to keep: with the 128 units by which they may be thinned,
/// what is farther than 1/64 of the side from its outline is level all the same (check_source.cpp).
constexpr double kFarthestClear = 360;
constexpr double kStrip = 64;
constexpr double kFarPost = 0.9;  // of the budget: what may lie on a shore

bool in_circle(const Vec3& p, const Vec2& middle, double r) {
  const double dx = p.x - middle.x, dy = p.y - middle.y;
  return dx * dx + dy * dy < r * r;
}

/// Where the way from a to b crosses a circle, as shares of the way, in order: one, where one end
/// is inside, whatever rounding says; else none or two.
std::vector<double> circle_crossings(const Vec3& a, const Vec3& b, const Vec2& middle, double r) {
  const bool from = in_circle(a, middle, r), to = in_circle(b, middle, r);
  if (from && to) return {};
  if (!from && !to &&
      (std::min(a.x, b.x) >= middle.x + r || std::max(a.x, b.x) <= middle.x - r ||
       std::min(a.y, b.y) >= middle.y + r || std::max(a.y, b.y) <= middle.y - r))
    return {};
  const double dx = b.x - a.x, dy = b.y - a.y, px = a.x - middle.x, py = a.y - middle.y;
  const double aa = dx * dx + dy * dy, ab = px * dx + py * dy;
  const double root = ab * ab - aa * (px * px + py * py - r * r);
  if (aa == 0 || (!(root > 0) && from == to)) return {};
  const double half = std::sqrt(std::max(root, 0.0));
  const double first = (-ab - half) / aa, second = (-ab + half) / aa;
  if (from != to) return {std::clamp(from ? second : first, 0.0, 1.0)};
  if (!(first > 0 && second < 1)) return {};
  return {first, second};
}

double grid_place(double v) { return std::clamp(std::round(v), 1.0, kTileExtent - 1); }

/// The box around a line: most lines are far from most places.
struct LineBox {
  double west = HUGE_VAL, south = HUGE_VAL, east = -HUGE_VAL, north = -HUGE_VAL;

  explicit LineBox(const std::vector<Vec3>& line) {
    for (const Vec3& p : line) {
      west = std::min(west, p.x), east = std::max(east, p.x);
      south = std::min(south, p.y), north = std::max(north, p.y);
    }
  }
  bool comes_near(const Vec3& place, double radius) const {
    return south < place.y + radius && north > place.y - radius && west < place.x + radius &&
           east > place.x - radius;
  }
};

bool comes_near(const std::vector<Vec3>& line, const Vec3& place, double radius) {
  for (std::size_t i = 1; i < line.size(); ++i) {
    const Vec3 &a = line[i - 1], &b = line[i];
    if (std::min(a.y, b.y) < place.y + radius && std::max(a.y, b.y) > place.y - radius &&
        std::min(a.x, b.x) < place.x + radius && std::max(a.x, b.x) > place.x - radius &&
        distance_to(place, a, b, 1) < radius)
      return true;
  }
  return false;
}

/// A disc taken out of a water: of its shores stays what lies outside, and where a shore goes into
/// the disc, a way around it goes on to the next place where one comes out of it.
class WaterWithoutDisc {
 public:
  /// `like`: a shore of that water.
  WaterWithoutDisc(const Vec2& middle, double radius, const TileLine& like)
      : middle_(middle), radius_(radius), like_(like) {}

  void take(TileLine line) {
    std::vector<Vec3>& points = line.points;
    // Of chains with the water on the other side the other way is meant.
    if (line.water_left != like_.water_left) std::ranges::reverse(points);
    if (!line.closed) return cut(points, false);
    const auto begin = std::ranges::find_if(points, [&](auto& p) { return !inside(p); });
    if (begin == points.end()) return note_swallowed(points);
    points.pop_back();
    std::ranges::rotate(points, begin);
    points.push_back(points.front());
    cut(points, true);
  }

  /// The shores of what is left.
  std::vector<TileLine> shores() {
    if (parts_.empty() && surrounded_) {
      around(0, 2 * std::numbers::pi);
      way_.push_back(way_.front());
      add(std::move(way_), true);
    }
    for (Part& first : parts_)
      if (!first.used && !first.comes_out) follow(first, false);
    for (Part& first : parts_)
      if (!first.used) follow(first, true);
    return std::move(shores_);
  }

 private:
  struct Part {
    std::vector<Vec3> points;
    double out = 0, in = 0;  // turns at which it comes out of the disc and goes into it
    bool comes_out = false, goes_in = false, used = false;
  };
  const Vec2 middle_;
  const double radius_;
  const TileLine like_;
  std::vector<Part> parts_;
  std::vector<TileLine> shores_;
  std::vector<Vec3> way_;
  double swallowed_ = 0;     // the largest of the rings in the disc
  bool surrounded_ = false;  // by water

  bool inside(const Vec3& p) const { return in_circle(p, middle_, radius_); }
  /// Water on the left goes clockwise around what is dry.
  double direction() const { return like_.water_left ? -1 : 1; }
  double turn_at(const Vec3& p) const {
    return direction() * std::atan2(p.y - middle_.y, p.x - middle_.x);
  }
  static double forward(double from, double to) {
    const double turn = std::fmod(to - from, 2 * std::numbers::pi);
    return turn < 0 ? turn + 2 * std::numbers::pi : turn;
  }

  void note_swallowed(const std::vector<Vec3>& ring) {
    double area = 0;
    for (std::size_t i = 1; i < ring.size(); ++i)
      area += (ring[i - 1].x - middle_.x) * (ring[i].y - middle_.y) -
              (ring[i].x - middle_.x) * (ring[i - 1].y - middle_.y);
    if (std::abs(area) <= swallowed_) return;
    swallowed_ = std::abs(area);
    surrounded_ = (area > 0) != like_.water_left;
  }

  void cut(const std::vector<Vec3>& points, bool closed) {
    const std::size_t first = parts_.size();
    bool in = inside(points.front());
    Part part;
    const auto go_in = [&](const Vec3& at) {
      part.points.push_back(at);
      part.in = turn_at(at), part.goes_in = true;
      parts_.push_back(std::move(part));
      part = {};
    };
    const auto come_out = [&](const Vec3& at) {
      part.points.push_back(at);
      part.out = turn_at(at), part.comes_out = true;
    };
    in ? go_in(points.front()) : part.points.push_back(points.front());
    for (std::size_t i = 1; i < points.size(); ++i) {
      const Vec3 &a = points[i - 1], &b = points[i];
      for (const double t : circle_crossings(a, b, middle_, radius_)) {
        in ? come_out(a + (b - a) * t) : go_in(a + (b - a) * t);
        in = !in;
      }
      if (!in) part.points.push_back(b);
    }
    if (in) come_out(points.back());
    parts_.push_back(std::move(part));
    if (!closed || parts_.size() == first + 1) return;
    // It began in the middle of a part.
    Part& last = parts_.back();
    last.points.insert(last.points.end(), parts_[first].points.begin() + 1,
                       parts_[first].points.end());
    last.in = parts_[first].in, last.goes_in = true;
    parts_.erase(parts_.begin() + std::ptrdiff_t(first));
  }

  void follow(Part& first, bool closed) {
    way_.clear();
    for (Part* part = &first;;) {
      part->used = true;
      for (std::size_t i = 0; i < part->points.size(); ++i)
        put(part->points[i],
            (i == 0 && !part->comes_out) || (i + 1 == part->points.size() && !part->goes_in));
      if (!part->goes_in) break;
      Part* next = nullptr;
      for (Part& other : parts_)
        if (other.comes_out && (!other.used || (closed && &other == &first)) &&
            (!next || forward(part->in, other.out) < forward(part->in, next->out)))
          next = &other;
      if (!next) break;
      around(part->in, forward(part->in, next->out));
      if (next == &first) break;
      part = next;
    }
    if (closed && !way_.empty() && !same_place(way_.front(), way_.back()))
      way_.push_back(way_.front());
    add(std::move(way_), closed);
    way_ = {};
  }

  void add(std::vector<Vec3> points, bool closed) {
    if (points.size() < (closed ? 4u : 2u)) return;
    TileLine line = like_;
    line.points = std::move(points), line.closed = closed;
    shores_.push_back(std::move(line));
  }

  /// On the grid. Only the end of a line may be on the border, which neighbours share: where the
  /// line runs along it, the circle's place on it is none.
  void put(const Vec3& p, bool end = false) {
    const double z = like_.points.front().z;
    const Vec3 q = end ? Vec3{p.x, p.y, z} : Vec3{grid_place(p.x), grid_place(p.y), z};
    if (way_.empty() || !same_place(way_.back(), q)) way_.push_back(q);
  }
  /// Along the circle, never outside: there other shores may run.
  void around(double from, double turn) {
    constexpr double kCorner = std::numbers::pi / 8;
    for (double k = std::floor(from / kCorner) + 1; k * kCorner - from < turn; ++k)
      put({middle_.x + radius_ * std::cos(k * kCorner * direction()),
           middle_.y + radius_ * std::sin(k * kCorner * direction()), 0});
  }
};

}  // namespace

ShoreBender::ShoreBender(const TileLines& lines, double budget_m, double scale)
    : budget_m_(budget_m), scale_(scale), strips_(std::size_t(kTileExtent / kStrip) + 1) {
  const double reach = std::min(kFarthestClear, kMostClear * scale);
  const auto strip = [](double v) { return std::size_t(std::clamp(v, 0.0, kTileExtent) / kStrip); };
  for (const TileLine& line : lines.lines) {
    if (!line.shore) continue;
    low_ = std::min(low_, line.points.front().z), high_ = std::max(high_, line.points.front().z);
    for (std::uint32_t i = 0; i + 1 < line.points.size(); ++i) {
      const Vec3 &a = line.points[i], &b = line.points[i + 1];
      const std::size_t last = strip(std::max(a.y, b.y) + reach);
      for (std::size_t s = strip(std::min(a.y, b.y) - reach); s <= last; ++s)
        strips_[s].push_back(std::uint32_t(segments_.size()));
      segments_.push_back({a.z, a, b});
    }
  }
}

/// A vertex may be most of a unit from its post: on this slope that is within the budget.
double ShoreBender::clearance(double height_m) const {
  const double clear = std::clamp(2 + 2 * height_m / budget_m_, kLeastClear, kMostClear);
  return std::min(kFarthestClear, scale_ * clear);
}

void ShoreBender::meet(const Vec3& post) {
  const double most = kFarPost * budget_m_;
  if (!(post.y >= 0 && post.y <= kTileExtent)) return;
  if (post.z <= low_ + most && post.z >= high_ - most) return;
  for (const std::uint32_t k : strips_[std::size_t(post.y / kStrip)]) {
    const Segment& s = segments_[k];
    const double height = std::abs(post.z - s.level), radius = clearance(height);
    if (height > most && distance_to(post, s.a, s.b, 1) < radius)
      discs_.insert({post.x, post.y, radius, s.level});
  }
}

void ShoreBender::bend(TileLines& lines) const {
  if (discs_.empty()) return;
  const auto add_edges = [&] {
    for (const TileLine& line : lines.lines)
      for (std::size_t i = 1; line.shore && i < line.points.size(); ++i) {
        const Vec3 &p = line.points[i - 1], &q = line.points[i];
        lines.edges_between.push_back({{p.x, p.y}, {q.x, q.y}, line.between});
      }
  };
  add_edges();                 // twice there: as if they were not
  std::vector<LineBox> boxes;  // of the lines, in their order
  boxes.reserve(lines.lines.size());
  for (const TileLine& line : lines.lines) boxes.emplace_back(line.points);
  for (const Disc& disc : discs_) {
    const Vec3 middle{disc.u, disc.v, 0};
    std::vector<TileLine> met;
    std::size_t kept = 0;
    for (std::size_t i = 0; i < lines.lines.size(); ++i) {
      TileLine& line = lines.lines[i];
      if (line.shore && line.points.front().z == disc.level &&
          boxes[i].comes_near(middle, disc.radius) &&
          comes_near(line.points, middle, disc.radius)) {
        met.push_back(std::move(line));
        continue;
      }
      if (kept < i) lines.lines[kept] = std::move(line), boxes[kept] = boxes[i];
      ++kept;
    }
    if (met.empty()) continue;
    lines.lines.erase(lines.lines.begin() + std::ptrdiff_t(kept), lines.lines.end());
    boxes.erase(boxes.begin() + std::ptrdiff_t(kept), boxes.end());
    WaterWithoutDisc water({disc.u, disc.v}, disc.radius, met.front());
    for (TileLine& line : met) water.take(std::move(line));
    for (TileLine& line : water.shores()) {
      boxes.emplace_back(line.points);
      lines.lines.push_back(std::move(line));
    }
  }
  add_edges();
  lines.between = AreaSet(lines.edges_between);
}

TileLines tile_lines(const ShapeLines& shapes, TileId id, const LineScale& scale,
                     std::span<const CrossingVertices> crossings, double tolerance) {
  LinesOfTile lines(id, scale, crossings, tolerance);
  for (const ShapePiece& piece : shapes.pieces(tiling::rect(id), scale)) lines.add(piece);
  return lines.take();
}

}  // namespace tind
