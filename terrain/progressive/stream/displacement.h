#pragma once
// How far apart a fine surface and one made of it by edge collapses can be.
//
// Every fine vertex is stood for by one that is still there. The map that takes each to the place
// of the one that stands for it, linear over the fine triangles, maps the fine surface *onto* the
// other: so no point of either is farther from the other surface than the farthest vertex is
// carried. The true distance is often far below that, since a vertex that slides along a plane
// counts, too; but it is never above.

#include <algorithm>
#include <cstdint>
#include <vector>

#include "terrain/geo/coordinates.h"

namespace tind {

class Displacement {
 public:
  using Index = std::uint32_t;

  explicit Displacement(std::vector<Vec3> start)
      : start_(std::move(start)), at_(start_), reach_(start_.size(), 0), members_(start_.size()) {
    for (Index v = 0; v < members_.size(); ++v) members_[v] = {v};
  }

  /// a has gone into b, which now lies at `to`. Amortised O(log n) mostly: the vertices that b
  /// stands for are looked at one by one only where a cheap bound does not do.
  void merge(Index a, Index b, const Vec3& to) {
    if (members_[a].size() > members_[b].size()) members_[a].swap(members_[b]);
    members_[b].insert(members_[b].end(), members_[a].begin(), members_[a].end());
    members_[a] = {};
    reach_[b] = std::max(reach_[a] + length(to - at_[a]), reach_[b] + length(to - at_[b]));
    at_[b] = to;
    if (reach_[b] <= bound_) return;
    reach_[b] = 0;
    for (const Index k : members_[b]) reach_[b] = std::max(reach_[b], length(start_[k] - to));
    bound_ = std::max(bound_, reach_[b]);
  }

  /// Of all surfaces so far. Never falls.
  double bound() const { return bound_; }
  /// How many vertices v stands for, itself included.
  std::size_t weight(Index v) const { return members_[v].size(); }
  const Vec3& start(Index v) const { return start_[v]; }
  const Vec3& at(Index v) const { return at_[v]; }

 private:
  std::vector<Vec3> start_, at_;
  std::vector<double> reach_;  // by vertex: not below the way of any that it stands for
  std::vector<std::vector<Index>> members_;
  double bound_ = 0;
};

}  // namespace tind
