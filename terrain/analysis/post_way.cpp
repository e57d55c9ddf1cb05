// Nodes are doubled until the curve in the middle of each piece lies on the piece's own middle. A
// smooth curve is farthest from its chord there, but for terms of a higher order.

#include "terrain/analysis/post_way.h"

#include <cmath>

namespace tind {
namespace {

constexpr std::size_t kMostPieces = std::size_t(1) << 22;

/// As place_among_posts() has it: PROJ there and back is not exact, and a place on the DEM's rim is
/// not beyond it.
Vec2 snapped(Vec2 p) {
  for (double* x : {&p.x, &p.y})
    if (std::abs(*x - std::round(*x)) <= 1e-6) *x = std::round(*x);
  return p;
}

struct Nodes {
  std::vector<WayNode> all;  // 2n + 1: those in between are middles
  bool straight = true;      // every middle lies on its piece
};

Result<Nodes> nodes_of(const DemSource& dem, const Curve& curve, std::size_t pieces,
                       double tolerance) {
  const std::size_t count = 2 * pieces + 1;
  std::vector<double> shares(count);
  for (std::size_t i = 0; i < count; ++i) shares[i] = double(i) / double(count - 1);
  std::vector<Geographic> places(count);
  curve(shares, places);
  std::vector<Vec2> posts(count);
  dem.to_post(places, posts);
  const double period = dem.info().wraps_longitude ? dem.info().period_cols : 0;
  Nodes nodes;
  for (std::size_t i = 0; i < count; ++i) {
    if (!std::isfinite(posts[i].x) || !std::isfinite(posts[i].y))
      return fail(Errc::invalid_argument,
                  "the line goes where the projection of the DEM knows no places");
    if (period > 0 && i > 0)
      posts[i].x = posts[i - 1].x + std::remainder(posts[i].x - posts[i - 1].x, period);
    nodes.all.push_back({shares[i], snapped(posts[i])});
  }
  for (std::size_t i = 1; i < count && nodes.straight; i += 2) {
    const Vec2 &a = posts[i - 1], &m = posts[i], &b = posts[i + 1];
    nodes.straight = std::hypot(m.x - (a.x + b.x) / 2, m.y - (a.y + b.y) / 2) <= tolerance;
  }
  return nodes;
}

}  // namespace

Result<std::vector<WayNode>> straight_pieces(const DemSource& dem, const Curve& curve,
                                             double tolerance_posts, std::size_t pieces) {
  if (dem.info().crs_kind == CrsKind::none)
    return fail(Errc::invalid_argument, dem.info().files[0] +
                                            ": has no CRS, so it is not known where a line on the "
                                            "globe lies in it: say its CRS (--crs)");
  for (;; pieces *= 2) {
    auto nodes = nodes_of(dem, curve, pieces, tolerance_posts);
    if (!nodes) return std::unexpected(nodes.error());
    if (!nodes->straight && pieces < kMostPieces) continue;
    std::vector<WayNode> out;
    for (std::size_t i = 0; i < nodes->all.size(); i += 2) out.push_back(nodes->all[i]);
    return out;
  }
}

}  // namespace tind
