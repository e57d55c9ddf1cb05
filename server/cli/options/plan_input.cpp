#include "server/cli/options/plan_input.h"

#include <filesystem>
#include <utility>

#include "server/cli/options/line_input.h"
#include "server/cli/options/memory_limit.h"
#include "server/cli/options/surface_input.h"
#include "terrain/base/file_io.h"

namespace tind::cli {

PlannedSource planned_source(const DemInput& dem, std::vector<std::string> layers,
                             std::vector<std::string> blends, std::vector<std::string> layer_errors,
                             const ShapeFiles& shapes) {
  return {dem.files, dem.texts,    std::move(layers), std::move(blends), std::move(layer_errors),
          shapes,    dem.allow_vrt};
}

Result<ShardPlan> read_plan(const std::string& path) {
  const auto text = read_regular_file(path);
  if (!text) return std::unexpected(text.error());
  auto plan = decode_shard_plan(*text);
  if (!plan) return fail(path, plan.error());
  return plan;
}

std::string shards_folder(const std::string& plan, const std::string& said) {
  if (!said.empty()) return said;
  const std::string parent = std::filesystem::path(plan).parent_path().string();
  return parent.empty() ? "." : parent;
}

Result<Surface> open_planned(const ShardPlan& plan, const std::vector<std::string>& files,
                             std::shared_ptr<const Environment> environment, std::uint64_t memory,
                             int& threads) {
  const PlannedSource& from = plan.source;
  if (!files.empty() && !from.layers.empty())
    return fail(Errc::invalid_argument,
                "the plan has layers (--layer): their files are where it says, none can be named");
  DemInput input;
  input.files = files.empty() ? from.files : files;
  input.to_datum = "ellipsoid";
  input.allow_vrt = from.allow_vrt;
  input.environment = std::move(environment);
  for (const auto& [name, text] : from.options)
    if (auto ok = say_dem_option(input, name, text); !ok)
      return fail("the plan's option " + name, ok.error());
  const SurfaceInput layers{from.layers, from.blends, from.layer_errors};
  DemOptions dem = dem_options(input);
  limit_caches(memory, input.files, dem);
  auto opened = open_surface(input, layers, dem);
  if (!opened) return opened;
  auto surface = with_shapes(std::move(*opened), from.shapes);
  if (!surface) return surface;
  const auto room = threads_within(memory, *surface, dem, threads);
  if (!room) return std::unexpected(room.error());
  threads = *room;
  return surface;
}

}  // namespace tind::cli
