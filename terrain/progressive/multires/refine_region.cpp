// From the base mesh: a triangle that is too far from its posts must go, and there is one way for
// it to go. What has been forced so is the least there can be, whatever the order.

#include "terrain/progressive/multires/refine_region.h"

namespace tind {

Front refine_region(const MultiTriangulation& all, const Region& region,
                    const RegionErrors& errors) {
  using Index = Front::Index;
  Front front(all);
  std::vector<Index> open;
  const auto too_far = [&](Index t) {
    const double error = all.error_m(t);
    if (error <= errors.inside_m) return false;
    const auto corner = [&](int k) { return all.vertices()[all.corners(t)[k]]; };
    const bool inside = region.touches(corner(0), corner(1), corner(2));
    return error > (inside ? errors.inside_m : errors.outside_m);
  };
  for (Index t = all.base_begin(); t < all.triangles(); ++t) open.push_back(t);
  while (!open.empty()) {
    const Index t = open.back();
    open.pop_back();
    const Index node = all.splitter(t);
    if (node == Front::kNone || front.applied(node) || !too_far(t)) continue;
    front.apply(node, [&](Index n) {
      for (Index f = all.fine_begin(n); f < all.fine_end(n); ++f) open.push_back(f);
    });
  }
  return front;
}

}  // namespace tind
