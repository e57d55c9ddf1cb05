// The referee. Every triangle is scan-converted over the posts that it covers; a post keeps the
// largest error that any triangle gives it, with its sign, so the order of triangles does not
// matter, and bands of rows can be done by different threads. Largest errors are kept in double;
// the others as float (relative 6e-8), whose sums run in double and in post order.

#include "terrain/mesh/vertical_error.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include "terrain/base/parallel.h"
#include "terrain/mesh/scan_triangle.h"
#include "terrain/mesh/triangle_plane.h"
#include "terrain/mesh/triangle_tree.h"

namespace tind {

namespace {

/// No triangle has been at the post: not below any error, so that the first one replaces it. Voids
/// stay like that.
constexpr float kUncovered = std::numeric_limits<float>::quiet_NaN();

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
    const float e = float(d);
    if (!(std::fabs(e) <= std::fabs(out[c]))) out[c] = e;
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
      const float e = float(d[k]);
      o[k] = !(std::fabs(e) <= std::fabs(o[k])) ? e : o[k];
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
        if (!std::isnan(before[i]) || grid.is_void(c, span.row)) continue;
        const double x = std::clamp(double(c), span.x0, span.x1);
        const double d = span.z0 + (x - span.x0) * span.slope - grid.at(c, span.row);
        if (!(std::fabs(float(d)) <= std::fabs(worst[i]))) worst[i] = float(d);
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

/// What is summed up over the covered valid posts.
class Sums {
 public:
  /// `e`: mesh - post. Rows from the first to the last.
  void add(double e) {
    sum_ += std::fabs(e);
    sum2_ += e * e;
    (e > 0 ? above_ : below_) += std::fabs(e);
  }
  void end_row(VerticalError& out) {
    signed_sum_ += above_ - below_;
    out.row_above_m.push_back(std::exchange(above_, 0));
    out.row_below_m.push_back(std::exchange(below_, 0));
  }
  void finish(VerticalError& out) const {
    if (out.posts == 0) return;
    out.mean_m = sum_ / double(out.posts);
    out.rms_m = std::sqrt(sum2_ / double(out.posts));
    out.bias_m = signed_sum_ / double(out.posts);
  }

 private:
  double sum_ = 0, sum2_ = 0, signed_sum_ = 0, above_ = 0, below_ = 0;
};

/// Of the covered posts. Uses up `errors`.
void set_percentiles(std::vector<float>& errors, VerticalError& out) {
  out.posts = errors.size();
  if (errors.empty()) return;
  out.p99_m = percentile(errors, out.posts, 0.99);
  out.p95_m = percentile(errors, out.posts, 0.95);
  out.p50_m = percentile(errors, out.posts, 0.50);
}

/// Counts, sums and percentiles over the valid posts. Uses up `worst`.
void summarise(const HeightGrid& grid, std::vector<float>& worst, VerticalError& out) {
  Sums sums;
  std::size_t kept = 0, i = 0;
  for (int row = 0; row < grid.rows(); ++row) {
    for (const float height : grid.row(row)) {
      const float e = worst[i++];
      if (std::isnan(height)) continue;
      if (std::isnan(e)) {
        ++out.uncovered;
        continue;
      }
      sums.add(e);
      worst[kept++] = std::fabs(e);
    }
    sums.end_row(out);
  }
  worst.resize(kept);
  set_percentiles(worst, out);
  sums.finish(out);
}

/// Measures the mesh over all rows of `grid`, in bands on several threads.
Band measure(const Tin& mesh, const HeightGrid& grid, int threads, double slack,
             std::vector<float>& worst) {
  if (threads <= 0) threads = hardware_threads();
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
  return all;
}

void set_extremes(const Band& all, VerticalError& out) {
  const auto& [above, below] = all;
  out.least_above_m = above.error, out.least_below_m = below.error;
  out.max_above_m = std::max(0.0, above.error);
  out.max_below_m = std::max(0.0, below.error);
  Extreme most = above;
  most.take(below.error, below.col, below.row);
  if (most.col >= 0) {
    out.max_m = std::max(0.0, most.error);
    out.max_col = most.col;
    out.max_row = most.row;
  }
}

/// Errors, counted by their leading bits: as many bins for each doubling.
class Histogram {
 public:
  void add(float e) { ++count_[std::bit_cast<std::uint32_t>(e) >> kDropped]; }

  double percentile(std::uint64_t all, double share) const {
    const auto rank = std::max<std::uint64_t>(std::uint64_t(std::ceil(share * double(all))), 1);
    std::uint64_t below = 0;
    for (std::uint32_t bin = 0; bin < count_.size(); ++bin) {
      below += count_[bin];
      if (below < rank) continue;
      return bin == 0 ? 0 : std::bit_cast<float>(((bin + 1) << kDropped) - 1);  // its upper end
    }
    return 0;
  }

 private:
  static constexpr int kDropped = 12;  // of 23 bits
  std::vector<std::uint64_t> count_ = std::vector<std::uint64_t>(std::size_t(1) << (31 - kDropped));
};

/// Which triangles touch each strip, in order.
std::vector<std::vector<std::uint32_t>> triangles_by_strip(const Tin& mesh, int rows, int height,
                                                           double slack) {
  std::vector<std::vector<std::uint32_t>> in(std::size_t((rows + height - 1) / height));
  const auto strip_of = [&](double row) {
    return std::size_t(std::clamp(row / height, 0.0, double(in.size() - 1)));
  };
  for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) {
    const auto& [a, b, c] = mesh.triangles[t];
    const double y[] = {mesh.vertices[a].y, mesh.vertices[b].y, mesh.vertices[c].y};
    const auto [south, north] = std::minmax({y[0], y[1], y[2]});
    const std::size_t last = strip_of(slack - south + 1e-6);
    for (std::size_t s = strip_of(-north - slack - 1e-6); s <= last; ++s) in[s].push_back(t);
  }
  return in;
}

/// Those triangles, with the first row of the strip as row 0.
Tin cut_out(const Tin& mesh, const std::vector<std::uint32_t>& triangles, int first_row) {
  Tin part;
  for (const std::uint32_t t : triangles) {
    const auto n = std::uint32_t(part.vertices.size());
    for (const std::uint32_t v : mesh.triangles[t]) {
      const Vec3& p = mesh.vertices[v];
      part.vertices.push_back({p.x, p.y + first_row, p.z});
    }
    part.triangles.push_back({n, n + 1, n + 2});
  }
  return part;
}

/// Mesh minus point, the largest that a triangle gives it that is at most `hair` away; NaN where
/// there is none.
double error_at(const Tin& mesh, const TriangleTree& tree, const Vec3& p, double hair) {
  double worst = std::numeric_limits<double>::quiet_NaN();
  tree.each_near({{p.x - hair, p.y - hair}, {p.x + hair, p.y + hair}}, [&](std::uint32_t t) {
    const auto& [i, j, k] = mesh.triangles[t];
    const Vec3& a = mesh.vertices[i];
    const Vec3 *b = &mesh.vertices[j], *c = &mesh.vertices[k];
    const double area = orient2d(a, *b, *c);
    if (area < 0) std::swap(b, c);
    if (area == 0) return true;  // what it covers its neighbours do
    const auto inside = [&](const Vec3& from, const Vec3& to) {
      return orient2d(from, to, p) >= -hair * std::hypot(to.x - from.x, to.y - from.y);
    };
    if (!inside(a, *b) || !inside(*b, *c) || !inside(*c, a)) return true;
    const double e = height_in(a, *b, *c, p.x, p.y) - p.z;
    // Of two as large the one above, so that the order of triangles does not matter.
    if (!(std::fabs(e) < std::fabs(worst)) && !(std::fabs(e) == std::fabs(worst) && e < worst))
      worst = e;
    return true;
  });
  return worst;
}

/// What rounding makes of the distance from an edge, in the mesh's units.
double rounding_of(const Tin& mesh) {
  if (mesh.vertices.empty()) return 0;
  Vec3 low = mesh.vertices[0], high = low;
  for (const Vec3& v : mesh.vertices) {
    low = {std::min(low.x, v.x), std::min(low.y, v.y), 0};
    high = {std::max(high.x, v.x), std::max(high.y, v.y), 0};
  }
  return 1e-15 * std::hypot(high.x - low.x, high.y - low.y);
}

}  // namespace

VerticalError widened(VerticalError e, double rounding_m) {
  if (e.posts == 0 || rounding_m == 0) return e;
  e.max_m += rounding_m;
  e.least_above_m += rounding_m, e.least_below_m += rounding_m;
  e.max_above_m = std::max(0.0, e.least_above_m), e.max_below_m = std::max(0.0, e.least_below_m);
  return e;
}

VerticalError vertical_error(const Tin& mesh, const HeightGrid& grid, int threads, double slack) {
  std::vector<float> worst(grid.size(), kUncovered);
  VerticalError out;
  set_extremes(measure(mesh, grid, threads, slack, worst), out);
  summarise(grid, worst, out);
  return out;
}

Result<VerticalError> vertical_error_in_strips(const Tin& mesh, int cols, int rows,
                                               const ReadStrip& read, int threads, double slack) {
  constexpr int kStrip = 256;
  const auto triangles = triangles_by_strip(mesh, rows, kStrip, slack);
  VerticalError out;
  Band all;
  Histogram histogram;
  Sums sums;
  std::vector<float> worst;
  for (int row = 0; row < rows; row += kStrip) {
    const auto strip = read(row, std::min(kStrip, rows - row));
    if (!strip) return std::unexpected(strip.error());
    if (strip->cols() != cols) return fail(Errc::internal, "a strip of another width");
    worst.assign(strip->size(), kUncovered);
    const Tin part = cut_out(mesh, triangles[std::size_t(row / kStrip)], row);
    Band band = measure(part, *strip, threads, slack, worst);
    for (Extreme* e : {&band.above, &band.below})
      if (e->row >= 0) e->row += row;
    all.above.take(band.above.error, band.above.col, band.above.row);
    all.below.take(band.below.error, band.below.col, band.below.row);
    for (std::size_t i = 0; i < worst.size(); ++i) {
      const float e = worst[i];
      if (std::isnan(strip->values()[i])) {
      } else if (std::isnan(e)) {
        ++out.uncovered;
      } else {
        ++out.posts;
        sums.add(e);
        histogram.add(std::fabs(e));
      }
      if ((i + 1) % std::size_t(cols) == 0) sums.end_row(out);
    }
  }
  set_extremes(all, out);
  sums.finish(out);
  if (out.posts == 0) return out;
  out.p50_m = histogram.percentile(out.posts, 0.50);
  out.p95_m = histogram.percentile(out.posts, 0.95);
  out.p99_m = histogram.percentile(out.posts, 0.99);
  return out;
}

VerticalError vertical_error(const Tin& mesh, std::span<const Vec3> points, double z_unit_m,
                             int threads, double slack) {
  constexpr std::size_t kBatch = 4096;
  const TriangleTree tree(mesh);
  const double hair = rounding_of(mesh);
  std::vector<double> errors(points.size());
  parallel_for((points.size() + kBatch - 1) / kBatch, threads, [&](std::size_t batch) {
    const std::size_t end = std::min(points.size(), (batch + 1) * kBatch);
    for (std::size_t i = batch * kBatch; i < end; ++i) {
      errors[i] = error_at(mesh, tree, points[i], hair);
      if (slack > hair && std::isnan(errors[i])) errors[i] = error_at(mesh, tree, points[i], slack);
      errors[i] *= z_unit_m;
    }
  });
  VerticalError out;
  Sums sums;
  std::vector<float> covered;
  covered.reserve(points.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    const double e = errors[i];
    if (std::isnan(e)) {
      ++out.uncovered;
      continue;
    }
    sums.add(e);
    covered.push_back(float(std::fabs(e)));
    out.max_above_m = std::max(out.max_above_m, e);
    out.max_below_m = std::max(out.max_below_m, -e);
    out.least_above_m = std::max(out.least_above_m, e);
    out.least_below_m = std::max(out.least_below_m, -e);
    if (std::fabs(e) > out.max_m || covered.size() == 1)
      out.max_m = std::fabs(e), out.max_at = points[i];
  }
  sums.end_row(out);
  out.row_above_m.clear(), out.row_below_m.clear();
  set_percentiles(covered, out);
  sums.finish(out);
  return out;
}

}  // namespace tind
