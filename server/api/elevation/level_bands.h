#pragma once
// Between which heights the DEM's is at a place of which a mesh of tiles is known.

#include <cstddef>
#include <optional>
#include <span>
#include <stop_token>
#include <vector>

#include "server/api/app.h"
#include "terrain/base/result.h"
#include "terrain/geo/coordinates.h"
#include "terrain/tile/level_heights.h"

namespace tind::api {

/// What the DEM's height at a place can be, less the mesh's there.
struct Band {
  double low_m = 0, high_m = 0;
};

/// Tiles bound their error at posts; between them a mesh may be farther off. So the mesh is asked
/// at the posts around each place: two surfaces that are bilinear between posts, and within the
/// error at these, are so at the place.
class LevelBands {
 public:
  /// Of no place where the error is not one of this DEM alone (layers, shapes, no DEM); nor of one
  /// beside a void. Reads the posts around all places once. O(places log places).
  static Result<LevelBands> of(const services::ServedDataset&, std::span<const Geographic> places,
                               const std::stop_token&);

  /// At which the mesh must be asked, too.
  std::span<const Geographic> posts() const { return posts_; }

  /// Nothing where no tile states its error. `mesh`: what it is at the place; `at_posts`: at
  /// posts(), in their order.
  std::optional<Band> band(std::size_t place, const std::optional<LevelHeight>& mesh,
                           std::span<const std::optional<LevelHeight>> at_posts) const;

 private:
  struct Corner {
    std::size_t post;
    double share;
  };
  std::vector<Geographic> posts_;
  std::vector<bool> valid_;  // of posts_
  std::vector<Corner> corners_;
  std::vector<std::size_t> first_;  // of each place, one more at the end; empty: no bands
};

}  // namespace tind::api
