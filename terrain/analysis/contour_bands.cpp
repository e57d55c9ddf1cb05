#include "terrain/analysis/contour_bands.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <compare>
#include <cstdint>
#include <limits>
#include <numeric>
#include <utility>

namespace tind {
namespace {

constexpr std::uint32_t kNone = ~std::uint32_t(0);
/// Coordinates of files are rounded, to a tenth of a millimetre in the coarsest: on a slope of 1 in
/// 5 that is half of this.
constexpr double kRounding_m = 1.0 / 1024;

// --- the mesh ------------------------------------------------------------------------------------

/// Of each triangle the neighbour behind the edge from corner k to k + 1.
std::vector<std::array<std::uint32_t, 3>> neighbours_of(const std::vector<Triangle>& triangles) {
  struct Edge {
    std::uint32_t from, to, triangle, corner;
    auto operator<=>(const Edge&) const = default;
  };
  std::vector<Edge> edges;
  edges.reserve(3 * triangles.size());
  for (std::uint32_t t = 0; t < triangles.size(); ++t)
    for (std::uint32_t k = 0; k < 3; ++k)
      edges.push_back({triangles[t][k], triangles[t][(k + 1) % 3], t, k});
  std::ranges::sort(edges);
  std::vector<std::array<std::uint32_t, 3>> all(triangles.size(), {kNone, kNone, kNone});
  for (const Edge& e : edges) {
    const auto twin = std::ranges::lower_bound(edges, Edge{e.to, e.from, 0, 0});
    if (twin != edges.end() && twin->from == e.to && twin->to == e.from)
      all[e.triangle][e.corner] = twin->triangle;
  }
  return all;
}

// --- one height ----------------------------------------------------------------------------------

/// A corner of a piece, by name: a vertex (a == b), or where an edge crosses the low or the high
/// surface's line.
struct Node {
  std::uint32_t a = 0, b = 0;
  enum Kind : std::uint32_t { vertex, low, high } kind = vertex;
  auto operator<=>(const Node&) const = default;
};

/// Of the band's rim: its inside is to the left.
struct Segment {
  std::uint32_t part = 0;  // of which connected part of the band
  Node from, to;
  auto operator<=>(const Segment&) const = default;
};

class Band {
 public:
  Band(const BoundedSurface& surface, const std::vector<std::array<std::uint32_t, 3>>& neighbours)
      : surface_(surface), neighbours_(neighbours), parent_(surface.mesh.triangles.size()) {}

  /// `among`: the triangles that can have it.
  void areas(double height, const std::vector<std::uint32_t>& among,
             std::vector<ContourArea>& out) {
    height_ = height;
    segments_.clear();
    for (const std::uint32_t t : among) parent_[t] = t;
    for (const std::uint32_t t : among) take(t);
    for (Segment& s : segments_) s.part = root(s.part);
    std::ranges::sort(segments_);
    put_rings(out);
  }

 private:
  /// 0: in the band; 1: certainly higher than the height; -1: certainly lower.
  int state(std::uint32_t v) const {
    return surface_.low[v] > height_ ? 1 : surface_.high[v] < height_ ? -1 : 0;
  }

  std::uint32_t root(std::uint32_t t) {
    while (parent_[t] != t) t = parent_[t] = parent_[parent_[t]];
    return t;
  }

  static Node crossing(std::uint32_t a, std::uint32_t b, Node::Kind kind) {
    return {std::min(a, b), std::max(a, b), kind};
  }

  /// What of an edge lies in the band; both neighbours find the same, each in its direction.
  bool part_of(std::uint32_t a, std::uint32_t b, Node& from, Node& to) const {
    const int at_a = state(a), at_b = state(b);
    if (at_a == at_b && at_a != 0) return false;
    const auto end = [&](std::uint32_t v, int at) {
      return at == 0 ? Node{v, v, Node::vertex} : crossing(a, b, at > 0 ? Node::low : Node::high);
    };
    from = end(a, at_a), to = end(b, at_b);
    return true;
  }

  void take(std::uint32_t t) {
    const Triangle& corners = surface_.mesh.triangles[t];
    std::array<std::pair<Node, Node>, 3> parts;
    std::size_t count = 0;
    for (std::uint32_t k = 0; k < 3; ++k) {
      auto& [from, to] = parts[count];
      if (!part_of(corners[k], corners[(k + 1) % 3], from, to)) continue;
      ++count;
      const std::uint32_t other = neighbours_[t][k];
      if (other == kNone)
        segments_.push_back({t, from, to});
      else
        parent_[std::max(root(t), root(other))] = std::min(root(t), root(other));
    }
    for (std::size_t i = 0; i < count; ++i) {
      const Node &end = parts[i].second, &begin = parts[(i + 1) % count].first;
      if (end != begin) segments_.push_back({t, end, begin});
    }
  }

  Vec2 place_of(const Node& node) const {
    const auto& vertices = surface_.mesh.vertices;
    const Vec3 &a = vertices[node.a], &b = vertices[node.b];
    if (node.kind == Node::vertex) return {a.x, -a.y};
    const auto& heights = node.kind == Node::low ? surface_.low : surface_.high;
    const double from = heights[node.a], to = heights[node.b];
    const double share = std::clamp((height_ - from) / (to - from), 0.0, 1.0);
    return {a.x + share * (b.x - a.x), -(a.y + share * (b.y - a.y))};
  }

  static double twice_area(const std::vector<Vec2>& ring) {
    double sum = 0;
    for (std::size_t i = 1; i + 1 < ring.size(); ++i)
      sum += (ring[i].x - ring[0].x) * (ring[i + 1].y - ring[0].y) -
             (ring[i + 1].x - ring[0].x) * (ring[i].y - ring[0].y);
    return -sum;  // rows count down
  }

  /// Along the rim until it closes. Where it touches itself, any way on makes rings of one area.
  std::vector<Vec2> ring_from(std::size_t first, std::vector<bool>& used) const {
    std::vector<Vec2> ring;
    std::size_t at = first;
    Segment next;
    do {
      used[at] = true;
      const Vec2 place = place_of(segments_[at].from);
      if (ring.empty() || ring.back().x != place.x || ring.back().y != place.y)
        ring.push_back(place);
      next = {segments_[at].part, segments_[at].to, {}};
      at = std::size_t(std::ranges::lower_bound(segments_, next) - segments_.begin());
      while (at < segments_.size() && used[at] && at != first && begins(at, next)) ++at;
    } while (at < segments_.size() && begins(at, next) && !used[at]);
    while (ring.size() > 1 && ring.front().x == ring.back().x && ring.front().y == ring.back().y)
      ring.pop_back();
    return ring;
  }
  bool begins(std::size_t at, const Segment& like) const {
    return segments_[at].part == like.part && segments_[at].from == like.from;
  }

  /// A connected part has one rim around it, and a rim for each of its holes.
  void put_rings(std::vector<ContourArea>& out) const {
    std::vector<bool> used(segments_.size());
    for (std::size_t i = 0; i < segments_.size();) {
      const std::uint32_t part = segments_[i].part;
      std::vector<std::pair<double, std::vector<Vec2>>> rings;
      for (; i < segments_.size() && segments_[i].part == part; ++i) {
        if (used[i]) continue;
        auto ring = ring_from(i, used);
        const double size = ring.size() < 3 ? 0 : twice_area(ring);
        if (size != 0) rings.emplace_back(size, std::move(ring));
      }
      std::ranges::stable_sort(rings,
                               [](const auto& a, const auto& b) { return a.first > b.first; });
      if (rings.empty() || rings.front().first < 0) continue;
      // More than one that is around something: of parts that touch themselves.
      std::size_t outer = 1;
      while (outer < rings.size() && rings[outer].first > 0) ++outer;
      ContourArea area{height_, {std::move(rings.front().second)}};
      for (std::size_t k = outer; k < rings.size(); ++k)
        area.rings.push_back(std::move(rings[k].second));
      out.push_back(std::move(area));
      for (std::size_t k = 1; k < outer; ++k)
        out.push_back({height_, {std::move(rings[k].second)}});
    }
  }

  const BoundedSurface& surface_;
  const std::vector<std::array<std::uint32_t, 3>>& neighbours_;
  std::vector<std::uint32_t> parent_;
  double height_ = 0;
  std::vector<Segment> segments_;
};

}  // namespace

BoundedSurface bounded_surface(const HeightGrid& posts, double error_m) {
  const int cols = posts.cols(), rows = posts.rows();
  BoundedSurface surface;
  Tin& mesh = surface.mesh;
  std::vector<double> bent(std::size_t(cols) * std::size_t(rows));
  const auto index = [&](int c, int r) {
    return std::uint32_t(r) * std::uint32_t(cols) + std::uint32_t(c);
  };
  for (int r = 0; r < rows; ++r)
    for (int c = 0; c < cols; ++c)
      mesh.vertices.push_back(
          {double(c), -double(r), posts.is_void(c, r) ? 0 : double(posts.at(c, r))});
  for (int r = 0; r + 1 < rows; ++r)
    for (int c = 0; c + 1 < cols; ++c) {
      // Around the cell, counter-clockwise as seen from above.
      std::array<std::uint32_t, 4> ring;
      std::size_t count = 0;
      for (const auto& [dc, dr] : {std::pair(0, 0), {0, 1}, {1, 1}, {1, 0}})
        if (!posts.is_void(c + dc, r + dr)) ring[count++] = index(c + dc, r + dr);
      if (count < 3) continue;
      mesh.triangles.push_back({ring[0], ring[1], ring[2]});
      if (count < 4) continue;
      mesh.triangles.push_back({ring[0], ring[2], ring[3]});
      const auto z = [&](std::size_t k) { return mesh.vertices[ring[k]].z; };
      const double quarter = std::abs(z(0) - z(1) + z(2) - z(3)) / 4;
      for (const std::uint32_t v : ring) bent[v] = std::max(bent[v], quarter);
    }
  constexpr double kNever = std::numeric_limits<double>::infinity();
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v) {
    const bool is_void = std::isnan(posts.values()[v]);  // of no triangle
    const double z = mesh.vertices[v].z, off = error_m + bent[v] + kRounding_m;
    surface.low.push_back(is_void ? kNever : z - off);
    surface.high.push_back(is_void ? -kNever : z + off);
  }
  return surface;
}

Result<std::vector<ContourArea>> contour_bands(const BoundedSurface& surface,
                                               std::span<const double> heights_m,
                                               const Progress& progress) {
  const auto& triangles = surface.mesh.triangles;
  std::vector<double> from(triangles.size()), to(triangles.size());
  for (std::size_t t = 0; t < triangles.size(); ++t) {
    const auto& [a, b, c] = triangles[t];
    from[t] = std::min({surface.low[a], surface.low[b], surface.low[c]});
    to[t] = std::max({surface.high[a], surface.high[b], surface.high[c]});
  }
  std::vector<std::uint32_t> by_height(triangles.size());
  std::iota(by_height.begin(), by_height.end(), 0u);
  std::ranges::stable_sort(by_height, {}, [&](std::uint32_t t) { return from[t]; });
  const auto neighbours = neighbours_of(triangles);
  Band band(surface, neighbours);
  std::vector<double> heights(heights_m.begin(), heights_m.end());
  std::ranges::sort(heights);
  std::vector<ContourArea> areas;
  std::vector<std::uint32_t> active;
  std::size_t next = 0;
  for (std::size_t i = 0; i < heights.size(); ++i) {
    if (progress.stopped()) return fail(Errc::cancelled, "stopped");
    while (next < by_height.size() && from[by_height[next]] <= heights[i])
      active.push_back(by_height[next++]);
    std::erase_if(active, [&](std::uint32_t t) { return to[t] < heights[i]; });
    band.areas(heights[i], active, areas);
    progress.at(double(i + 1) / double(heights.size()));
  }
  return areas;
}

}  // namespace tind
