#pragma once
// How hard to look for fewer triangles; bounded/search_effort.h says what that means.

#include <utility>

#include "terrain/base/enum_names.h"

namespace tind {

enum class Effort { fast, normal, best };

template <>
struct EnumNames<Effort> {
  static constexpr const char* kWhat = "effort";
  static constexpr std::pair<Effort, const char*> kAll[] = {
      {Effort::fast, "fast"}, {Effort::normal, "normal"}, {Effort::best, "best"}};
};

}  // namespace tind
