#pragma once
// Vertices by what it costs to take them away, for coarsening in strict order of cost (where
// nearly the cheapest will do, simplify/bucket_queue.h is faster).

#include <cmath>
#include <cstdint>
#include <queue>
#include <vector>

namespace tind {

class VertexQueue {
 public:
  using Index = std::uint32_t;
  static constexpr Index kNone = ~Index(0);

  /// Whatever was said about v before is void. An infinite cost only takes v out.
  void push(Index v, double cost) {
    if (v >= version_.size()) version_.resize(v + std::size_t(1), 0);
    ++version_[v];
    if (cost < HUGE_VAL) entries_.push({cost, v, version_[v]});
  }

  /// The cheapest, of equals the first by number; kNone when there is none.
  Index pop() {
    while (!entries_.empty()) {
      const Entry e = entries_.top();
      entries_.pop();
      if (e.version == version_[e.vertex]) return e.vertex;
    }
    return kNone;
  }

 private:
  struct Entry {
    double cost;
    Index vertex;
    std::uint32_t version;
    bool operator<(const Entry& o) const {
      return cost != o.cost ? cost > o.cost : vertex > o.vertex;
    }
  };
  std::vector<std::uint32_t> version_;
  std::priority_queue<Entry> entries_;
};

}  // namespace tind
