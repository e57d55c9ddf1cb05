#include "terrain/shapes/shape_lines.h"

#include <algorithm>
#include <cmath>

namespace tind {

namespace {

constexpr double kEnd = 32767;
constexpr std::uint32_t kBlock = 32;  // segments

bool meet(const GeoRect& a, const GeoRect& b) {
  return a.west <= b.east && b.west <= a.east && a.south <= b.north && b.south <= a.north;
}

/// Where segment ab crosses the line x = at (or y = at), as the other coordinate; from the lower
/// end on, so that it does not matter which way the segment runs, or which tile asks.
std::optional<double> crossing(const Vec3& a, const Vec3& b, bool of_x, double at) {
  const double pa = of_x ? a.x : a.y, pb = of_x ? b.x : b.y;
  if ((pa < at) == (pb < at)) return {};
  const bool up = pa < pb;
  const Vec3 &low = up ? a : b, &high = up ? b : a;
  const double p = of_x ? low.x : low.y, q = of_x ? high.x : high.y;
  const double r = of_x ? low.y : low.x, s = of_x ? high.y : high.x;
  return r + (at - p) / (q - p) * (s - r);
}

/// Along an edge; never at its ends, where a border has vertices of its own.
double place_on_edge(double at, double low, double high) {
  constexpr double kClear = 1e-3;
  return std::clamp((at - low) / (high - low) * kEnd, kClear, kEnd - kClear);
}

double height_on(const Vec3& a, const Vec3& b, double share) { return a.z + share * (b.z - a.z); }

/// Goes along one chain through one rectangle.
class Walk {
 public:
  Walk(const ShapeChain& chain, const GeoRect& rect, std::vector<ShapePiece>& out)
      : chain_(chain), rect_(rect), out_(out) {}

  bool inside() const { return open_; }

  void start(const Vec3& p) {
    if (holds(p)) begin({}), add(p);
  }
  void segment(const Vec3& a, const Vec3& b) {
    hits_.clear();
    const auto side = [&](int number, bool of_x, double at) {
      const auto other = crossing(a, b, of_x, at);
      if (!other) return;
      const double low = of_x ? rect_.south : rect_.west, high = of_x ? rect_.north : rect_.east;
      if (!(*other >= low && *other < high)) return;
      const double share = of_x ? (at - a.x) / (b.x - a.x) : (at - a.y) / (b.y - a.y);
      hits_.push_back({share, {number, place_on_edge(*other, low, high)}});
    };
    side(0, true, rect_.west), side(1, false, rect_.south);
    side(2, true, rect_.east), side(3, false, rect_.north);
    std::sort(hits_.begin(), hits_.end(),
              [](const Hit& p, const Hit& q) { return p.share < q.share; });
    for (const Hit& hit : hits_) open_ ? end(hit.end) : begin(hit.end);
    // Rounding may lose a crossing next to a corner: then the piece ends or begins inside.
    const bool in = holds(b);
    if (open_ && !in) end({});
    if (!open_ && in) begin({});
    if (open_) add(b);
  }
  void finish() {
    if (open_) end({});
  }

 private:
  struct Hit {
    double share;  // of the way from a to b
    ShapePiece::End end;
  };
  const ShapeChain& chain_;
  const GeoRect& rect_;
  std::vector<ShapePiece>& out_;
  std::vector<Hit> hits_;  // of the segment at hand
  ShapePiece piece_;
  bool open_ = false;

  bool holds(const Vec3& p) const {
    return p.x >= rect_.west && p.x < rect_.east && p.y >= rect_.south && p.y < rect_.north;
  }
  void begin(ShapePiece::End from) {
    piece_ = {.chain = &chain_, .points = {}, .from = from, .to = {}};
    open_ = true;
  }
  void add(const Vec3& p) {
    piece_.points.push_back({(p.x - rect_.west) / rect_.width() * kEnd,
                             (p.y - rect_.south) / rect_.height() * kEnd, p.z});
  }
  void end(ShapePiece::End to) {
    piece_.to = to;
    piece_.closed = piece_.from.side < 0 && to.side < 0 &&
                    piece_.points.size() == chain_.points.size() &&
                    chain_.points.front() == chain_.points.back();
    out_.push_back(std::move(piece_));
    open_ = false;
  }
};

}  // namespace

double LineScale::level(double level_m) const {
  return step_m > 0 ? std::nearbyint(level_m / step_m) * step_m : level_m;
}

ShapeLines::ShapeLines(std::vector<ShapeChain> chains, std::vector<ShapeExtent> networks)
    : chains_(std::move(chains)), networks_(std::move(networks)) {
  for (std::uint32_t c = 0; c < chains_.size(); ++c) {
    const auto& points = chains_[c].points;
    const auto segments = std::uint32_t(points.size() - 1);
    for (std::uint32_t first = 0; first < segments; first += kBlock) {
      Block block{
          c, first, std::min(first + kBlock, segments), {HUGE_VAL, HUGE_VAL, -HUGE_VAL, -HUGE_VAL}};
      for (std::uint32_t i = first; i <= block.last; ++i) {
        const Vec3& p = points[i];
        GeoRect& box = block.box;
        box.west = std::min(box.west, p.x), box.east = std::max(box.east, p.x);
        box.south = std::min(box.south, p.y), box.north = std::max(box.north, p.y);
      }
      blocks_.push_back(block);
    }
  }
}

bool ShapeLines::counts(const ShapeChain& chain, const LineScale& scale) const {
  const ShapeExtent& extent = networks_[chain.network];
  return extent.size_deg >= scale.finest_deg &&
         (extent.size_deg >= scale.least_deg || extent.relief_m > scale.relief_m);
}

std::vector<ShapeCrossing> ShapeLines::crossings(Geographic start, Geographic end,
                                                 const LineScale& scale) const {
  const bool northward = start.lon == end.lon;
  const GeoRect line{start.lon, start.lat, end.lon, end.lat};
  const double at = northward ? start.lon : start.lat;
  const double low = northward ? start.lat : start.lon, high = northward ? end.lat : end.lon;
  std::vector<ShapeCrossing> found;
  for (const Block& block : blocks_) {
    if (!meet(block.box, line)) continue;
    const ShapeChain& chain = chains_[block.chain];
    if (!counts(chain, scale)) continue;
    for (std::uint32_t i = block.first; i < block.last; ++i) {
      const Vec3 &a = chain.points[i], &b = chain.points[i + 1];
      const auto other = crossing(a, b, northward, at);
      if (!other || !(*other >= low && *other < high)) continue;
      const double share = northward ? (at - a.x) / (b.x - a.x) : (at - a.y) / (b.y - a.y);
      found.push_back({place_on_edge(*other, low, high),
                       chain.shore() ? scale.level(chain.level_m) : height_on(a, b, share),
                       chain.shore()});
    }
  }
  std::stable_sort(found.begin(), found.end(),
                   [](const ShapeCrossing& p, const ShapeCrossing& q) { return p.t < q.t; });
  return found;
}

std::vector<ShapePiece> ShapeLines::pieces(const GeoRect& rect, const LineScale& scale) const {
  std::vector<ShapePiece> out;
  for (std::size_t k = 0; k < blocks_.size();) {
    const ShapeChain& chain = chains_[blocks_[k].chain];
    const std::size_t first = k;
    bool any = false;
    while (k < blocks_.size() && blocks_[k].chain == blocks_[first].chain)
      any = meet(blocks_[k++].box, rect) || any;
    if (!any || !counts(chain, scale)) continue;
    Walk walk(chain, rect, out);
    walk.start(chain.points.front());
    for (std::size_t b = first; b < k; ++b) {
      if (!walk.inside() && !meet(blocks_[b].box, rect)) continue;
      for (std::uint32_t i = blocks_[b].first; i < blocks_[b].last; ++i)
        walk.segment(chain.points[i], chain.points[i + 1]);
    }
    walk.finish();
  }
  return out;
}

}  // namespace tind
