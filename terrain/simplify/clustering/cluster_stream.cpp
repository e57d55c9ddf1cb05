#include <algorithm>
#include <cmath>

#include "terrain/simplify/clustering/clustering.h"
#include "terrain/simplify/collapse/collapse_method.h"

namespace tind {

namespace {

/// Passes rows on, and counts the triangles of the full mesh meanwhile.
class CountingRows {
 public:
  CountingRows(int cols, const ReadRow& read)
      : read_(read), north_(std::size_t(cols)), south_(std::size_t(cols)) {}

  Result<void> operator()(int row, std::span<float> heights) {
    if (auto ok = read_(row, heights); !ok) return ok;
    north_.swap(south_);
    std::ranges::transform(heights, south_.begin(), [](float z) { return !std::isnan(z); });
    if (row == 0) triangles_ = 0;
    for (std::size_t c = 0; row > 0 && c + 1 < south_.size(); ++c)
      triangles_ +=
          std::uint64_t(std::max(0, north_[c] + north_[c + 1] + south_[c] + south_[c + 1] - 2));
    return {};
  }
  std::uint64_t triangles() const { return triangles_; }

 private:
  const ReadRow& read_;
  std::vector<std::uint8_t> north_, south_;  // valid?
  std::uint64_t triangles_ = 0;
};

}  // namespace

Result<Simplified> cluster_stream(int cols, int rows, double sx, double sy, const StopAt& stop,
                                  const ReadRow& read, const Progress& progress) {
  if (const auto ok = check_stop(stop); !ok) return std::unexpected(ok.error());
  if (stop.max_error_m) {
    return fail(Errc::unsupported,
                "cluster cannot look for an error bound in a source that is too large for memory: "
                "give --triangles or --ratio, or cut the source");
  }
  if (cols < 2 || rows < 2) return fail(Errc::invalid_argument, "at least 2 x 2 posts are needed");
  const std::uint64_t full = 2 * std::uint64_t(cols - 1) * std::uint64_t(rows - 1);
  CountingRows counted(cols, read);
  Simplified best;
  double asked = double(target_triangles(stop, full));
  std::uint64_t target = 0;
  for (int pass = 0;; ++pass) {
    const ClusterGrid grid =
        cluster_grid(cols, rows, sx, sy, std::uint64_t(std::clamp(asked, 2.0, double(full))));
    Result<Tin> tin = cluster_rows(grid, sx, sy, std::ref(counted),
                                   progress.part(1 - std::exp2(-pass), 1 - std::exp2(-pass - 1)));
    if (!tin) return std::unexpected(tin.error());
    best.steps = std::uint64_t(pass) + 1;
    target = std::max<std::uint64_t>(2, target_triangles(stop, counted.triangles()));
    const std::size_t made = tin->triangles.size(), before = best.tin.triangles.size();
    if (before == 0 || (made <= target && (made > before || before > target))) {
      best.tin = std::move(*tin);
      best.details["clusters_across"] = grid.across;
      best.details["clusters_down"] = grid.down;
    }
    const double share = double(made) / double(target);
    // A few more triangles are worth a third pass; too many are not allowed, and 2 x 2 clusters,
    // where this ends, have two triangles.
    if (counted.triangles() == full || (share <= 1 && share > 0.97)) break;
    if (pass >= 2 && best.tin.triangles.size() <= target) break;
    asked *= (pass < 3 ? 0.99 : 0.5) / share;
  }
  best.input_triangles = counted.triangles();
  if (best.tin.triangles.size() != target) {
    best.note =
        "clusters come in whole rows and columns: " + std::to_string(best.tin.triangles.size()) +
        " triangles, not " + std::to_string(target);
  }
  return best;
}

}  // namespace tind
