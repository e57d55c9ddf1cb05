#include "terrain/mesh/between_posts.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "terrain/base/parallel.h"
#include "terrain/raster/interpolate.h"

namespace tind {
namespace {

struct Extremes {
  double above = 0, below = 0;
  Vec2 above_at{-1, -1}, below_at{-1, -1};

  /// `d`: mesh - surface; NaN (no surface) compares false.
  void take(double d, Vec2 at) {
    if (d > above) above = d, above_at = at;
    if (-d > below) below = -d, below_at = at;
  }
  void take(const Extremes& other) {
    take(other.above, other.above_at);
    take(-other.below, other.below_at);
  }
};

/// The two ends of each edge, the smaller vertex in the upper half; each edge once.
std::vector<std::uint64_t> edges_of(const Tin& mesh) {
  std::vector<std::uint64_t> edges;
  edges.reserve(mesh.triangles.size() * 3);
  for (const Triangle& t : mesh.triangles)
    for (int k = 0; k < 3; ++k) {
      const auto [a, b] = std::minmax(t[std::size_t(k)], t[std::size_t((k + 1) % 3)]);
      edges.push_back(std::uint64_t(a) << 32 | b);
    }
  std::ranges::sort(edges);
  const auto rest = std::ranges::unique(edges);
  edges.erase(rest.begin(), rest.end());
  return edges;
}

/// Along one edge, from cell to cell.
class EdgeWalk {
 public:
  explicit EdgeWalk(const HeightGrid& grid) : grid_(grid) {}

  /// a, b: column, row, height.
  void measure(const Vec3& a, const Vec3& b, Extremes& out) {
    a_ = a, d_ = {b.x - a.x, b.y - a.y, b.z - a.z};
    cuts_.clear();
    cuts_.push_back(0);
    cut(a.x, d_.x, grid_.cols() - 1);
    const auto rows = std::ptrdiff_t(cuts_.size());
    cut(a.y, d_.y, grid_.rows() - 1);
    cuts_.push_back(1);
    std::inplace_merge(cuts_.begin(), cuts_.begin() + rows, cuts_.end());
    for (std::size_t i = 1; i < cuts_.size(); ++i) measure_piece(cuts_[i - 1], cuts_[i], out);
  }

 private:
  const HeightGrid& grid_;
  Vec3 a_{}, d_{};            // the edge is a + t d, t from 0 to 1
  std::vector<double> cuts_;  // where it goes into another cell

  /// Where the edge crosses whole numbers of one coordinate, those of the grid's `last` + 1 lines.
  void cut(double from, double by, int last) {
    if (by == 0) return;
    const double low = std::max(0.0, std::ceil(std::min(from, from + by)));
    const double high = std::min(double(last), std::floor(std::max(from, from + by)));
    const auto at = [&](double line) { return std::clamp((line - from) / by, 0.0, 1.0); };
    if (by > 0)
      for (double line = low; line <= high; ++line) cuts_.push_back(at(line));
    else
      for (double line = high; line >= low; --line) cuts_.push_back(at(line));
  }

  Vec2 place(double t) const { return {a_.x + t * d_.x, a_.y + t * d_.y}; }

  /// From t0 to t1 the edge stays in one cell.
  void measure_piece(double t0, double t1, Extremes& out) const {
    const Vec2 middle = place((t0 + t1) / 2);
    constexpr double kRim = 1e-6;  // posts: what a mesh from a file may lie outside by rounding
    const int cols = grid_.cols(), rows = grid_.rows();
    if (!(middle.x >= -kRim && middle.x <= cols - 1 + kRim && middle.y >= -kRim &&
          middle.y <= rows - 1 + kRim))
      return;
    const int c = std::clamp(int(std::floor(middle.x)), 0, std::max(0, cols - 2));
    const int r = std::clamp(int(std::floor(middle.y)), 0, std::max(0, rows - 2));
    const int c1 = std::min(c + 1, cols - 1), r1 = std::min(r + 1, rows - 1);
    const double z00 = grid_.at(c, r), z10 = grid_.at(c1, r);
    const double z01 = grid_.at(c, r1), z11 = grid_.at(c1, r1);
    const auto take = [&](double fx, double fy, double t) {
      const double d = a_.z + t * d_.z - height_between(z00, z10, z01, z11, fx, fy);
      out.take(d, place(t));
      return d;
    };
    const auto at = [&](double t) {
      const Vec2 p = place(t);
      return take(std::clamp(p.x - c, 0.0, 1.0), std::clamp(p.y - r, 0.0, 1.0), t);
    };
    const double first = at(t0), last = at(t1), length = t1 - t0;
    const double twist = z00 - z10 - z01 + z11;
    if (!std::isnan(twist)) {  // a parabola: d(t0 + s) = first + slope s + bend s^2
      const double bend = -twist * d_.x * d_.y;
      const double slope = (last - first) / length - bend * length;
      const double s = -slope / (2 * bend);
      if (s > 0 && s < length) at(t0 + s);
      return;
    }
    // Planes of three posts end at a diagonal of the cell.
    const double x = a_.x - c, y = a_.y - r;
    const auto at_diagonal = [&](double t, bool falling) {
      if (!(t > t0 && t < t1)) return;
      const double fx = std::clamp(x + t * d_.x, 0.0, 1.0);
      take(fx, falling ? fx : 1 - fx, t);
    };
    at_diagonal((1 - x - y) / (d_.x + d_.y), false);
    at_diagonal((y - x) / (d_.x - d_.y), true);
  }
};

}  // namespace

SurfaceError surface_error(const Tin& mesh, const HeightGrid& grid, const VerticalError& at_posts,
                           int threads) {
  Extremes all;
  const Vec2 worst_post{double(at_posts.max_col), double(at_posts.max_row)};
  all.take(at_posts.max_above_m, worst_post);
  all.take(-at_posts.max_below_m, worst_post);
  if (grid.size() > 0) {
    const std::vector<std::uint64_t> edges = edges_of(mesh);
    constexpr std::size_t kShare = 1 << 14;
    std::vector<Extremes> shares((edges.size() + kShare - 1) / kShare);
    parallel_for(shares.size(), threads, [&](std::size_t i) {
      EdgeWalk walk(grid);
      const auto post = [&](std::uint64_t v) {
        const Vec3& p = mesh.vertices[std::size_t(v)];
        return Vec3{p.x, -p.y, p.z};
      };
      const std::size_t end = std::min(edges.size(), (i + 1) * kShare);
      for (std::size_t e = i * kShare; e < end; ++e)
        walk.measure(post(edges[e] >> 32), post(edges[e] & 0xffffffffu), shares[i]);
    });
    for (const Extremes& share : shares) all.take(share);
  }
  return {all.above, all.below, all.above >= all.below ? all.above_at : all.below_at};
}

}  // namespace tind
