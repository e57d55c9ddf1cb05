#include "server/cli/options/sight_input.h"

namespace tind::cli {

void add_sight_options(Command app, SightInput& input) {
  app.add_option("--refraction", input.refraction,
                 "of the ray's curve and the earth's; 0: a straight line")
      .range(-1., 1.)
      .shown();
  app.add_option("--uncertainty", input.uncertainty_m,
                 "the DEM's posts are within so many metres of the truth: what that leaves open is "
                 "said to depend on it")
      .range(0., 1e6);
  app.add_flag("--stated-accuracy", input.stated,
               "the same with the DEM's stated accuracy (--accuracy)");
}

Result<double> uncertainty_of(const SightInput& input, const DemInfo& info, double seen_m) {
  if (!input.stated) return seen_m + input.uncertainty_m.value_or(0);
  if (input.uncertainty_m)
    return fail(Errc::invalid_argument,
                "--uncertainty and --stated-accuracy are two ways to say the same: one of them");
  if (!info.accuracy)
    return fail(Errc::invalid_argument,
                "--stated-accuracy: nobody has stated how good this DEM is; say it with --accuracy "
                "or --uncertainty");
  return seen_m + info.accuracy->metres;
}

}  // namespace tind::cli
