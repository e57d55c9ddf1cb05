#pragma once
// Land cover in equal stripes from west to east, a class each.

#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include "terrain/raster/land_cover.h"

namespace tind::test {

class MadeUpCover : public LandCover {
 public:
  MadeUpCover(GeoRect bounds, std::vector<CoverClass> classes, std::string fingerprint = "made up")
      : bounds_(bounds), classes_(std::move(classes)), fingerprint_(std::move(fingerprint)) {}

  void at(std::span<const Geographic> places,
          std::span<std::optional<std::uint16_t>> out) const override {
    for (std::size_t i = 0; i < places.size(); ++i) {
      out[i] = std::nullopt;
      if (!bounds_.contains(places[i])) continue;
      const double share = (places[i].lon - bounds_.west) / bounds_.width();
      out[i] = std::uint16_t(
          std::min(classes_.size() - 1, std::size_t(share * double(classes_.size()))));
    }
  }
  const std::vector<CoverClass>& classes() const override { return classes_; }
  const std::string& fingerprint() const override { return fingerprint_; }
  const GeoRect& bounds() const override { return bounds_; }

 private:
  GeoRect bounds_;
  std::vector<CoverClass> classes_;
  std::string fingerprint_;
};

}  // namespace tind::test
