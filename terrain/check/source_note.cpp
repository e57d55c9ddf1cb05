// What a record keeps is held against the same of the source, what costs nothing first.

#include "terrain/check/source_note.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <vector>

#include "terrain/pyramid/plan/level_plan.h"
#include "terrain/pyramid/plan/past_build.h"
#include "terrain/shapes/surface_shapes.h"
#include "terrain/surface/surface_blocks.h"

namespace tind {
namespace {

using Differences = std::vector<std::string>;

void compare_layers(const BuildRecord& record, const Surface& source, Differences& found) {
  const auto now = layer_records(source);
  const auto& were = record.layers;
  if (were.empty()) return;  // of a version that did not note them
  if (were.size() != now.size()) {
    found.push_back(fmt::format("{} {}, not {}", were.size(), were.size() == 1 ? "layer" : "layers",
                                now.size()));
    return;
  }
  const bool same_datum = record.vertical_datum == name(source.info().datum);
  for (std::size_t k = 0; k < now.size(); ++k) {
    const LayerRecord &was = were[k], &is = now[k];
    const std::string of = now.size() == 1 ? "the DEM" : source.layers()[k].name;
    if (was.crs != is.crs && same_datum)
      found.push_back("another CRS of " + of);
    else if (was.post_to_crs != is.post_to_crs || was.cols != is.cols || was.rows != is.rows)
      found.push_back("another grid of " + of);
    if (k > 0 && was.blend_m != is.blend_m)
      found.push_back(
          fmt::format("a blend of {} of {:.6g} m, not {:.6g} m", of, was.blend_m, is.blend_m));
  }
}

void compare_shapes(const BuildRecord& record, const Surface& source, Differences& found) {
  const SurfaceShapes* const shapes = source.shapes();
  const std::string now = shapes ? shapes->digest() : "";
  if (record.shapes == now) return;
  found.push_back(record.shapes.empty() ? "no lines, polygons or water"
                  : now.empty()         ? "lines, polygons or water, which are not given"
                                        : "other lines, polygons or water");
}

Result<bool> other_heights(const BuildRecord& record, const Surface& source, int threads,
                           const Progress& progress) {
  SurfaceBlocks blocks(source);
  const auto range = scan_heights(source, progress, threads, &blocks);
  if (!range) return std::unexpected(range.error());
  return blocks.digest() != record.heights;
}

}  // namespace

Result<std::string> source_note(const BuildRecord& record, const Surface& source, bool posts,
                                int threads, const Progress& progress) {
  Differences found;
  if (const std::string now = name(source.info().datum);
      !record.vertical_datum.empty() && record.vertical_datum != now)
    found.push_back(fmt::format("heights above {}, not {}", record.vertical_datum, now));
  compare_layers(record, source, found);
  compare_shapes(record, source, found);
  if (found.empty() && posts && !record.heights.empty()) {
    const auto other = other_heights(record, source, threads, progress);
    if (!other) return std::unexpected(other.error());
    if (*other) found.push_back("other heights (of the files, or by --nodata and the like)");
  }
  if (found.empty()) return std::string();
  return fmt::format("the tiles were made of another source, or with other options, than these: {}",
                     fmt::join(found, "; "));
}

}  // namespace tind
