#pragma once
// The result of a simplification.

#include <cstdint>
#include <map>
#include <string>

#include "terrain/mesh/tin.h"

namespace tind {

struct Simplified {
  Tin tin;                  // x = col, y = -row (post coordinates), z metres
  std::uint64_t steps = 0;  // collapses, insertions or removals made
  std::uint64_t input_triangles = 0;
  std::string note;                       // why it stopped short, if it did; empty otherwise
  std::map<std::string, double> details;  // method's own figures, e.g. the scale of alpha
};

}  // namespace tind
