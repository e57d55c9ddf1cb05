#include "terrain/tile/border.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "terrain/simplify/delaunay_insertion.h"
#include "terrain/tile/post_warp.h"

namespace tind {

namespace {

constexpr int kMostPosts = 1 << 16;  // along one edge
constexpr double kInfinity = std::numeric_limits<double>::infinity();

Geographic along(const TileEdge& e, double t) {
  if (t == kTileExtent) return e.end;
  const double s = t / kTileExtent;
  return {e.start.lon + s * (e.end.lon - e.start.lon), e.start.lat + s * (e.end.lat - e.start.lat)};
}

/// Where lines of the post grid cross the edge, as places along it: every one, or none where that
/// is not known (a projected source) or would be too many.
struct Crossings {
  std::vector<double> all;
  std::vector<double> of_bounds;  // where the data ends, and where what fills the rest turns
};

Crossings crossings(const TileEdge& e, const DemSource& source, const BorderOptions& o) {
  const DemInfo& info = source.info();
  const Affine& grid = info.post_to_crs;
  Crossings found;
  if (!source.is_plain_geographic() || grid.x_row != 0 || grid.y_col != 0) return found;
  const bool northward = e.start.lon == e.end.lon;
  const double first = northward ? e.start.lat : e.start.lon;
  const double width = northward ? e.end.lat - e.start.lat : e.end.lon - e.start.lon;
  const double origin = northward ? grid.y0 : grid.x0;
  const double signed_step = northward ? grid.y_row : grid.x_col, step = std::abs(signed_step);
  const auto add = [&](std::vector<double>& places, double degrees) {
    const double t = (degrees - first) / width * kTileExtent;
    if (t > 0 && t < kTileExtent) places.push_back(t);
  };
  // Where the edge runs along a line of posts, no interior vertex can help those: all count.
  const Vec2 at = grid.invert(e.start.lon, e.start.lat);
  const double across = northward ? at.x : at.y, quantum = width / kTileExtent / step;
  const bool on_posts = std::abs(across - std::round(across)) <= quantum;
  if (width / step <= (on_posts ? kMostPosts : o.samples)) {
    const double k0 = std::ceil((first - origin) / step);
    const auto count = std::int64_t(std::ceil(width / step)) + 1;
    for (std::int64_t i = 0; i < count; ++i) add(found.all, origin + (k0 + double(i)) * step);
    return found;
  }
  const double last = double((northward ? info.rows : info.cols) - 1);
  for (const double shift : {0.0, 360.0, -360.0}) {
    if (shift != 0 && northward) break;
    for (const double past : {0, VoidFill::kFlat, VoidFill::kReach})
      for (const double post : {-past, last + past})
        add(found.of_bounds, origin + post * signed_step + shift);
  }
  return found;
}

/// Where H is looked at. Between crossings H is linear: there the ends and the crossings say all.
std::vector<double> sample_places(const TileEdge& e, const DemSource& source,
                                  const BorderOptions& o) {
  Crossings found = crossings(e, source, o);
  std::vector<double> places = std::move(found.all);
  const int even = places.empty() ? o.samples : o.fixed_cells;
  for (int i = 0; i <= even; ++i) places.push_back(std::round(double(i) * kTileExtent / even));
  places.insert(places.end(), found.of_bounds.begin(), found.of_bounds.end());
  std::sort(places.begin(), places.end());
  places.erase(std::unique(places.begin(), places.end()), places.end());
  return places;
}

struct Sample {
  double t;
  double h;
  bool fixed;
  int place() const { return int(std::lround(t)); }  // where a vertex can stand
};

/// The cone of slopes that keep a line from `from` within the tolerance of the samples seen.
struct Cone {
  double lo = -kInfinity, hi = kInfinity;
  bool narrow(const BorderVertex& from, const Sample& s, double tolerance) {
    const double run = s.t - from.t;
    if (run < 0.5) return true;  // the vertex stands here
    const double l = std::max(lo, (s.h - tolerance - from.height) / run);
    const double h = std::min(hi, (s.h + tolerance - from.height) / run);
    if (l > h) return false;
    lo = l, hi = h;
    return true;
  }
  double middle() const {
    if (lo == -kInfinity && hi == kInfinity) return 0;
    return (lo + hi) / 2;
  }
};

/// From line.back() to the fixed sample samples[end], adding vertices as needed.
void run_to(std::vector<BorderVertex>& line, const std::vector<Sample>& samples, std::size_t begin,
            std::size_t end, double end_height, double tolerance, double step) {
  std::size_t at = begin;
  const BorderVertex goal{samples[end].place(), end_height};
  while (at < end) {
    const BorderVertex from = line.back();
    Cone cone;
    std::size_t reached = at;  // the last valid sample inside the cone
    double slope = 0;
    bool open = true;
    for (std::size_t i = at + 1; i < end && open; ++i) {
      open = cone.narrow(from, samples[i], tolerance);
      if (open && samples[i].place() > from.t && samples[i].place() < goal.t)
        reached = i, slope = cone.middle();
    }
    const double direct = (goal.height - from.height) / double(goal.t - from.t);
    if (open && direct >= cone.lo && direct <= cone.hi) break;
    // Not in one go: a vertex at the farthest sample that the cone reached (the next sample at
    // least: a single sample always fits).
    if (reached == at) break;
    const int place = samples[reached].place();
    line.push_back({place, snap_height(from.height + slope * (place - from.t), step)});
    at = reached;
  }
  line.push_back(goal);
}

}  // namespace

TileEdge tile_edge(TileId tile, Side side) {
  GeoRect r = tiling::rect(tile);
  if (side == Side::east && r.east == 180) r.east = -180;  // the antimeridian is one line
  switch (side) {
    case Side::west:
      return {{r.west, r.south}, {r.west, r.north}};
    case Side::south:
      return {{r.west, r.south}, {r.east, r.south}};
    case Side::east:
      return {{r.east, r.south}, {r.east, r.north}};
    case Side::north:
      return {{r.west, r.north}, {r.east, r.north}};
  }
  return {};
}

std::vector<BorderVertex> make_border(const TileEdge& edge, const HeightField& field,
                                      const DemSource& source, const BorderOptions& o) {
  const std::vector<double> places = sample_places(edge, source, o);
  std::vector<Geographic> points;
  for (const double t : places) points.push_back(along(edge, t));
  std::vector<double> heights(points.size());
  field.filled(points, heights);  // so that levels agree in voids, too

  std::vector<Sample> samples;
  for (std::size_t i = 0; i < places.size(); ++i)
    samples.push_back({places[i], heights[i] + o.offset_m, false});
  for (int k = 0; k <= o.fixed_cells; ++k) {
    const double t = std::round(double(k) * kTileExtent / o.fixed_cells);
    for (Sample& s : samples) s.fixed |= s.t == t;
  }
  // Snapping moves a vertex by half a step; two snapped ends move the line by as much.
  const double tolerance = std::max(o.tolerance_m - o.height_step, o.height_step / 2);
  auto fixed_height = [&](std::size_t i) { return snap_height(samples[i].h, o.height_step); };
  std::vector<BorderVertex> line = {{0, fixed_height(0)}};
  std::size_t begin = 0;
  for (std::size_t i = 1; i < samples.size(); ++i) {
    if (!samples[i].fixed) continue;
    run_to(line, samples, begin, i, fixed_height(i), tolerance, o.height_step);
    begin = i;
  }
  return line;
}

}  // namespace tind
