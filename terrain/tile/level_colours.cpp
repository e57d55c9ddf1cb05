#include "terrain/tile/level_colours.h"

#include <cmath>
#include <optional>

namespace tind {
namespace {

constexpr double kMeridian_m = 20'003'931;  // from pole to pole, which level 0 has one tile for
constexpr double kPixels = 64;              // along a side of a tile

}  // namespace

std::vector<ImageColours::Linear> level_colours(std::span<const Geographic> places, int level,
                                                const ImageColours& image) {
  std::vector<std::optional<ImageColours::Linear>> found(places.size());
  image.at(places, std::ldexp(kMeridian_m, -level) / kPixels, found);
  std::vector<ImageColours::Linear> colours;
  colours.reserve(found.size());
  bool any = false;
  for (const auto& colour : found) {
    any = any || colour;
    colours.push_back(colour.value_or(ImageColours::Linear{1, 1, 1}));
  }
  if (!any) colours.clear();
  return colours;
}

}  // namespace tind
