#pragma once
// Heights at many places at once: what thousands of height_at() would say, at a fraction of the
// cost, and by other ways of interpolating.

#include <span>
#include <stop_token>
#include <utility>
#include <vector>

#include "terrain/base/enum_names.h"
#include "terrain/base/result.h"
#include "terrain/geo/coordinates.h"
#include "terrain/surface/height_field.h"
#include "terrain/surface/surface.h"

namespace tind {

/// How a height between posts is had. `bilinear` is H, which all errors are about. `nearest`: the
/// post's that is nearest in columns and rows. `cubic`: convolution over 4 x 4 posts [Keys81, a =
/// -1/2], which goes through all posts and has no creases between them; bilinear where one of the
/// sixteen is missing.
enum class Interpolation { bilinear, nearest, cubic };
template <>
struct EnumNames<Interpolation> {
  static constexpr const char* kWhat = "interpolation";
  static constexpr std::pair<Interpolation, const char*> kAll[] = {
      {Interpolation::bilinear, "bilinear"},
      {Interpolation::nearest, "nearest"},
      {Interpolation::cubic, "cubic"}};
};

/// Height and deciding layer of each place, in their order. Bilinear: what height_at() says of
/// each, to the last bit. Of layers, `nearest` and `cubic` are of the layer that decides a place,
/// without its blend with what lies below. What is level is level by all three.
///
/// Places that lie close together are read together: O(places log places) and each block of the
/// source once, whatever their order. Fails with the source's errors, and (cancelled).
Result<std::vector<SurfaceHeight>> heights_at(const Surface&, std::span<const Geographic>,
                                              Interpolation, const std::stop_token& = {});

/// The highest of bilinear heights at the places; 0 where none of them has one, or nobody has the
/// surface (null).
Result<double> highest_ground(const Surface*, std::span<const Geographic>,
                              const std::stop_token& = {});

}  // namespace tind
