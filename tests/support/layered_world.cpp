#include "tests/support/layered_world.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <vector>

#include "terrain/base/file_io.h"
#include "terrain/check/check.h"
#include "terrain/check/check_decode.h"
#include "terrain/check/check_surface.h"
#include "terrain/encode/quantized_mesh_tile.h"
#include "terrain/surface/rim_samples.h"

namespace tind::test {

std::shared_ptr<const DemSource> made(HeightGrid grid, Geographic corner, double spacing,
                                      double turn) {
  return std::make_shared<const MadeUpSource>(std::move(grid), corner, spacing, turn);
}

Surface three_ranks(double lift) {
  HeightGrid top = rough_terrain(80, 80, 4, 300);
  top.at(40, 40) += float(lift);
  return *Surface::of_layers(
      {{"base", made(rough_terrain(60, 50, 1, 2000), {10, 50}, 0.02)},
       {"west", made(terrain_with_voids(90, 90, 2), {10.3, 49.7}, 0.004)},
       {"east", made(rough_terrain(90, 90, 3, 800), {10.55, 49.65}, 0.004, 0.1)},
       {"town", made(std::move(top), {10.6, 49.5}, 0.001, -0.3)}});
}

std::map<std::string, std::string> tiles_in(const std::string& folder) {
  std::map<std::string, std::string> tiles;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(folder))
    if (entry.path().extension() == ".terrain")
      tiles[entry.path().lexically_relative(folder).string()] =
          *read_whole_file(entry.path().string());
  return tiles;
}

void expect_no_violation(const std::string& folder, const Surface& surface) {
  const auto checked = check_tiles(folder, {.threads = 2, .source = surface});
  ASSERT_TRUE(checked) << checked.error().what;
  for (std::size_t rule = 0; rule < kCheckRuleCount; ++rule)
    if (kCheckRules[rule].severity == Severity::violation) {
      const auto& [count, examples] = checked->findings[rule];
      EXPECT_EQ(count, 0u) << kCheckRules[rule].id << (count ? ", " + examples[0] : "");
    }
}

namespace {

std::size_t expect_held(const std::string& name, const std::string& bytes,
                        const HeightField& field) {
  int z = 0;
  unsigned x = 0, y = 0;
  EXPECT_EQ(std::sscanf(name.c_str(), "%d/%u/%u", &z, &x, &y), 3);
  const auto id = tiling::tile(z, x, y);
  const std::vector<std::uint8_t> data(bytes.begin(), bytes.end());
  Findings none;
  CheckedTile tile;
  if (!id || !check_decode(data, name, tile, none)) {
    ADD_FAILURE() << name;
    return 0;
  }
  const auto samples = rim_samples(field, *id);
  const auto decoded = decode_tile(*id, data);
  if (!samples || !decoded || !decoded->certificate) {
    ADD_FAILURE() << name;
    return 0;
  }
  const TileSurface mesh(tile);
  for (const Vec3& s : *samples) {
    const auto gap = mesh.gap_at(s.x, s.y, s.z);
    EXPECT_TRUE(gap && std::abs(gap->worst()) <= decoded->certificate->max_error_m + 1e-3)
        << name << " at " << s.x << ", " << s.y;
    if (testing::Test::HasFailure()) break;
  }
  return samples->size();
}

}  // namespace

std::size_t expect_rims_held(const std::string& folder, const Surface& surface) {
  const HeightField field(surface);
  std::size_t looked_at = 0;
  for (const auto& [name, bytes] : tiles_in(folder)) looked_at += expect_held(name, bytes, field);
  return looked_at;
}

}  // namespace tind::test
