// Even-odd counting: a ray to the west crosses an edge when its ends lie on different sides of the
// ray's line, the lower end belonging to the edge and the upper one not.

#include "terrain/mesh/polygon_set.h"

#include <algorithm>
#include <cmath>

namespace tind {

namespace {

bool spans(const PolygonSet::Edge& e, double y) { return (e.a.y <= y) != (e.b.y <= y); }

/// Where the edge, taken from its lower end, is at height y.
double crossing(const PolygonSet::Edge& e, double y) {
  const auto& [low, high] = e.a.y <= e.b.y ? e : PolygonSet::Edge{e.b, e.a};
  return low.x + (y - low.y) * ((high.x - low.x) / (high.y - low.y));
}

}  // namespace

std::uint32_t PolygonSet::add(std::vector<Edge> edges) {
  const std::uint32_t id = std::uint32_t(polygons_.size());
  const double last = double(rows_.size()) - 1;
  for (const Edge& e : edges) {
    const double top = std::floor(-std::max(e.a.y, e.b.y)), bottom = -std::min(e.a.y, e.b.y);
    for (double r = std::max(0.0, top); r <= std::min(last, bottom); ++r)
      rows_[std::size_t(r)].push_back({id, e});
  }
  polygons_.push_back(std::move(edges));
  return id;
}

std::uint32_t PolygonSet::holding(double x, double y) const {
  const auto row = std::size_t(std::clamp(std::floor(-y), 0.0, double(rows_.size()) - 1));
  std::uint32_t polygon = kNone;
  bool odd = false;
  for (const RowEdge& e : rows_[row]) {
    if (e.polygon != polygon) {
      if (odd) return polygon;
      polygon = e.polygon;
    }
    if (spans(e.edge, y) && crossing(e.edge, y) < x) odd = !odd;
  }
  return odd ? polygon : kNone;
}

std::vector<std::vector<double>> PolygonSet::row_crossings(std::uint32_t polygon) const {
  std::vector<std::vector<double>> at(rows_.size());
  const double last = double(rows_.size()) - 1;
  for (const Edge& e : polygons_[polygon]) {
    const double top = std::ceil(-std::max(e.a.y, e.b.y)), bottom = -std::min(e.a.y, e.b.y);
    for (double r = std::max(0.0, top); r <= std::min(last, bottom); ++r)
      if (spans(e, -r)) at[std::size_t(r)].push_back(crossing(e, -r));
  }
  for (auto& row : at) std::sort(row.begin(), row.end());
  return at;
}

}  // namespace tind
