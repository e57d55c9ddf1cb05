#pragma once
// The posts that a tile is fitted to and measured at, in tile coordinates (u, v, not rounded): of a
// tile, or of any rectangle that has a grid like a tile's.

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "terrain/base/result.h"
#include "terrain/geo/tiling_scheme.h"
#include "terrain/raster/dem_source.h"
#include "terrain/raster/height_grid.h"
#include "terrain/simplify/common/samples.h"
#include "terrain/surface/height_field.h"
#include "terrain/surface/surface.h"

namespace tind {

/// A window of posts: all that can lie in a rectangle, and a few more around.
struct PostWindow {
  std::int64_t col = 0, row = 0, cols = 0, rows = 0;  // clipped to the source; empty: no post
  double lon_shift = 0;  // add to the source's longitudes (plain lon/lat sources, 0..360)
  bool empty() const { return cols <= 0 || rows <= 0; }
};
/// One, or none; two where longitudes of more than half the globe end in the rectangle on either
/// side: the one of more columns first.
std::vector<PostWindow> post_windows(const DemSource&, const GeoRect&);
/// The first of them; empty where there is none.
PostWindow post_window(const DemSource&, const GeoRect&);
/// The posts near a rectangle that no post is in: all within so many, at least.
std::vector<PostWindow> windows_beside(const DemSource&, const GeoRect&, std::int64_t posts);

/// The posts of one layer that can count in a rectangle: every `step`-th of a window.
struct LayerWindow {
  std::size_t layer = 0;
  PostWindow posts;
  int step = 1;
  bool alone = true;  // no other layer has a say in the rectangle: heights are the layer's own
};
/// Of every layer that has any, the lowest first; two of one where post_windows() says two. A layer
/// whose posts leave no place in the rectangle to those below stands alone, where that takes no
/// more than a tile's share of posts to see; a layer of a surface of one always does.
Result<std::vector<LayerWindow>> surface_windows(const Surface&, const GeoRect&);

/// So many posts are held at a time by whoever looks at all of a window: half a million.
inline constexpr std::int64_t kPartPosts = 1 << 19;
/// A window in parts of about as many, row by row.
std::vector<LayerWindow> parts_of(const LayerWindow&);

/// THE place where posts become what a tile is fitted to and measured at: samples of its mesh, with
/// the heights that H has there. Owns the heights.
class TilePosts {
 public:
  TilePosts(TilePosts&&) = default;
  TilePosts& operator=(TilePosts&&) = default;

  /// `offset`: added to the samples' heights, not to min_m() and max_m(). `beside`: samples of H
  /// that are no posts (rim_samples.h), in tile coordinates.
  static Result<TilePosts> read(const HeightField&, std::span<const LayerWindow>, const GeoRect&,
                                double offset = 0, std::span<const Vec3> beside = {});
  static Result<TilePosts> read(const HeightField& field, std::span<const LayerWindow> windows,
                                TileId tile, double offset = 0, std::span<const Vec3> beside = {}) {
    return read(field, windows, tiling::rect(tile), offset, beside);
  }
  /// Of samples that are no posts.
  static TilePosts of_samples(std::span<const Vec3>, double offset = 0);
  /// The posts of one DEM, with the heights that it has itself.
  static Result<TilePosts> read(const DemSource&, const PostWindow&, const GeoRect&, int step,
                                double offset = 0);
  static Result<TilePosts> read(const DemSource& source, const PostWindow& window, TileId tile,
                                int step, double offset = 0) {
    return read(source, window, tiling::rect(tile), step, offset);
  }

  /// Calls f with the samples as whichever kind they are.
  template <class F>
  auto visit(F&& f) const {
    return plain_ ? f(grid_) : f(scattered_);
  }
  /// The same posts with other heights: z = f(u, v, z), z with the offset in it.
  TilePosts adapted(const std::function<double(double u, double v, double z)>& f) const;

  bool empty() const { return !(min_m_ <= max_m_); }
  double min_m() const { return min_m_; }  // of all samples
  double max_m() const { return max_m_; }
  std::uint64_t inside() const { return inside_; }  // valid posts in the closed rectangle

 private:
  TilePosts() = default;
  void count(double u, double v, double z);
  /// Adds a window's posts in tile coordinates, as samples.
  static Result<void> gather(const HeightField&, const LayerWindow&, const GeoRect&,
                             std::vector<Vec3>& points);

  bool plain_ = false;
  HeightGrid heights_;
  GridSamples grid_;
  ScatteredSamples scattered_;
  double min_m_ = HUGE_VAL, max_m_ = -HUGE_VAL;
  std::uint64_t inside_ = 0;
};

}  // namespace tind
