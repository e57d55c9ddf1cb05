#include "server/api/ogc/edr_places.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "server/api/elevation/places.h"
#include "terrain/geo/geodesic_path.h"
#include "terrain/geo/longitude.h"

namespace tind::api::ogc {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr double kMost = double(kMostPlaces);

using Wrong = http::ParameterProblem;
using Places = std::expected<EdrPlaces, Wrong>;

std::vector<Vec2> points_of(const proto::WktLine& line, const AskedCrs& crs) {
  std::vector<Vec2> points;
  for (const auto& p : line) points.push_back(crs.point(p));
  return points;
}

std::unexpected<Wrong> no_place(const AskedCrs& crs) {
  return std::unexpected(Wrong{"coords", "has a place that " + crs.name() +
                                             " does not have (its axes are " +
                                             (crs.east_first() ? "east, north)" : "north, east)")});
}

bool all_there(std::span<const Geographic> places) {
  return std::ranges::none_of(places, [](const Geographic& p) { return std::isnan(p.lon); });
}

std::unexpected<Wrong> too_many(const char* parameter) {
  return std::unexpected(Wrong{parameter, "makes more than " + std::to_string(kMostPlaces) +
                                              " places; ask for fewer, or for 0"});
}

Places at_points(const EdrQuery& query, const AskedCrs& crs) {
  EdrPlaces places;
  places.points = points_of(query.coords.parts[0][0], crs);
  places.where = crs.to_geographic(places.points);
  if (!all_there(places.where)) return no_place(crs);
  return places;
}

/// The ways of all lines of a query.
std::expected<std::vector<GeodesicPath>, Wrong> paths_of(const EdrQuery& query,
                                                         const AskedCrs& crs) {
  std::vector<GeodesicPath> paths;
  for (const proto::WktLine& line : query.coords.parts[0]) {
    const auto where = crs.to_geographic(points_of(line, crs));
    if (!all_there(where)) return no_place(crs);
    paths.emplace_back(where);
    if (!(paths.back().length_m() > 0))
      return std::unexpected(Wrong{"coords", "has a line of no length"});
  }
  return paths;
}

double length_of(const std::vector<GeodesicPath>& paths) {
  double metres = 0;
  for (const GeodesicPath& path : paths) metres += path.length_m();
  return metres;
}

/// What a line's own places cut it into, each piece in steps of at most that.
std::vector<double> steps_along(const GeodesicPath& path, double step_m) {
  const auto reached = path.reached_m();
  std::vector<double> at = {0};
  for (std::size_t i = 1; i < reached.size(); ++i) {
    const double piece = reached[i] - reached[i - 1];
    const int count = std::max(1, int(std::ceil(piece / step_m)));
    for (int k = 1; k < count; ++k) at.push_back(reached[i - 1] + piece * k / count);
    at.push_back(reached[i]);
  }
  return at;
}

void add_points(EdrPlaces& places, const AskedCrs& crs) {
  places.points.resize(places.where.size());
  crs.from_geographic(places.where, places.points);
  if (crs.turn() == 0) return;
  // Across the antimeridian they go on.
  for (std::size_t i = 1; i < places.points.size(); ++i) {
    double& x = places.points[i].x;
    const double near = nearest_turn(x, places.points[i - 1].x, crs.turn());
    if (std::isfinite(near)) x = near;
  }
}

Places along_lines(const EdrQuery& query, const AskedCrs& crs, double spacing_m) {
  const auto paths = paths_of(query, crs);
  if (!paths) return std::unexpected(paths.error());
  if (double(query.along) * double(paths->size()) > kMost) return too_many("resolution-x");
  // The places of lines themselves are fewer than a thousand by the length of a request.
  const double step = std::max(spacing_m, length_of(*paths) / (kMost / 2));
  EdrPlaces places;
  for (const GeodesicPath& path : *paths) {
    places.lines.push_back(places.where.size());
    if (query.along > 1)
      for (const Geographic& p : path.evenly(std::size_t(query.along))) places.where.push_back(p);
    else
      for (const double metres : steps_along(path, step)) places.where.push_back(path.at(metres));
  }
  add_points(places, crs);
  return places;
}

/// How many places there are from one end to the other.
int count_of(double length, double step) {
  return int(std::min(std::ceil(length / step) + 1, kMost));
}

Places beside_lines(const EdrQuery& query, const AskedCrs& crs, double spacing_m) {
  const auto paths = paths_of(query, crs);
  if (!paths) return std::unexpected(paths.error());
  // As dense as the data, unless that makes too many.
  const double area = (length_of(*paths) + spacing_m) * (query.width_m + spacing_m);
  const double step = std::max(spacing_m, 2 * std::sqrt(area / kMost));
  const int across = query.across > 0 ? query.across : std::max(2, count_of(query.width_m, step));
  std::vector<int> along;
  double all = 0;
  for (const GeodesicPath& path : *paths) {
    along.push_back(query.along > 0 ? query.along : std::max(2, count_of(path.length_m(), step)));
    all += double(along.back()) * across;
  }
  if (all > kMost) return too_many(query.along > 0 ? "resolution-x" : "resolution-y");
  EdrPlaces places;
  for (std::size_t n = 0; n < paths->size(); ++n)
    for (int i = 0; i < along[n]; ++i)
      for (int j = 0; j < across; ++j) {
        const double ahead = along[n] > 1 ? double(i) / (along[n] - 1) : 0;
        const double right = across > 1 ? double(j) / (across - 1) - .5 : 0;
        places.where.push_back(
            (*paths)[n].beside(ahead * (*paths)[n].length_m(), right * query.width_m));
      }
  add_points(places, crs);
  return places;
}

double axis_at(const proto::CoverageAxis& axis, int i) {
  if (i > 0 && i == axis.count - 1) return axis.last;  // to the last digit: it lies on the rim
  return axis.first + (axis.last - axis.first) * i / std::max(1, axis.count - 1);
}

/// The axes of a grid over a rectangle, whose ends are the rectangle's.
std::expected<EdrPlaces, Wrong> grid_over(const EdrQuery& query, const AskedCrs& crs,
                                          const CrsBox& box, double spacing_m, const char* of) {
  const Vec2 ground = ground_m(crs, box);
  if (!(ground.x > 0 && ground.y > 0))
    return std::unexpected(Wrong{of, no_place(crs).error().detail});
  const double area = (ground.x + spacing_m) * (ground.y + spacing_m);
  const double step = std::max(spacing_m, 1.5 * std::sqrt(area / kMost));
  int cols = query.along > 0 ? query.along : count_of(ground.x, step);
  int rows = query.across > 0 ? query.across : count_of(ground.y, step);
  // Of a strip that is thinner than a step, or where one of the two was asked for.
  if (query.along == 0) cols = int(std::min(double(cols), std::floor(kMost / rows)));
  if (query.across == 0) rows = int(std::min(double(rows), std::floor(kMost / cols)));
  if (double(cols) * rows > kMost) return too_many("resolution-x");
  EdrPlaces places;
  places.grid = true;
  const double x = (box.west + box.east) / 2, y = (box.south + box.north) / 2;
  places.x =
      cols == 1 ? proto::CoverageAxis{x, x, 1} : proto::CoverageAxis{box.west, box.east, cols};
  places.y =
      rows == 1 ? proto::CoverageAxis{y, y, 1} : proto::CoverageAxis{box.north, box.south, rows};
  return places;
}

/// All of a grid's places, row by row; `inside`: spans of x of a row.
template <class Inside>
void fill_grid(EdrPlaces& places, const AskedCrs& crs, const Inside& inside) {
  std::vector<Vec2> row(std::size_t(places.x.count));
  for (int j = 0; j < places.y.count; ++j) {
    const double y = axis_at(places.y, j);
    for (int i = 0; i < places.x.count; ++i) row[std::size_t(i)] = {axis_at(places.x, i), y};
    auto where = crs.to_geographic(row);
    const auto spans = inside(y);
    for (std::size_t i = 0; i < where.size(); ++i)
      if (std::ranges::none_of(
              spans, [&](const auto& s) { return row[i].x >= s.first && row[i].x <= s.second; }))
        where[i] = {kNaN, kNaN};
    places.where.insert(places.where.end(), where.begin(), where.end());
  }
}

Places over_area(const EdrQuery& query, const AskedCrs& crs, double spacing_m) {
  std::vector<std::vector<std::vector<Vec2>>> polygons;
  CrsBox box{HUGE_VAL, HUGE_VAL, -HUGE_VAL, -HUGE_VAL};
  for (const auto& part : query.coords.parts) {
    auto& rings = polygons.emplace_back();
    for (const proto::WktLine& line : part) {
      rings.push_back(points_of(line, crs));
      for (const Vec2& p : rings.back())
        box = {std::min(box.west, p.x), std::min(box.south, p.y), std::max(box.east, p.x),
               std::max(box.north, p.y)};
    }
  }
  if (!(box.width() > 0 && box.height() > 0))
    return std::unexpected(Wrong{"coords", "has an area of no size"});
  auto places = grid_over(query, crs, box, spacing_m, "coords");
  if (!places) return places;
  fill_grid(*places, crs, [&](double y) {
    std::vector<std::pair<double, double>> all;
    for (const auto& rings : polygons) {
      const auto spans = spans_inside(rings, y);
      all.insert(all.end(), spans.begin(), spans.end());
    }
    return all;
  });
  return places;
}

Places over_box(const EdrQuery& query, const AskedCrs& crs, double spacing_m) {
  const auto box = crs.box(query.bbox);
  if (!box) return std::unexpected(Wrong{"bbox", box.error().what});
  auto places = grid_over(query, crs, *box, spacing_m, "bbox");
  if (!places) return places;
  fill_grid(*places, crs, [](double) {
    return std::vector<std::pair<double, double>>{{-HUGE_VAL, HUGE_VAL}};
  });
  return places;
}

}  // namespace

double spacing_m(const services::ServedDataset& dataset) {
  if (dataset.source) {
    const DemInfo& info = dataset.source->info();
    return std::min(info.spacing_x_m, info.spacing_y_m);
  }
  // Of meshes alone: what a client's own grid of a tile would have.
  constexpr double kDegree_m = 111320, kCells = 64;
  return tiling::tile_degrees(dataset.tiles->layer().maxzoom) * kDegree_m / kCells;
}

/// Even-odd. A place where an edge ends counts for one of the two edges, but both ends of the span
/// are inside, and so are edges along the row.
std::vector<std::pair<double, double>> spans_inside(const std::vector<std::vector<Vec2>>& rings,
                                                    double y) {
  std::vector<double> crossings;
  std::vector<std::pair<double, double>> spans;
  for (const auto& ring : rings)
    for (std::size_t i = 1; i < ring.size(); ++i) {
      const Vec2 &a = ring[i - 1], &b = ring[i];
      if (a.y == y && b.y == y) spans.emplace_back(std::min(a.x, b.x), std::max(a.x, b.x));
      if ((a.y <= y) != (b.y <= y)) {  // the same whichever way the ring runs
        const Vec2 &low = a.y < b.y ? a : b, &high = a.y < b.y ? b : a;
        crossings.push_back(low.x + (y - low.y) / (high.y - low.y) * (high.x - low.x));
      }
      if (a.y == y) spans.emplace_back(a.x, a.x);
    }
  std::ranges::sort(crossings);
  for (std::size_t i = 1; i < crossings.size(); i += 2)
    spans.emplace_back(crossings[i - 1], crossings[i]);
  return spans;
}

std::expected<EdrPlaces, http::ParameterProblem> edr_places(const EdrQuery& query,
                                                            const AskedCrs& crs, double spacing_m) {
  switch (query.shape) {
    case EdrShape::position:
      return at_points(query, crs);
    case EdrShape::trajectory:
      return along_lines(query, crs, spacing_m);
    case EdrShape::corridor:
      return beside_lines(query, crs, spacing_m);
    case EdrShape::area:
      return over_area(query, crs, spacing_m);
    case EdrShape::cube:
      break;
  }
  return over_box(query, crs, spacing_m);
}

}  // namespace tind::api::ogc
