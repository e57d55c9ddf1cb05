#pragma once
// Which points of a line are needed [Douglas, Peucker: Algorithms for the reduction of the number
// of points required to represent a digitized line, The Canadian Cartographer 10(2), 1973].

#include <cstddef>
#include <utility>
#include <vector>

namespace tind {

/// Marks what stays between `first` and `last`, which stay: `off(from, to, i)` says how far point i
/// is from the straight way between two others, and no point is off by more than the limit. In the
/// worst case O(n^2).
template <class Off>
void mark_needed(std::size_t first, std::size_t last, double limit, std::vector<bool>& stays,
                 Off&& off) {
  std::vector<std::pair<std::size_t, std::size_t>> todo{{first, last}};
  while (!todo.empty()) {
    const auto [from, to] = todo.back();
    todo.pop_back();
    double worst = limit;
    std::size_t at = 0;
    for (std::size_t i = from + 1; i < to; ++i)
      if (const double d = off(from, to, i); d > worst) worst = d, at = i;
    if (at == 0) continue;
    stays[at] = true;
    todo.push_back({from, at});
    todo.push_back({at, to});
  }
}

}  // namespace tind
