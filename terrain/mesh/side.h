#pragma once
// Where a mesh lies as seen from the posts.

#include <utility>

#include "terrain/base/enum_names.h"

namespace tind {

enum class Side {
  both,   // above some posts, below others
  above,  // at or above every post
  below,  // at or below every post
};

template <>
struct EnumNames<Side> {
  static constexpr const char* kWhat = "side";
  static constexpr std::pair<Side, const char*> kAll[] = {
      {Side::both, "both"}, {Side::above, "above"}, {Side::below, "below"}};
};

}  // namespace tind
