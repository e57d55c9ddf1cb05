#include "terrain/pyramid/plan/plan_source.h"

#include <unistd.h>

#include <atomic>
#include <filesystem>

#include "terrain/surface/surface_blocks.h"

namespace tind {

namespace {

/// A name for a file that nobody else will ask for.
std::string passing_path() {
  static std::atomic<unsigned> count{0};
  std::error_code error;
  auto folder = std::filesystem::temp_directory_path(error);
  if (error) folder = "/tmp";
  return (folder /
          ("tind-" + std::to_string(::getpid()) + "-" + std::to_string(count++) + ".residuals"))
      .string();
}

}  // namespace

int deepest_indexed_level(const Surface& surface, const TilePlan& plan) {
  const int deepest = deepest_indexed_level(surface, plan.options().exact_posts);
  // The level below the deepest has borders that leave room for the index, too.
  return plan.options().side != Side::both || deepest + 1 < plan.first_level() ? -1 : deepest;
}

Result<std::shared_ptr<const ResidualIndex>> index_for(const Surface& surface, const TilePlan& plan,
                                                       const std::string& path, int threads,
                                                       const Progress& progress) {
  const int deepest = deepest_indexed_level(surface, plan);
  if (deepest < 0) return nullptr;
  const std::string file = path.empty() ? passing_path() : path;
  auto index = ResidualIndex::open_or_make(file, surface, deepest + 1, threads, progress);
  if (path.empty()) {  // what is open stays readable
    ::unlink(file.c_str());
    ::unlink((file + ".part").c_str());
  }
  if (!index) return fail("the residual index of " + surface.info().files.front(), index.error());
  return index;
}

Result<TilePlan> plan_source(const Surface& surface, const TileSetOptions& options,
                             const std::string& index_path, int threads, const Progress& progress,
                             std::string* content) {
  auto outline = TilePlan::make(surface, HeightRange{}, options);
  if (!outline) return outline;
  auto index = index_for(surface, *outline, index_path, threads, progress);
  if (!index) return std::unexpected(index.error());
  if (!*index) {
    SurfaceBlocks blocks(surface);
    auto range = scan_heights(surface, progress, threads, content ? &blocks : nullptr);
    if (!range) return std::unexpected(range.error());
    if (auto done = find_level_ranges(surface, *outline, *range); !done)
      return std::unexpected(done.error());
    if (content) *content = blocks.digest();
    return TilePlan::make(surface, *range, options);
  }
  if ((*index)->posts() == 0) return fail(Errc::bad_data, no_valid_height(surface.info()));
  auto plan =
      TilePlan::make(surface, {(*index)->min_m(), (*index)->max_m(), (*index)->posts()}, options);
  if (plan) plan->use(std::move(*index));
  return plan;
}

}  // namespace tind
