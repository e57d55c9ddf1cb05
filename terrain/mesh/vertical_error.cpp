// The referee. Every triangle is scan-converted over the posts that it covers; a post keeps the
// largest error that any triangle gives it, so the order of triangles does not matter, and bands of
// rows can be done by different threads. Largest errors are kept in double; the others as float
// (relative 6e-8), whose sums run in double and in post order.

#include "terrain/mesh/vertical_error.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "terrain/base/parallel.h"
#include "terrain/mesh/scan_triangle.h"

namespace tind {

namespace {

constexpr float kUncovered = -1;

struct Extreme {
  double error = -1;
  int col = -1, row = -1;

  /// The larger; of equals the first post, so that the answer does not depend on triangle order.
  void take(double e, int c, int r) {
    if (e < error || (e == error && (r > row || (r == row && c >= col)))) return;
    *this = {e, c, r};
  }
};

struct Band {
  Extreme above, below;
};

/// One span, post by post.
void measure_short(const PostSpan& span, const float* posts, float* out, Band& band) {
  for (int c = span.first; c <= span.last; ++c) {
    const double d = span.height(c) - posts[c];  // NaN at a void: compares false
    const float e = float(std::fabs(d));
    if (e > out[c]) out[c] = e;
    if (d >= band.above.error) band.above.take(d, c, span.row);
    if (-d >= band.below.error) band.below.take(-d, c, span.row);
  }
}

/// The same for long spans, kLanes posts at a time, so that the compiler uses vector registers;
/// only a group that holds a new extreme is looked at post by post.
void measure_long(PostSpan span, const float* posts, float* out, Band& band) {
  constexpr int kLanes = 16;
  for (; span.first + kLanes <= span.last + 1; span.first += kLanes) {
    double d[kLanes];
    const float* const p = posts + span.first;
    float* const o = out + span.first;
    for (int k = 0; k < kLanes; ++k) d[k] = span.height(span.first + k) - p[k];
    for (int k = 0; k < kLanes; ++k) {
      const float e = float(std::fabs(d[k]));
      o[k] = e > o[k] ? e : o[k];
    }
    unsigned extreme = 0;
    for (int k = 0; k < kLanes; ++k)
      extreme |= unsigned(d[k] >= band.above.error) | unsigned(-d[k] >= band.below.error);
    if (extreme == 0) continue;
    PostSpan group = span;
    group.last = span.first + kLanes - 1;
    measure_short(group, posts, out, band);
  }
  measure_short(span, posts, out, band);
}

/// Measures all triangles over rows [begin, end); `worst` holds the largest error per post.
Band measure_band(const Tin& mesh, const HeightGrid& grid, int begin, int end,
                  std::vector<float>& worst) {
  Band band;
  const int cols = grid.cols();
  const auto measure = [&](const PostSpan& span) {
    const float* const posts = grid.row(span.row).data();
    float* const out = worst.data() + std::size_t(span.row) * cols;
    if (span.last - span.first < 16)
      measure_short(span, posts, out, band);
    else
      measure_long(span, posts, out, band);
    return true;
  };
  for (const Triangle& t : mesh.triangles) {
    scan_triangle(mesh.vertices[t[0]], mesh.vertices[t[1]], mesh.vertices[t[2]], begin, end, cols,
                  measure);
  }
  return band;
}

/// Posts just outside the mesh get the largest error against the rims within `slack` of them.
/// `extremes` takes these in.
void measure_rims(const Tin& mesh, const HeightGrid& grid, double slack, std::vector<float>& worst,
                  Band& extremes) {
  const std::vector<float> before = worst;
  for (const Triangle& t : mesh.triangles) {
    const auto measure = [&](const PostSpan& span) {
      for (int c = span.first; c <= span.last; ++c) {
        const std::size_t i = std::size_t(span.row) * grid.cols() + c;
        if (before[i] != kUncovered || grid.is_void(c, span.row)) continue;
        const double x = std::clamp(double(c), span.x0, span.x1);
        const double d = span.z0 + (x - span.x0) * span.slope - grid.at(c, span.row);
        worst[i] = std::max(worst[i], float(std::fabs(d)));
        extremes.above.take(d, c, span.row);
        extremes.below.take(-d, c, span.row);
      }
      return true;
    };
    scan_triangle(mesh.vertices[t[0]], mesh.vertices[t[1]], mesh.vertices[t[2]], 0, grid.rows(),
                  grid.cols(), measure, slack);
  }
}

/// The smallest value that at least `share` of all are not above (nearest rank). Leaves everything
/// smaller in front of it: ask for large shares first, and the next search is shorter.
double percentile(std::vector<float>& values, std::size_t all, double share) {
  const std::size_t rank = std::max<std::size_t>(std::size_t(std::ceil(share * double(all))), 1);
  const auto nth = values.begin() + std::ptrdiff_t(rank - 1);
  std::nth_element(values.begin(), nth, values.end());
  values.resize(rank);
  return values.back();
}

/// Counts, sums and percentiles over the valid posts. Uses up `worst`.
void summarise(const HeightGrid& grid, std::vector<float>& worst, VerticalError& out) {
  double sum = 0, sum2 = 0;
  std::size_t kept = 0;
  const std::span<const float> heights = grid.values();
  for (std::size_t i = 0; i < heights.size(); ++i) {
    if (std::isnan(heights[i])) continue;
    if (worst[i] == kUncovered) {
      ++out.uncovered;
      continue;
    }
    const double e = worst[i];
    sum += e;
    sum2 += e * e;
    worst[kept++] = worst[i];
  }
  worst.resize(kept);
  out.posts = kept;
  if (kept == 0) return;
  out.mean_m = sum / double(kept);
  out.rms_m = std::sqrt(sum2 / double(kept));
  out.p99_m = percentile(worst, kept, 0.99);
  out.p95_m = percentile(worst, kept, 0.95);
  out.p50_m = percentile(worst, kept, 0.50);
}

}  // namespace

VerticalError vertical_error(const Tin& mesh, const HeightGrid& grid, int threads, double slack) {
  if (threads <= 0) threads = hardware_threads();
  std::vector<float> worst(grid.size(), kUncovered);
  std::vector<Band> bands(std::size_t(std::clamp(threads, 1, std::max(1, grid.rows()))));
  parallel_for(bands.size(), threads, [&](std::size_t i) {
    const auto edge = [&](std::size_t k) {
      return int(std::int64_t(grid.rows()) * std::int64_t(k) / std::int64_t(bands.size()));
    };
    bands[i] = measure_band(mesh, grid, edge(i), edge(i + 1), worst);
  });
  Band all;
  for (const Band& b : bands) {
    all.above.take(b.above.error, b.above.col, b.above.row);
    all.below.take(b.below.error, b.below.col, b.below.row);
  }
  if (slack > 0) measure_rims(mesh, grid, slack, worst, all);
  const auto& [above, below] = all;
  VerticalError out;
  out.max_above_m = std::max(0.0, above.error);
  out.max_below_m = std::max(0.0, below.error);
  Extreme most = above;
  most.take(below.error, below.col, below.row);
  if (most.col >= 0) {
    out.max_m = std::max(0.0, most.error);
    out.max_col = most.col;
    out.max_row = most.row;
  }
  summarise(grid, worst, out);
  return out;
}

}  // namespace tind
