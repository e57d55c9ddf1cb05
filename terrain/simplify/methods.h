#pragma once
// The table of simplification methods, for people and programs that choose one.

#include <span>
#include <string>
#include <vector>

#include "terrain/base/result.h"

namespace tind {

/// What one chooses by, and what one reads when it is chosen.
struct MethodInfo {
  std::string name, minimises, stops, guarantees, source;
  std::string take_for;  // when it is the right one
  std::string voids;     // holes, or covered
  /// Time and RMS error beside qem's at 10 % of the triangles (scripts/reproduce --only choose).
  std::string time, rms;
  std::vector<std::string> options;  // those of SimplifyOptions that it reads, as they are typed
};

/// All methods, in the order in which help lists them.
std::span<const MethodInfo> methods();

/// (invalid_argument), with all names that there are.
std::unexpected<Error> no_such_method(const std::string& name);

}  // namespace tind
