#pragma once

#include <algorithm>
#include <cstddef>
#include <limits>
#include <vector>

namespace tind {

/// Of an even number of values the mean of the two in the middle; NaN of none. REQUIRES: no value
/// is NaN. O(n).
template <class T>
double median(std::vector<T> values) {
  if (values.empty()) return std::numeric_limits<double>::quiet_NaN();
  const auto middle = values.begin() + std::ptrdiff_t(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  if (values.size() % 2 == 1) return double(*middle);
  return (double(*middle) + double(*std::max_element(values.begin(), middle))) / 2;
}

}  // namespace tind
