#include "terrain/pyramid/plan/plan_source.h"

#include <optional>
#include <utility>

#include "terrain/base/temporary_folder.h"
#include "terrain/pyramid/plan/kept_range.h"
#include "terrain/surface/surface_blocks.h"

namespace tind {

Result<std::shared_ptr<const ResidualIndex>> index_for(const Surface& surface, const TilePlan& plan,
                                                       const std::string& path, int threads,
                                                       const Progress& progress,
                                                       std::span<const IndexPart> parts) {
  const IndexDepth& depth = plan.index_depth();
  if (depth.level() < 0) return nullptr;
  std::optional<TemporaryFolder> passing;  // what is open stays readable when it goes
  if (path.empty()) {
    auto folder = TemporaryFolder::make("index");
    if (!folder) return std::unexpected(folder.error());
    passing.emplace(std::move(*folder));
  }
  const std::string file = passing ? passing->path() + "/residuals" : path;
  auto index = ResidualIndex::open_or_make(file, surface, depth, threads, progress, parts);
  if (!index) return fail("the residual index of " + surface.info().files.front(), index.error());
  return index;
}

namespace {

/// Looks at all posts. What it finds is kept beside the index, where that has a path.
Result<KeptRange> range_of_posts(const Surface& surface, const TilePlan& outline,
                                 const std::string& index_path, int threads, bool with_content,
                                 const Progress& progress) {
  const std::string path = index_path.empty() ? index_path : index_path + ".range";
  if (!path.empty())
    if (auto kept = read_kept_range(path, surface, outline)) return kept;
  KeptRange found;
  SurfaceBlocks blocks(surface);
  const bool keep = !path.empty();
  auto range = scan_heights(surface, progress, threads, with_content || keep ? &blocks : nullptr);
  if (!range) return std::unexpected(range.error());
  if (auto done = find_level_ranges(surface, outline, *range); !done)
    return std::unexpected(done.error());
  found.range = std::move(*range);
  if (with_content || keep) found.content = blocks.digest();
  if (keep)
    if (auto kept = keep_range(path, surface, outline, found); !kept)
      return std::unexpected(kept.error());
  return found;
}

}  // namespace

Result<TilePlan> plan_source(const Surface& surface, const TileSetOptions& options,
                             const std::string& index_path, int threads, const Progress& progress,
                             std::string* content) {
  auto outline = TilePlan::make(surface, HeightRange{}, options);
  if (!outline) return outline;
  const bool indexed = outline->index_depth().level() >= 0, one = surface.only() != nullptr;
  const double scanned = !indexed ? 1 : one ? 0 : 0.3;  // of the work
  HeightRange range;
  if (!indexed || !one) {
    auto found = range_of_posts(surface, *outline, indexed ? index_path : std::string(), threads,
                                content != nullptr, progress.part(0, scanned));
    if (!found) return std::unexpected(found.error());
    range = std::move(found->range);
    if (content) *content = std::move(found->content);
  }
  if (!indexed) return TilePlan::make(surface, range, options);
  auto index = index_for(surface, *outline, index_path, threads, progress.part(scanned, 1));
  if (!index) return std::unexpected(index.error());
  if (one) {
    if ((*index)->posts() == 0) return fail(Errc::bad_data, no_valid_height(surface.info()));
    range = {(*index)->min_m(), (*index)->max_m(), (*index)->posts()};
  }
  auto plan = TilePlan::make(surface, range, options);
  if (plan) plan->use(std::move(*index));
  return plan;
}

}  // namespace tind
