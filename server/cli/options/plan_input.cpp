#include "server/cli/options/plan_input.h"

#include <filesystem>
#include <tuple>
#include <utility>

#include "server/cli/options/line_input.h"
#include "server/cli/options/memory_limit.h"
#include "server/cli/options/surface_input.h"
#include "terrain/base/file_io.h"

namespace tind::cli {

PlannedSource planned_source(const DemInput& dem, const SurfaceInput& layers,
                             const ShapeFiles& shapes) {
  return {dem.files,           dem.texts,      layers.layers, layers.blends,
          layers.layer_errors, layers.options, shapes,        dem.allow_vrt};
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

Result<std::string> shards_to_read(const std::string& plan, const std::string& said) {
  namespace fs = std::filesystem;
  std::string folder = shards_folder(plan, said);
  std::error_code error;
  fs::path path = folder;
  if (!path.has_filename()) path = path.parent_path();  // "work/"
  if (path.filename() == "shards" && !fs::exists(path / "shards", error) && fs::exists(path, error))
    return path.has_parent_path() ? path.parent_path().string() : ".";
  if (!said.empty() && !fs::is_directory(path, error))
    return fail(Errc::not_found, said + ": no such directory; name the one with the folder shards");
  return folder;
}

void add_named_again(Command c, NamedAgain& named) {
  c.add_option("--layer", named.layers, "NAME=FILE[,FILE...]: the same of a plan of layers")
      .repeated();
  for (const auto& [option, files] :
       {std::pair{"--breaklines", &named.shapes.breaklines},
        std::pair{"--flatten", &named.shapes.flatten},
        std::pair{"--boundary", &named.shapes.boundary}, std::pair{"--water", &named.shapes.water}})
    c.add_option(option, *files, "where the file is that was planned");
}

Result<Surface> open_planned(const ShardPlan& plan, const NamedAgain& named,
                             std::shared_ptr<const Environment> environment, std::uint64_t memory,
                             int& threads) {
  PlannedSource from = plan.source;
  if (!named.files.empty() && !from.layers.empty())
    return fail(
        Errc::invalid_argument,
        "the plan has layers: say where their files are with --layer NAME=FILE, all of them");
  if (!named.layers.empty() && from.layers.empty())
    return fail(Errc::invalid_argument, "the plan has no --layer: name its DEM files alone");
  if (!named.layers.empty()) from.layers = named.layers;
  if (!named.files.empty()) from.files = named.files;
  using Files = std::vector<std::string>;
  const std::tuple<const char*, const Files&, Files&> shapes[] = {
      {"--breaklines", named.shapes.breaklines, from.shapes.breaklines},
      {"--flatten", named.shapes.flatten, from.shapes.flatten},
      {"--boundary", named.shapes.boundary, from.shapes.boundary},
      {"--water", named.shapes.water, from.shapes.water}};
  for (const auto& [option, files, planned] : shapes) {
    if (files.empty()) continue;
    if (planned.empty())
      return fail(Errc::invalid_argument,
                  std::string("the plan has no ") + option + ": leave it out");
    planned = files;
  }
  DemInput input;
  input.files = from.files;
  input.to_datum = "ellipsoid";
  input.allow_vrt = from.allow_vrt;
  input.environment = std::move(environment);
  for (const auto& [name, text] : from.options)
    if (auto ok = say_dem_option(input, name, text); !ok)
      return fail("the plan's option " + name, ok.error());
  const SurfaceInput layers{from.layers, from.blends, from.layer_errors, from.layer_options};
  DemOptions dem = dem_options(input);
  limit_caches(memory, input, layers, dem);
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
