#pragma once
// The points of a profile as they come along its line, each place once, gaps in their middle.

#include <cstddef>
#include <utility>
#include <vector>

#include "terrain/analysis/profile.h"
#include "terrain/geo/geodesic_path.h"

namespace tind {

class ProfilePoints {
 public:
  /// Distances that are closer together are one point.
  static constexpr double kSame_m = 1e-6;

  explicit ProfilePoints(const GeodesicPath& path) : path_(path) {}

  void ground(double metres, double height) {
    end_gap(metres, false);
    if (!out_.empty() && out_.back().height.coverage == Coverage::value &&
        metres - out_.back().distance_m <= kSame_m)
      return;
    out_.push_back({metres, path_.at(metres), {Coverage::value, height}});
  }
  /// From here on there is no height, until ground() says so.
  void nothing_from(double metres) {
    if (gap_from_ < 0) gap_from_ = metres;
  }
  std::vector<ProfilePoint> taken() {
    end_gap(path_.length_m(), true);
    return std::move(out_);
  }
  std::size_t size() const { return out_.size(); }

 private:
  /// `last`: the line ends in it.
  void end_gap(double metres, bool last) {
    if (gap_from_ < 0) return;
    const double from = std::exchange(gap_from_, -1);
    const bool first = out_.empty();
    const double middle = (from + metres) / 2;
    if (first) void_at(0);
    if (metres - from > kSame_m) void_at(middle);
    if (last && metres - from > kSame_m) void_at(metres);
  }
  void void_at(double metres) {
    if (!out_.empty() && out_.back().height.coverage != Coverage::value &&
        metres <= out_.back().distance_m)
      return;
    out_.push_back({metres, path_.at(metres), {Coverage::void_, 0}});
  }

  const GeodesicPath& path_;
  std::vector<ProfilePoint> out_;
  double gap_from_ = -1;  // where a gap began; below 0: there is none
};

}  // namespace tind
