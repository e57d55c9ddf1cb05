#include "terrain/simplify/common/samples.h"

namespace tind {

ScatteredSamples::ScatteredSamples(std::span<const Vec3> points, double extent, double per_bucket,
                                   Vec2 low)
    : low_(low) {
  side_ = std::clamp(int(std::sqrt(double(points.size()) / per_bucket)), 1, 2048);
  scale_ = side_ / extent;
  // A counting sort by bucket; within a bucket the given order stays.
  start_.assign(std::size_t(side_) * side_ + 1, 0);
  auto key = [&](const Vec3& p) {
    return std::size_t(bucket(p.y - low_.y)) * side_ + bucket(p.x - low_.x);
  };
  std::size_t valid = 0;
  for (const Vec3& p : points) {
    if (std::isnan(p.z)) continue;
    ++start_[key(p) + 1];
    ++valid;
  }
  for (std::size_t i = 1; i < start_.size(); ++i) start_[i] += start_[i - 1];
  points_.resize(valid);
  std::vector<std::uint32_t> fill(start_.begin(), start_.end() - 1);
  for (const Vec3& p : points)
    if (!std::isnan(p.z)) points_[fill[key(p)]++] = p;
}

}  // namespace tind
