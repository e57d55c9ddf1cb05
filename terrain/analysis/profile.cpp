// The exact one walks over the grid (grid_walk.h) piece by piece. Each piece is a parabola: its
// ends and its turn are points. So are the ends of each leg where there is ground, also where no
// piece of it has a height.

#include "terrain/analysis/profile.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "terrain/analysis/grid_walk.h"
#include "terrain/analysis/heights_at.h"
#include "terrain/analysis/post_reader.h"
#include "terrain/analysis/post_way.h"
#include "terrain/analysis/profile_points.h"
#include "terrain/raster/interpolate.h"
#include "terrain/raster/post_place.h"

namespace tind {
namespace {

/// A part of the line that is straight among the posts.
struct Straight {
  double from_m, to_m;
  double at(double t) const { return from_m + (to_m - from_m) * t; }
};

void take_piece(const WalkPiece& piece, const Straight& way, ProfilePoints& points) {
  if (piece.is_void) return points.nothing_from(way.at(piece.from));
  const Parabola& z = piece.height;
  points.ground(way.at(piece.from), z.at(piece.from));
  const double turn = z.c == 0 ? piece.from : -z.b / (2 * z.c);
  if (turn > piece.from && turn < piece.to) points.ground(way.at(turn), z.at(turn));
  points.ground(way.at(piece.to), z.at(piece.to));
}

/// Shares of a straight way.
struct Part {
  double from = 0, to = 1;
};

/// What of a straight way among the posts can have heights; nothing: none of it.
std::optional<Part> part_on(const DemInfo& info, Vec2 from, Vec2 to) {
  Part part;
  const auto clip = [&](double a, double b, double low, double high) {
    if (a == b) return a >= low && a <= high;
    const double t = (low - a) / (b - a), u = (high - a) / (b - a);
    part.from = std::max(part.from, std::min(t, u));
    part.to = std::min(part.to, std::max(t, u));
    return part.from < part.to;
  };
  if (!clip(from.y, to.y, -1, double(info.rows))) return {};
  if (!info.wraps_longitude && !clip(from.x, to.x, -1, double(info.cols))) return {};
  return part;
}

/// A leg can begin or end where there is ground and none beside: on the DEM's rim, at a post among
/// voids. No piece of the way has the height that is there.
void take_place(double metres, Vec2 post, const DemInfo& info, PostReader& posts,
                ProfilePoints& points) {
  const auto at = place_among_posts(info, post);
  if (!at) return;
  const double c = std::floor(at->x), r = std::floor(at->y);
  const auto col = std::int64_t(c), row = std::int64_t(r);
  const double z = height_between(posts(col, row), posts(col + 1, row), posts(col, row + 1),
                                  posts(col + 1, row + 1), at->x - c, at->y - r);
  if (!std::isnan(z)) points.ground(metres, z);
}

Result<void> walk_leg(const DemSource& dem, const GeodesicPath& path, double from_m, double to_m,
                      PostReader& posts, ProfilePoints& points, const std::stop_token& stop) {
  const Curve curve = [&](std::span<const double> shares, std::span<Geographic> places) {
    for (std::size_t i = 0; i < shares.size(); ++i)
      places[i] = path.at(from_m + (to_m - from_m) * shares[i]);
  };
  const auto pieces = straight_pieces(dem, curve, kProfileTolerance_posts);
  if (!pieces) return std::unexpected(pieces.error());
  for (const WayPiece& p : *pieces) {
    if (stop.stop_requested()) return fail(Errc::cancelled, "stopped");
    const double length = to_m - from_m;
    const Straight way{from_m + length * p.from_share, from_m + length * p.to_share};
    if (&p == &pieces->front()) take_place(way.from_m, p.from, dem.info(), posts, points);
    const auto part = part_on(dem.info(), p.from, p.to);
    if (!part || part->from > 0) points.nothing_from(way.at(0));
    if (!part) continue;  // cells by the million, where the DEM is not
    const Straight on{way.at(part->from), way.at(part->to)};
    const auto at = [&](double share) {
      return Vec2{p.from.x + (p.to.x - p.from.x) * share, p.from.y + (p.to.y - p.from.y) * share};
    };
    const Vec2 first = part->from > 0 ? at(part->from) : p.from,
               last = part->to < 1 ? at(part->to) : p.to;
    walk_grid(first, last, posts, [&](const WalkPiece& piece) {
      take_piece(piece, on, points);
      return points.size() <= kMostProfilePoints;
    });
    if (part->to < 1) points.nothing_from(way.at(part->to));
    if (posts.error()) return std::unexpected(*posts.error());
    if (points.size() > kMostProfilePoints)
      return fail(Errc::out_of_range,
                  "the line crosses the DEM's grid more than a million times: ask for samples, or "
                  "for a shorter line");
  }
  if (!pieces->empty() && pieces->back().to_share == 1)
    take_place(to_m, pieces->back().to, dem.info(), posts, points);
  if (posts.error()) return std::unexpected(*posts.error());
  return {};
}

/// Beyond the outermost posts is outside; where the line is among them, a gap is a void.
void tell_voids_from_outside(const DemSource& dem, Profile& profile) {
  std::vector<Geographic> places;
  places.reserve(profile.points.size());
  for (const ProfilePoint& p : profile.points) places.push_back(p.place);
  std::vector<Vec2> posts(places.size());
  dem.to_post(places, posts);
  const DemInfo& info = dem.info();
  for (std::size_t i = 0; i < posts.size(); ++i) {
    HeightAt& height = profile.points[i].height;
    const Vec2& p = posts[i];
    const bool inside = p.y >= 0 && p.y <= double(info.rows - 1) &&
                        (info.wraps_longitude || (p.x >= 0 && p.x <= double(info.cols - 1)));
    if (height.coverage == Coverage::void_ && !inside) height.coverage = Coverage::outside;
  }
}

}  // namespace

std::vector<double> even_distances(double length_m, std::size_t count) {
  std::vector<double> out;
  for (std::size_t i = 0; i + 1 < count; ++i)
    out.push_back(length_m * double(i) / double(count - 1));
  out.push_back(length_m);
  return out;
}

std::vector<double> stepped_distances(double length_m, double step_m) {
  std::vector<double> out;
  for (std::size_t i = 0; double(i) * step_m < length_m - ProfilePoints::kSame_m; ++i)
    out.push_back(double(i) * step_m);
  out.push_back(length_m);
  return out;
}

Result<Profile> sampled_profile(const DemSource& dem, const GeodesicPath& path,
                                std::vector<double> distances, const std::stop_token& stop) {
  std::vector<Geographic> places;
  places.reserve(distances.size());
  for (const double metres : distances) places.push_back(path.at(metres));
  const auto heights = heights_at(Surface(dem), places, Interpolation::bilinear, stop);
  if (!heights) return std::unexpected(heights.error());
  Profile out{path.length_m(), {}};
  for (std::size_t i = 0; i < distances.size(); ++i)
    out.points.push_back({distances[i], places[i], (*heights)[i].height});
  return out;
}

Result<Profile> exact_profile(const DemSource& dem, const GeodesicPath& path,
                              const std::stop_token& stop) {
  PostReader posts(dem);
  ProfilePoints points(path);
  const auto reached = path.reached_m();
  for (std::size_t i = 1; i < reached.size(); ++i)
    if (reached[i] > reached[i - 1])
      if (auto done = walk_leg(dem, path, reached[i - 1], reached[i], posts, points, stop); !done)
        return std::unexpected(done.error());
  Profile out{path.length_m(), points.taken()};
  tell_voids_from_outside(dem, out);
  return out;
}

}  // namespace tind
