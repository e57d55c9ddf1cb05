#pragma once
// Which edges of a mesh are lines that must stay: a set of vertex pairs that follows the edits.

#include <cstdint>
#include <unordered_set>
#include <vector>

#include "terrain/base/keyed_hash.h"

namespace tind {

/// Empty, it costs one comparison; and a vertex off all lines one bit.
class LineEdges {
 public:
  using Index = std::uint32_t;

  bool empty() const { return pairs_.empty(); }
  bool on_line(Index v) const { return v < touched_.size() && touched_[v]; }
  bool contains(Index a, Index b) const {
    return on_line(a) && on_line(b) && pairs_.contains(key(a, b));
  }

  void add(Index a, Index b) {
    pairs_.insert(key(a, b));
    touch(a), touch(b);
  }
  void remove(Index a, Index b) { pairs_.erase(key(a, b)); }

 private:
  std::unordered_set<std::uint64_t, KeyedHash>
      pairs_;  // asked, never walked: its order shows nowhere
  std::vector<bool> touched_;

  static std::uint64_t key(Index a, Index b) {
    return std::uint64_t(a < b ? a : b) << 32 | (a < b ? b : a);
  }
  void touch(Index v) {
    if (v >= touched_.size()) touched_.resize(v + 1);
    touched_[v] = true;
  }
};

}  // namespace tind
