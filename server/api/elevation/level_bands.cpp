#include "server/api/elevation/level_bands.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "terrain/analysis/heights_at.h"
#include "terrain/raster/post_place.h"

namespace tind::api {

Result<LevelBands> LevelBands::of(const services::ServedDataset& dataset,
                                  std::span<const Geographic> places, const std::stop_token& stop) {
  LevelBands out;
  const DemSource* const dem = dataset.source ? dataset.source->only() : nullptr;
  if (!dem || dataset.source->shapes()) return out;
  std::vector<Vec2> among(places.size()), corners;
  dem->to_post(places, among);
  out.first_ = {0};
  for (std::size_t i = 0; i < places.size(); ++i) {
    const auto at = place_among_posts(dem->info(), among[i]);
    if (at) {
      const double col = std::floor(at->x), row = std::floor(at->y);
      const double across[] = {1 - (at->x - col), at->x - col},
                   down[] = {1 - (at->y - row), at->y - row};
      for (int j = 0; j < 2; ++j)
        for (int k = 0; k < 2; ++k) {
          if (across[k] * down[j] == 0) continue;
          out.corners_.push_back({corners.size(), across[k] * down[j]});
          corners.push_back({col + k, row + j});
        }
    }
    out.first_.push_back(out.corners_.size());
  }
  out.posts_.resize(corners.size());
  dem->to_geographic(corners, out.posts_);
  const auto heights = heights_at(*dataset.source, out.posts_, Interpolation::nearest, stop);
  if (!heights) return std::unexpected(heights.error());
  for (const SurfaceHeight& h : *heights)
    out.valid_.push_back(h.height.coverage == Coverage::value);
  return out;
}

std::optional<Band> LevelBands::band(std::size_t place, const std::optional<LevelHeight>& mesh,
                                     std::span<const std::optional<LevelHeight>> at_posts) const {
  if (first_.empty() || !mesh || !mesh->max_error_m) return std::nullopt;
  const std::size_t from = first_[place], end = first_[place + 1];
  if (from == end) return std::nullopt;
  double height = -mesh->height_m, error = *mesh->max_error_m;
  for (std::size_t k = from; k < end; ++k) {
    const auto& post = at_posts[corners_[k].post];
    if (!valid_[corners_[k].post] || !post || !post->max_error_m) return std::nullopt;
    height += corners_[k].share * post->height_m;
    error = std::max(error, *post->max_error_m);
  }
  return Band{height - error, height + error};
}

}  // namespace tind::api
