// Tiles of projected DEMs where longitudes are awkward: around a pole, across the antimeridian,
// around the globe; and of widely spaced posts. The checker asks PROJ for every post.

#include <gtest/gtest.h>

#include "terrain/check/check.h"
#include "terrain/pyramid/build/build.h"
#include "tests/support/projected_dem.h"

namespace tind {
namespace {

using test::ProjectedDem;

constexpr double kMercatorEnd = 20037508.342789244, kMercatorPart = kMercatorEnd / 60;

class ProjectedTiles : public testing::TestWithParam<ProjectedDem> {};

TEST_P(ProjectedTiles, have_no_cracks_and_are_within_what_they_state) {
  const test::TempDir folder;
  const auto source = test::open_projected(GetParam(), folder);
  ASSERT_TRUE(source);
  BuildOptions build;
  build.tiles.effort = Effort::fast;
  build.tiles.max_error_m = 200;
  build.output = folder.file("tiles");
  const auto report = build_tiles(source, build);
  ASSERT_TRUE(report) << report.error().what;
  CheckOptions check;
  check.source = source;
  const auto checked = check_tiles(build.output, check);
  ASSERT_TRUE(checked) << checked.error().what;
  for (std::size_t rule = 0; rule < kCheckRuleCount; ++rule)
    if (kCheckRules[rule].severity == Severity::violation) {
      const auto& [count, examples] = checked->findings[rule];
      EXPECT_EQ(count, 0u) << kCheckRules[rule].id << (count ? ", " + examples[0] : "");
    }
}

INSTANTIATE_TEST_SUITE_P(
    of_dems, ProjectedTiles,
    testing::Values(
        ProjectedDem{"south_pole", "EPSG:3031", -2987.5e3, 2987.5e3, 50e3, 121, 121},
        ProjectedDem{"closely_around_a_pole", "EPSG:3031", -92e3, 84e3, 6000, 30, 28},
        ProjectedDem{"pole_on_a_post", "EPSG:3413", -1800e3, 1800e3, 60e3, 61, 61},
        ProjectedDem{"utm_across_the_antimeridian", "EPSG:32760", 605e3, 8295e3, 10e3, 60, 50},
        ProjectedDem{"closely_across_it", "EPSG:32760", 780e3, 8050e3, 1000, 100, 70},
        ProjectedDem{"mercator_across_it", "EPSG:3832", 2710e3, -1510e3, 20e3, 60, 75},
        ProjectedDem{"mercator_around_the_globe", "EPSG:3857", -kMercatorEnd + kMercatorPart / 2,
                     9.9e6, kMercatorPart, 120, 60},
        ProjectedDem{"with_posts_on_the_antimeridian", "EPSG:3857", -kMercatorEnd, 9.9e6,
                     kMercatorPart, 121, 60},
        ProjectedDem{"that_ends_there", "EPSG:3857", kMercatorEnd - 49.5 * 2000, 1e6, 2000, 50, 60},
        ProjectedDem{"that_begins_there", "EPSG:3857", 1000 - kMercatorEnd, 1e6, 2000, 50, 60},
        ProjectedDem{"with_a_seam_inside", "EPSG:3832", -20e6, 9.9e6, 4e5, 101, 50},
        ProjectedDem{"twenty_kilometres", "EPSG:3035", 2510e3, 4990e3, 20e3, 120, 100},
        ProjectedDem{"five_kilometres", "EPSG:3035", 3510e3, 3990e3, 5e3, 120, 100}),
    [](const auto& dem) { return dem.param.name; });

}  // namespace
}  // namespace tind
