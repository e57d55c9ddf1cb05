#pragma once
// Bounds for people: a figure of a few digits that still bounds.

#include <fmt/format.h>

#include <cmath>
#include <string>

namespace tind {

/// Four significant digits, rounded up. REQUIRES: a finite number that is not negative.
inline std::string bound_text(double bound) {
  const double step = bound > 0 ? std::pow(10.0, std::floor(std::log10(bound)) - 3) : 0;
  double shown = bound;
  for (std::string text = fmt::format("{:.4g}", shown);; text = fmt::format("{:.4g}", shown)) {
    if (std::stod(text) >= bound || !(step > 0)) return text;
    shown += step;
  }
}

}  // namespace tind
