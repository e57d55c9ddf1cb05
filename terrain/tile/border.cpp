#include "terrain/tile/border.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "terrain/simplify/insertion/delaunay_insertion.h"
#include "terrain/surface/post_warp.h"

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

/// Of one layer. False: not all of them, which are too many or not known (its posts are on no lines
/// of longitude and latitude).
bool add_crossings(const TileEdge& e, const DemSource& source, const BorderOptions& o,
                   Crossings& found) {
  const DemInfo& info = source.info();
  const Affine& grid = info.post_to_crs;
  if (!source.is_plain_geographic() || grid.x_row != 0 || grid.y_col != 0) return false;
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
    return true;
  }
  const double last = double((northward ? info.rows : info.cols) - 1);
  for (const double shift : {0.0, 360.0, -360.0}) {
    if (shift != 0 && northward) break;
    for (const double past : {0, VoidFill::kFlat, VoidFill::kReach})
      for (const double post : {-past, last + past})
        add(found.of_bounds, origin + post * signed_step + shift);
  }
  return false;
}

Crossings crossings(const TileEdge& e, const Surface& surface, const BorderOptions& o) {
  Crossings found;
  if (const DemSource* dem = surface.only()) {
    add_crossings(e, *dem, o, found);
    return found;
  }
  const GeoRect edge{e.start.lon, e.start.lat, e.end.lon, e.end.lat};
  bool known = true;
  for (std::size_t k = 0; k < surface.layers().size(); ++k) {
    if (!surface.reaches(k, edge)) continue;
    Crossings of_layer;
    known = add_crossings(e, *surface.layers()[k].source, o, of_layer) && known;
    found.all.insert(found.all.end(), of_layer.all.begin(), of_layer.all.end());
    found.of_bounds.insert(found.of_bounds.end(), of_layer.of_bounds.begin(),
                           of_layer.of_bounds.end());
  }
  if (known) return found;
  // H bends at the lines of some layer only: they are places among others.
  found.of_bounds.insert(found.of_bounds.end(), found.all.begin(), found.all.end());
  found.all.clear();
  return found;
}

/// Where a level looks at H. Between crossings H is linear: there the ends and the crossings
/// say all.
EdgeProfile places_of(const TileEdge& e, const Surface& surface, const BorderOptions& o,
                      const std::vector<BorderSample>& lines) {
  EdgeProfile profile;
  Crossings found = crossings(e, surface, o);
  profile.whole = !found.all.empty();
  std::vector<double>& places = profile.at = std::move(found.all);
  const int even = profile.whole ? o.fixed_cells : o.samples;
  for (int i = 0; i <= even; ++i) places.push_back(std::round(double(i) * kTileExtent / even));
  places.insert(places.end(), found.of_bounds.begin(), found.of_bounds.end());
  for (const BorderSample& line : lines) places.push_back(line.t);
  std::sort(places.begin(), places.end());
  places.erase(std::unique(places.begin(), places.end()), places.end());
  return profile;
}

void ask_heights(EdgeProfile& profile, const TileEdge& e, const HeightField& field,
                 const BorderOptions& o, const std::vector<BorderSample>& lines) {
  std::vector<Geographic> points;
  points.reserve(profile.at.size());
  for (const double t : profile.at) points.push_back(along(e, t));
  profile.h.resize(points.size());
  field.filled(points, profile.h);  // so that levels agree in voids, too
  for (double& h : profile.h) h = std::clamp(h, o.lowest_m, o.highest_m);
  std::size_t i = 0;
  for (const BorderSample& line : lines) {
    if (std::isnan(line.height)) continue;
    while (profile.at[i] < line.t) ++i;
    profile.h[i] = line.height;
  }
}

struct Sample {
  double t;
  double h;
  bool fixed;
  int at = -1;                                                      // where a vertex has to stand
  int place() const { return at >= 0 ? at : int(std::lround(t)); }  // where it can
};

std::vector<Sample> samples_of(const EdgeProfile& own, const EdgeProfile* halves, double offset) {
  std::vector<Sample> samples;
  for (const EdgeProfile* p : {&own, halves})
    for (std::size_t i = 0; p && i < p->at.size(); ++i)
      samples.push_back({p->at[i], p->h[i] + offset, false, -1});
  std::stable_sort(samples.begin(), samples.end(),
                   [](const Sample& a, const Sample& b) { return a.t < b.t; });
  const auto same = std::unique(samples.begin(), samples.end(),
                                [](const Sample& a, const Sample& b) { return a.t == b.t; });
  samples.erase(same, samples.end());
  return samples;
}

/// The largest difference of two lines: at the ends of the pieces of either.
double distance(const EdgeProfile& a, const EdgeProfile& b) {
  double worst = 0;
  for (std::size_t i = 0; i < a.at.size(); ++i)
    worst = std::max(worst, std::abs(a.h[i] - b.height(a.at[i])));
  for (std::size_t i = 0; i < b.at.size(); ++i)
    worst = std::max(worst, std::abs(b.h[i] - a.height(b.at[i])));
  return worst;
}

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
            std::size_t end, double end_height, double tolerance, const BorderOptions& o) {
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
    // A slope by samples that lie closer together than vertices may leads anywhere from there.
    const auto [low, high] = std::minmax_element(
        samples.begin() + std::ptrdiff_t(at), samples.begin() + std::ptrdiff_t(reached) + 1,
        [](const Sample& a, const Sample& b) { return a.h < b.h; });
    const double lowest = low->h - tolerance, highest = high->h + tolerance;
    int place = samples[reached].place() / o.place_step * o.place_step;
    if (place > from.t) {  // samples behind it are the next piece's
      while (samples[reached].t > place) --reached;
    } else {
      place = samples[reached].place();
    }
    const double height = std::clamp(from.height + slope * (place - from.t), lowest, highest);
    line.push_back({place, snap_height(height, o.height_step)});
    at = reached;
  }
  line.push_back(goal);
}

}  // namespace

double EdgeProfile::height(double t) const {
  const auto after = std::upper_bound(at.begin(), at.end(), t);
  const std::size_t i = std::clamp<std::size_t>(std::size_t(after - at.begin()), 1, at.size() - 1);
  return h[i - 1] + (t - at[i - 1]) / (at[i] - at[i - 1]) * (h[i] - h[i - 1]);
}

EdgeProfile joined(const EdgeProfile& first, const EdgeProfile& second) {
  EdgeProfile both;
  both.whole = first.whole && second.whole;
  for (const auto& [half, p] : {std::pair{0, &first}, {1, &second}})
    for (std::size_t i = std::size_t(half); i < p->at.size(); ++i) {  // the middle once
      both.at.push_back((p->at[i] + half * kTileExtent) / 2);
      both.h.push_back(p->h[i]);
    }
  return both;
}

TileEdge tile_edge(TileId tile, TileSide side) {
  GeoRect r = tiling::rect(tile);
  if (side == TileSide::east && r.east == 180) r.east = -180;  // the antimeridian is one line
  switch (side) {
    case TileSide::west:
      return {{r.west, r.south}, {r.west, r.north}};
    case TileSide::south:
      return {{r.west, r.south}, {r.east, r.south}};
    case TileSide::east:
      return {{r.east, r.south}, {r.east, r.north}};
    case TileSide::north:
      return {{r.west, r.north}, {r.east, r.north}};
  }
  return {};
}

EdgeProfile halves_of(const TileEdge& e, const HeightField& field, const Surface& surface,
                      const BorderOptions& o) {
  const Geographic middle{(e.start.lon + e.end.lon) / 2, (e.start.lat + e.end.lat) / 2};
  EdgeProfile halves[2];
  for (const int half : {0, 1}) {
    const TileEdge part = half == 0 ? TileEdge{e.start, middle} : TileEdge{middle, e.end};
    const auto& lines = o.crossings_of_half[half];
    BorderOptions next = o;
    if (o.samples_of_half[half] > 0) next.samples = o.samples_of_half[half];
    halves[half] = places_of(part, surface, next, lines);
    ask_heights(halves[half], part, field, next, lines);
  }
  return joined(halves[0], halves[1]);
}

Border make_border(const TileEdge& edge, const HeightField& field, const Surface& surface,
                   const BorderOptions& o) {
  EdgeProfile own = places_of(edge, surface, o, o.crossings), halves;
  ask_heights(own, edge, field, o, o.crossings);
  if (o.halves) halves = halves_of(edge, field, surface, o);
  // The next level may have lines that this one does not.
  const bool more = o.halves && !(own.whole && halves.whole && o.crossings_of_half[0].empty() &&
                                  o.crossings_of_half[1].empty());
  return make_border(own, more ? &halves : nullptr, o);
}

Border make_border(const EdgeProfile& own, const EdgeProfile* halves, const BorderOptions& o) {
  std::vector<Sample> samples = samples_of(own, halves, o.offset_m);
  for (int k = 0; k <= o.fixed_cells; ++k) {
    const double t = std::round(double(k) * kTileExtent / o.fixed_cells);
    if (std::ranges::any_of(o.lines, [&](const auto& line) { return line.t == t; })) continue;
    for (Sample& s : samples) s.fixed |= s.t == t;
  }
  // Snapping moves a vertex by half a step; two snapped ends move the line by as much.
  const double tolerance = std::max(o.tolerance_m - o.height_step, o.height_step / 2);
  for (const BorderOptions::LineVertex& line : o.lines)
    for (Sample& s : samples) {
      if (s.t != line.crossing) continue;
      s.fixed = true, s.at = line.t;
      if (!std::isnan(line.height))
        s.h = std::clamp(line.height + o.offset_m, s.h - tolerance / 2, s.h + tolerance / 2);
    }
  auto fixed_height = [&](std::size_t i) {
    const double at_end = i == 0 ? o.step_at_start : i + 1 == samples.size() ? o.step_at_end : 0;
    return snap_height(samples[i].h, at_end > 0 ? at_end : o.height_step);
  };
  Border border;
  border.line = {{0, fixed_height(0)}};
  std::size_t begin = 0;
  for (std::size_t i = 1; i < samples.size(); ++i) {
    if (!samples[i].fixed) continue;
    run_to(border.line, samples, begin, i, fixed_height(i), tolerance, o);
    begin = i;
  }
  EdgeProfile line;
  for (const BorderVertex& v : border.line) line.at.push_back(v.t), line.h.push_back(v.height);
  border.error_m = distance(line, own);
  if (halves) border.error_m = std::max(border.error_m, distance(line, *halves));
  return border;
}

}  // namespace tind
