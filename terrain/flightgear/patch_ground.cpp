// Triangles are cut in two at the middle of a side, which both triangles of the side have: so there
// is no vertex in the middle of anybody's side. Sides are cut longest first, on both of their sides
// ([Rivara97], LEPP), which keeps the triangles from getting thin.

#include "terrain/flightgear/patch_ground.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <optional>
#include <tuple>
#include <utility>

#include "terrain/flightgear/cover_materials.h"
#include "terrain/geo/ellipsoid.h"
#include "terrain/shapes/surface_shapes.h"
#include "terrain/surface/post_warp.h"
#include "terrain/tile/tile_model.h"

namespace tind::flightgear {
namespace {

constexpr std::uint32_t kLand = 0, kWater = 1, kFirstClass = 2;
constexpr int kMostProbes = 128;  // along a side of a triangle

class Cutter {
 public:
  Cutter(Tin& mesh, const PatchGround& ground, Vec2 unit_m)
      : mesh_(mesh), ground_(ground), unit_m_(unit_m) {
    for (std::uint32_t t = 0; t < mesh_.triangles.size(); ++t) link(t);
  }

  void run() {
    std::vector<std::uint32_t> open;
    open.reserve(mesh_.triangles.size());
    for (std::uint32_t t = 0; t < mesh_.triangles.size(); ++t) open.push_back(t);
    while (!open.empty()) {
      const std::uint32_t t = open.back();
      if (!is_large(t) || !is_mixed(t)) {
        open.pop_back();
        continue;
      }
      const std::size_t before = mesh_.triangles.size();
      if (!halve(t)) open.pop_back();
      for (std::size_t i = before; i < mesh_.triangles.size(); ++i)
        open.push_back(std::uint32_t(i));
    }
  }

 private:
  using Side = std::pair<std::uint32_t, std::uint32_t>;

  Tin& mesh_;
  const PatchGround& ground_;
  const Vec2 unit_m_;
  std::map<Side, std::uint32_t> triangle_of_;  // of each side, in the direction it has there

  Side side(std::uint32_t t, int k) const {
    const Triangle& corners = mesh_.triangles[t];
    return {corners[std::size_t(k)], corners[std::size_t((k + 1) % 3)]};
  }
  void link(std::uint32_t t) {
    for (int k = 0; k < 3; ++k) triangle_of_[side(t, k)] = t;
  }
  std::optional<std::uint32_t> beyond(Side s) const {
    const auto found = triangle_of_.find({s.second, s.first});
    if (found == triangle_of_.end()) return std::nullopt;
    return found->second;
  }
  double length(Side s) const {
    const Vec3 d = mesh_.vertices[s.second] - mesh_.vertices[s.first];
    return std::hypot(d.x * unit_m_.x, d.y * unit_m_.y);
  }
  /// The same for both triangles of a side, another for any other side.
  std::tuple<double, std::uint32_t, std::uint32_t> rank(Side s) const {
    const auto [low, high] = std::minmax(s.first, s.second);
    return {length({low, high}), low, high};
  }
  /// `only_shared`: of those that are no border; nothing where there is none.
  std::optional<Side> longest(std::uint32_t t, bool only_shared) const {
    std::optional<Side> best;
    for (int k = 0; k < 3; ++k) {
      const Side s = side(t, k);
      if (only_shared && !beyond(s)) continue;
      if (!best || rank(s) > rank(*best)) best = s;
    }
    return best;
  }

  /// Across the border's side, which stays as long as it is, a triangle is as wide as it is high.
  bool is_large(std::uint32_t t) const {
    const auto& [a, b, c] = mesh_.triangles[t];
    const double twice_area =
        orient2d(mesh_.vertices[a], mesh_.vertices[b], mesh_.vertices[c]) * unit_m_.x * unit_m_.y;
    for (int k = 0; k < 3; ++k)
      if (const Side s = side(t, k); !beyond(s) && twice_area <= kGroundDetail_m * length(s))
        return false;
    const auto cut = longest(t, true);
    return cut && length(*cut) > kGroundDetail_m;
  }
  bool is_mixed(std::uint32_t t) const {
    const auto& [ia, ib, ic] = mesh_.triangles[t];
    const Vec3 &a = mesh_.vertices[ia], &b = mesh_.vertices[ib], &c = mesh_.vertices[ic];
    const int n =
        std::clamp(int(std::ceil(length(*longest(t, false)) / kGroundDetail_m)), 2, kMostProbes);
    std::vector<Vec3> probes;
    for (int i = 0; i < n; ++i)
      for (int j = 0; i + j < n; ++j)
        probes.push_back(a + (b - a) * ((i + 1 / 3.) / n) + (c - a) * ((j + 1 / 3.) / n));
    const auto found = ground_.at(probes);
    return std::ranges::adjacent_find(found, std::not_equal_to()) != found.end();
  }

  /// Cuts it, or a neighbour first whose longest side is longer than theirs; not a side of the
  /// border.
  bool halve(std::uint32_t t) {
    auto s = longest(t, false);
    if (!beyond(*s)) {
      s = longest(t, true);
      if (s) split(*s);
      return s.has_value();
    }
    for (;;) {
      const Side next = *longest(*beyond(*s), false);
      if (rank(next) == rank(*s) || !beyond(next)) break;
      s = next;
    }
    split(*s);
    return true;
  }
  void split(Side s) {
    const auto middle = std::uint32_t(mesh_.vertices.size());
    mesh_.vertices.push_back((mesh_.vertices[s.first] + mesh_.vertices[s.second]) * 0.5);
    const std::uint32_t here = triangle_of_.at(s), there = *beyond(s);
    triangle_of_.erase(s);
    triangle_of_.erase({s.second, s.first});
    split(here, s, middle);
    split(there, {s.second, s.first}, middle);
  }
  void split(std::uint32_t t, Side s, std::uint32_t middle) {
    Triangle half = mesh_.triangles[t];
    std::ranges::replace(half, s.first, middle);
    std::ranges::replace(mesh_.triangles[t], s.second, middle);
    mesh_.triangles.push_back(half);
    link(t);
    link(std::uint32_t(mesh_.triangles.size() - 1));
  }
};

}  // namespace

PatchGround::PatchGround(const GeoRect& rect, const LandCover* cover)
    : rect_(rect), materials_{kLandMaterial, kWaterMaterial}, cover_(cover) {
  if (!cover) return;
  for (const std::string& one : class_materials(*cover))
    materials_.push_back(one.empty() ? kLandMaterial : one);
}

Result<PatchGround> PatchGround::make(const BucketPlan& plan, const GeoRect& rect,
                                      const LandCover* cover) {
  PatchGround ground(rect, cover);
  const SurfaceShapes* shapes = plan.surface().shapes();
  if (!shapes || shapes->water().empty()) return ground;
  auto mask = water_mask(shapes->water(), rect);
  if (!mask) return std::unexpected(mask.error());
  ground.mask_ = std::move(*mask);
  return ground;
}

int PatchGround::wet(const Vec3& p) const {
  const int side = int(std::lround(std::sqrt(double(mask_.size()))));
  const auto cell = [side](double t) {
    return std::clamp(int(t / kTileExtent * side), 0, side - 1);
  };
  return mask_[std::size_t(side - 1 - cell(p.y)) * std::size_t(side) + std::size_t(cell(p.x))];
}

std::vector<std::uint32_t> PatchGround::covers_at(std::span<const Vec3> points) const {
  std::vector<std::uint32_t> found(points.size(), kLand);
  if (!cover_ || !rect_.overlaps(cover_->bounds())) return found;
  std::vector<Geographic> places;
  for (const Vec3& p : points) places.push_back(place_of(rect_, p));
  std::vector<std::optional<std::uint16_t>> classes(places.size());
  cover_->at(places, classes);
  for (std::size_t i = 0; i < classes.size(); ++i)
    if (classes[i])  // classes of one name are one
      found[i] =
          std::uint32_t(std::ranges::find(materials_, materials_[kFirstClass + *classes[i]]) -
                        materials_.begin());
  return found;
}

std::vector<std::uint32_t> PatchGround::at(std::span<const Vec3> points) const {
  auto found = covers_at(points);
  for (std::size_t i = 0; !mask_.empty() && i < points.size(); ++i)
    if (wet(points[i]) > 127) found[i] = kWater;
  return found;
}

void PatchGround::cut(Tin& mesh) const {
  if (!cover_) return;
  const Vec2 degree = wgs84::metres_per_degree((rect_.south + rect_.north) / 2);
  Cutter(mesh, *this,
         {rect_.width() * degree.x / kTileExtent, rect_.height() * degree.y / kTileExtent})
      .run();
}

std::vector<std::uint32_t> PatchGround::of_triangles(const Tin& mesh) const {
  std::vector<std::uint32_t> of(mesh.triangles.size(), kLand);
  if (!cover_ && mask_.empty()) return of;
  std::vector<Vec3> probes;
  for (const auto& [ia, ib, ic] : mesh.triangles) {
    const Vec3 &a = mesh.vertices[ia], &b = mesh.vertices[ib], &c = mesh.vertices[ic];
    const Vec3 middle = (a + b + c) * (1 / 3.0);
    probes.insert(probes.end(),
                  {middle, (a + middle) * 0.5, (b + middle) * 0.5, (c + middle) * 0.5});
  }
  const auto found = covers_at(probes);
  for (std::size_t i = 0; i < of.size(); ++i) {
    const auto four = std::span(found).subspan(i * 4, 4);
    of[i] = *std::ranges::max_element(
        four, {}, [&](std::uint32_t one) { return std::ranges::count(four, one); });
    if (mask_.empty()) continue;
    int sum = 0;
    for (std::size_t k = 4 * i; k < 4 * i + 4; ++k) sum += wet(probes[k]);
    if (sum > 2 * 255) of[i] = kWater;
  }
  return of;
}

}  // namespace tind::flightgear
