#include "terrain/analysis/line_of_sight.h"

#include <string>

#include "terrain/analysis/post_reader.h"

namespace tind {
namespace {

Result<double> ground_at(const DemSource& dem, Geographic place, const char* whose) {
  const auto height = height_at(dem, place);
  if (!height) return std::unexpected(height.error());
  if (height->coverage == Coverage::value) return height->height_m;
  return fail(Errc::invalid_argument,
              std::string("the ") + whose +
                  (height->coverage == Coverage::void_ ? " stands where the DEM has a void"
                                                       : " stands outside of the DEM"));
}

}  // namespace

Result<LineOfSight> line_of_sight(const DemSource& dem, const SightEnd& eye, const SightEnd& target,
                                  const SightRules& rules) {
  if (dem.info().crs_kind == CrsKind::none)
    return fail(Errc::invalid_argument,
                dem.info().files[0] +
                    ": has no CRS, so nothing stands at a longitude and latitude "
                    "in it: say its CRS (--crs)");
  const auto from = ground_at(dem, eye.place, "observer");
  if (!from) return std::unexpected(from.error());
  const auto to = ground_at(dem, target.place, "target");
  if (!to) return std::unexpected(to.error());
  LineOfSight out;
  out.eye_m = *from + eye.above_ground_m, out.target_m = *to + target.above_ground_m;
  const SightRay ray(eye.place, out.eye_m, target.place, out.target_m, rules.refraction);
  out.length_m = ray.length_m();
  if (out.length_m > kLongestSight_m)
    return fail(Errc::invalid_argument,
                "observer and target are more than 2000 km apart: nothing on earth sees so far");
  PostReader posts(dem);
  const auto clearance = clearance_along(dem, ray, rules, posts);
  if (posts.error()) return std::unexpected(*posts.error());
  if (!clearance) return std::unexpected(clearance.error());
  const Clearance& c = *clearance;
  out.visibility = visibility_of(c, rules.all_m());
  out.unknown = c.unknown;
  if (std::isfinite(c.least_m))
    out.nearest = LineOfSight::At{c.share, ray.place(c.share), c.ground_m, c.least_m};
  if (c.first_hidden >= 0) out.first_hidden_share = c.first_hidden;
  if (rules.all_m() > 0 && out.nearest) out.surely_m = c.surely_m, out.perhaps_m = c.perhaps_m;
  return out;
}

}  // namespace tind
