#pragma once
// What the steps of make_tile hand on to each other. Only files of this folder include this.

#include <array>
#include <chrono>
#include <cmath>
#include <functional>
#include <memory>
#include <optional>
#include <stop_token>
#include <vector>

#include "terrain/base/result.h"
#include "terrain/mesh/tin.h"
#include "terrain/pyramid/plan/height_steps.h"
#include "terrain/pyramid/plan/level_plan.h"
#include "terrain/pyramid/plan/line_scale.h"
#include "terrain/pyramid/residual/residual_lattice.h"
#include "terrain/simplify/common/held_colours.h"
#include "terrain/store/tile_set.h"
#include "terrain/surface/height_field.h"
#include "terrain/surface/surface.h"
#include "terrain/surface/tile_posts.h"
#include "terrain/tile/border.h"
#include "terrain/tile/tile_lines.h"
#include "terrain/tile/tile_model.h"

namespace tind {

/// Everything about one tile that several steps need.
struct TileJob {
  TileCost cost;
  const Surface& surface;
  const TilePlan& plan;
  TileId id;
  GeoRect rect;
  const LevelPlan& level;
  HeightSteps steps;  // of its borders, and of its own heights at most
  std::vector<LayerWindow> windows;
  HeightField field;
  std::array<std::vector<BorderVertex>, 4> borders;  // west, south, east, north
  double edge_error_m = 0;                           // of the worst of them
  std::vector<std::vector<Vec3>> stand_in;    // lines that the mesh has where children are missing
  std::array<CrossingVertices, 4> crossings;  // of the dataset's lines with the borders
  TileLines lines;                            // those inside, as the fit at hand has them
  double line_error_m = 0;                    // of breaklines between vertices; 0: as it comes
  struct Posts {
    double min_m = HUGE_VAL, max_m = -HUGE_VAL;
    std::uint64_t posts = 0;
    bool any() const { return min_m <= max_m; }
  } posts;                         // all valid ones in the closed rectangle; its range: with
  std::vector<Vec3> beside;        // samples of H beside the posts of layers
  std::optional<TilePosts> whole;  // they, where not too many; offset as the level's
  std::optional<ResidualLattice> lattice;  // stands for the posts, where there are very many
  MethodOptions method;                    // that fits the mesh
  double inner = 1;                        // share of the band that it gets
  bool surrounds = false;  // where insertion gives up, the posts around become vertices
  std::shared_ptr<const HeldColours> colours;  // that it is to show; null: none

  TileJob(const Surface& s, const TilePlan& p, TileId t)
      : surface(s),
        plan(p),
        id(t),
        rect(tiling::rect(t)),
        level(p.level(t)),
        field(s),
        method(p.options().method) {}

  /// Only one layer has a say.
  bool alone() const { return !windows.empty() && windows.front().alone; }
  double spacing_m() const;  // of the finest layer that has posts here
};

/// Posts to be skipped between those that the mesh is fitted to, so that they are not too many: a
/// power of two.
int decimation(const PostWindow&);
/// Of one layer of the tile, and of the one that is skipped most.
int decimation(const TileJob&, const LayerWindow&);
int decimation(const TileJob&);

/// Fills job.beside. REQUIRES: windows and heights in the job.
Result<void> find_rims(TileJob&);

/// Calls f with all posts of the tile, a part of the window at a time.
Result<void> stream_posts(const TileJob&, std::stop_token,
                          const std::function<void(const TilePosts&)>& f);

/// Vertices (u, v in 0..32767, height on the lattice), and what the referee says of them.
struct TileMesh {
  Tin mesh;
  HeightLattice lattice;
  std::uint32_t pinned = 0;  // its first vertices, which stay: borders and what holds the curvature
  double max_error = 0;
  double wrong_side = 0;  // one-sided tiles: how far some post is on the wrong side
};

/// The mesh within the level's budget, or the best that there is. REQUIRES: heights, borders and
/// what is known of the posts in the job.
Result<TileMesh> fit_tile(TileJob&, std::stop_token);

/// Order, normals, culling volumes, certificate.
Result<TileModel> finish_tile(TileJob&, const TileMesh&);

/// Adds the time until it goes out of scope.
class Stopwatch {
 public:
  explicit Stopwatch(double& seconds) : seconds_(seconds) {}
  ~Stopwatch() { seconds_ += std::chrono::duration<double>(Clock::now() - start_).count(); }
  Stopwatch(const Stopwatch&) = delete;
  Stopwatch& operator=(const Stopwatch&) = delete;

 private:
  using Clock = std::chrono::steady_clock;
  double& seconds_;
  Clock::time_point start_ = Clock::now();
};

}  // namespace tind
