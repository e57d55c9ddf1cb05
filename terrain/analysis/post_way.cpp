// Pieces become three until the curve at their thirds lies on them. There a smooth curve is nearly
// as far from its chord as anywhere: 8/9 of it where it bends one way, 3/4 where it turns in the
// middle, at which it would lie on the chord.

#include "terrain/analysis/post_way.h"

#include <cmath>
#include <utility>

namespace tind {
namespace {

constexpr double kAtThirds = 0.75;  // of the farthest
/// What is not straight after so many rounds is no curve there: a meridian that goes on behind a
/// pole.
constexpr int kMostRounds = 15;

/// As place_among_posts() has it: PROJ there and back is not exact, and a place on the DEM's rim is
/// not beyond it.
Vec2 snapped(Vec2 p) {
  for (double* x : {&p.x, &p.y})
    if (std::abs(*x - std::round(*x)) <= 1e-6) *x = std::round(*x);
  return p;
}

struct Node {
  double share = 0;
  Vec2 post;
};

class Pieces {
 public:
  Pieces(const DemSource& dem, const Curve& curve, double tolerance)
      : dem_(dem),
        curve_(curve),
        tolerance_(kAtThirds * tolerance),
        period_(dem.info().period_cols) {}

  struct Piece {
    Node from, to;
    bool straight = false;
  };

  /// In order.
  Result<std::vector<Piece>> run(std::size_t first_pieces) {
    // Nodes and thirds at once: most curves are straight enough at the first look.
    std::vector<double> shares(3 * first_pieces + 1);
    for (std::size_t i = 0; i < shares.size(); ++i)
      shares[i] = double(i) / double(shares.size() - 1);
    const auto nodes = nodes_at(shares);
    if (!nodes) return std::unexpected(nodes.error());
    std::vector<Piece> pieces;
    pieces.reserve(first_pieces);
    bool all = true;
    for (std::size_t i = 3; i < nodes->size(); i += 3)
      all &= judge((*nodes)[i - 3], (*nodes)[i - 2], (*nodes)[i - 1], (*nodes)[i], pieces);
    for (int round = 1; !all && round < kMostRounds; ++round) {
      auto next = divided(pieces, all);
      if (!next) return std::unexpected(next.error());
      pieces = std::move(*next);
    }
    std::erase_if(pieces, [](const Piece& p) { return !p.straight; });
    return pieces;
  }

 private:
  const DemSource& dem_;
  const Curve& curve_;
  const double tolerance_, period_;

  Result<std::vector<Node>> nodes_at(const std::vector<double>& shares) const {
    std::vector<Geographic> places(shares.size());
    curve_(shares, places);
    std::vector<Vec2> posts(shares.size());
    dem_.to_post(places, posts);
    std::vector<Node> nodes;
    nodes.reserve(shares.size());
    for (std::size_t i = 0; i < shares.size(); ++i) {
      if (!std::isfinite(posts[i].x) || !std::isfinite(posts[i].y))
        return fail(Errc::invalid_argument,
                    "the line goes where the projection of the DEM knows no places");
      nodes.push_back({shares[i], snapped(posts[i])});
    }
    return nodes;
  }

  /// Columns of a DEM in degrees count around the globe.
  Vec2 beside(Vec2 p, Vec2 other) const {
    if (period_ > 0) p.x = other.x + std::remainder(p.x - other.x, period_);
    return p;
  }
  bool lies_on(Vec2 p, Vec2 a, Vec2 b, double part) const {
    return std::hypot(p.x - (a.x + part * (b.x - a.x)), p.y - (a.y + part * (b.y - a.y))) <=
           tolerance_;
  }

  /// One piece where its thirds lie on it, else three. Is it one?
  bool judge(const Node& from, const Node& first, const Node& second, const Node& to,
             std::vector<Piece>& out) const {
    const Vec2 a = from.post, one = beside(first.post, a), two = beside(second.post, one),
               b = beside(to.post, two);
    if (lies_on(one, a, b, 1.0 / 3) && lies_on(two, a, b, 2.0 / 3)) {
      out.push_back({from, {to.share, b}, true});
      return true;
    }
    out.insert(out.end(), {{from, first}, {first, second}, {second, to}});
    return false;
  }

  Result<std::vector<Piece>> divided(const std::vector<Piece>& pieces, bool& all_straight) const {
    std::vector<double> shares;
    for (const Piece& p : pieces)
      for (const double part : {1.0 / 3, 2.0 / 3})
        if (!p.straight) shares.push_back(p.from.share + part * (p.to.share - p.from.share));
    const auto thirds = nodes_at(shares);
    if (!thirds) return std::unexpected(thirds.error());
    std::vector<Piece> next;
    std::size_t at = 0;
    all_straight = true;
    for (const Piece& p : pieces) {
      if (p.straight) {
        next.push_back(p);
        continue;
      }
      all_straight &= judge(p.from, (*thirds)[at], (*thirds)[at + 1], p.to, next);
      at += 2;
    }
    return next;
  }
};

/// A DEM of a part of the globe is met in the turn where it lies: pieces are cut at the meridian
/// that is farthest from it on both sides.
void add_in_turn(const DemInfo& info, const Node& a, const Node& b, std::vector<WayPiece>& out) {
  if (info.period_cols <= 0 || info.wraps_longitude) {
    out.push_back({a.share, b.share, a.post, b.post});
    return;
  }
  const double period = info.period_cols, seam = (double(info.cols - 1) + period) / 2;
  const auto turns = [&](double x) { return std::floor((x - seam) / period) + 1; };
  const auto add = [&](const Node& from, const Node& to) {
    const double back = period * turns((from.post.x + to.post.x) / 2);
    out.push_back(
        {from.share, to.share, {from.post.x - back, from.post.y}, {to.post.x - back, to.post.y}});
  };
  const double first = turns(a.post.x), last = turns(b.post.x);
  if (first == last) return add(a, b);
  const double x = seam + std::min(first, last) * period;
  const double t = (x - a.post.x) / (b.post.x - a.post.x);
  const Node cut{a.share + t * (b.share - a.share), {x, a.post.y + t * (b.post.y - a.post.y)}};
  add(a, cut);
  add(cut, b);
}

}  // namespace

Result<std::vector<WayPiece>> straight_pieces(const DemSource& dem, const Curve& curve,
                                              double tolerance_posts, std::size_t pieces) {
  if (dem.info().crs_kind == CrsKind::none)
    return fail(Errc::invalid_argument, dem.info().files[0] +
                                            ": has no CRS, so it is not known where a line on the "
                                            "globe lies in it: say its CRS (--crs)");
  const auto straight = Pieces(dem, curve, tolerance_posts).run(pieces);
  if (!straight) return std::unexpected(straight.error());
  std::vector<WayPiece> out;
  out.reserve(straight->size());
  for (const auto& p : *straight) add_in_turn(dem.info(), p.from, p.to, out);
  return out;
}

}  // namespace tind
