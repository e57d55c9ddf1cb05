#pragma once
// How a layer ends in what lies below it, without a step: delta surface fill (Grohman, Kroenung and
// Strebeck 2006). What lies below is bent to the layer, outwards from its valid posts; the layer's
// own heights stay as they are.

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <unordered_map>
#include <vector>

#include "terrain/base/result.h"
#include "terrain/geo/coordinates.h"
#include "terrain/raster/dem_source.h"
#include "terrain/raster/height_grid.h"
#include "terrain/surface/surface.h"

namespace tind {

/// Of a post where the layer is valid, the correction is its height less that of the surface below;
/// of any other within `blend_m` of such posts a mean of their corrections, weighted by
/// (1/d - 1/blend)^2 (Franke and Little), of the nearest to the left and to the right in each row
/// and above and below in each column, times a slope from 1 to 0 at blend_m. (Of rows alone, a rim
/// along a row would go on as a curtain: each column has only its own posts beside it.) In a cell
/// between posts that are all valid the layer says the height; in any other it is
///   bilinear(correction) + s bilinear(below at the posts) + (1 - s) below at the place
/// with s = bilinear(1 at valid posts, 0 else): so H is continuous across the sides of all cells,
/// whatever the surface below does between posts. (With one post that is not valid: linear over
/// three posts instead, on both sides of the diagonal.) For one thread.
class LayerBlend {
 public:
  /// The surface below: heights, and how much of a height that is (1 where it has one, 0 where
  /// there is nothing near).
  using Below = std::function<void(std::span<const Geographic> places, std::span<double> heights,
                                   std::span<double> shares)>;

  /// REQUIRES: a layer of a Surface, which outlives this.
  explicit LayerBlend(const SurfaceLayer&);

  /// Could the layer bend anything at these post coordinates?
  bool near(Vec2 post) const;

  /// For places where the layer has no height of its own: brings `heights`, those of the surface
  /// below there, to what they are beside the layer. REQUIRES: near(post) for each.
  Result<void> bend(std::span<const Vec2> posts, std::span<double> heights, const Below& below);

 private:
  struct Post {
    std::int64_t col, row;
    auto operator<=>(const Post&) const = default;
  };
  /// What is known of a valid post.
  struct Known {
    double height = 0, below = 0;
    bool counts = false;  // the surface below has a height there
    double correction() const { return height - below; }
  };
  /// A square of the source's posts with its surroundings.
  struct Block {
    HeightGrid around;
    std::vector<std::int16_t> left, right;  // columns to the nearest valid post in the row
    std::vector<std::int16_t> up, down;     // rows to the nearest in the column
    bool any = false;
  };
  struct Corner {
    bool valid = false;
    double correction = 0, below = 0;
  };

  const DemSource& source_;
  const DemInfo& info_;
  Vec2 spacing_m_;
  double blend_m_;
  int reach_cols_, reach_rows_;
  std::unordered_map<std::uint64_t, std::shared_ptr<const Block>> blocks_;
  std::unordered_map<std::uint64_t, Known> known_;
  std::unordered_map<std::uint64_t, double> means_;  // corrections of posts that are not valid

  Post normal(Post) const;
  static std::uint64_t key(Post p) {
    return std::uint64_t(p.row + (1ll << 30)) << 32 | std::uint64_t(p.col + (1ll << 30));
  }
  Result<std::shared_ptr<const Block>> block_of(Post);
  float own_height(const Block&, Post) const;
  template <class F>
  void each_near(const Block&, Post, F&& f) const;
  static void find_nearest(Block&, int none_in_row, int none_in_column);
  Result<void> learn(std::span<const Post> posts, const Below& below);
  Result<double> mean(Post);
};

}  // namespace tind
