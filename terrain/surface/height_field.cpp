// Of layers, each place is brought up from the topmost layer that has a height there, through the
// layers above, which may bend it. Places are handled together, because PROJ and the layers below
// are asked for many at once.

#include "terrain/surface/height_field.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "terrain/geo/longitude.h"
#include "terrain/shapes/surface_shapes.h"

namespace tind {

namespace {

constexpr double kNothing = std::numeric_limits<double>::quiet_NaN();

}  // namespace

HeightField::HeightField(Surface surface) : surface_(std::move(surface)) {
  for (const SurfaceLayer& layer : surface_.layers()) layers_.emplace_back(*layer.source);
  for (std::size_t k = 1; k < layers_.size(); ++k) blends_.emplace_back(surface_.layers()[k]);
}

Result<void> HeightField::load(std::size_t layer, std::int64_t col, std::int64_t row, int cols,
                               int rows) {
  return layers_[layer].load(col, row, cols, rows);
}

std::optional<Error> HeightField::error() const {
  if (error_) return error_;
  for (const LayerField& layer : layers_)
    if (layer.error()) return layer.error();
  return {};
}

/// Places and what is known of each so far.
struct HeightField::Places {
  std::span<const Geographic> where;
  std::span<double> heights;   // of the layers so far; NaN: none
  std::vector<double> shares;  // how much of a height that is
  std::vector<int> from;       // the layer that says it; -1: none does, it is filled

  explicit Places(std::span<const Geographic> places, std::span<double> h)
      : where(places), heights(h), shares(places.size(), 0), from(places.size(), -1) {}
};

/// From the top down: the first of layers begin .. end - 1 that has a height.
void HeightField::find_own(std::size_t begin, std::size_t end, Places& p) const {
  std::vector<std::size_t> open(p.where.size());
  for (std::size_t i = 0; i < open.size(); ++i) open[i] = i;
  std::vector<Geographic> places;
  std::vector<double> heights;
  std::vector<Vec2> posts;
  for (std::size_t k = end; k-- > begin && !open.empty();) {
    std::vector<std::size_t> asked;
    places.clear();
    for (const std::size_t i : open) {
      const Geographic& at = p.where[i];
      if (!surface_.reaches(k, {at.lon, at.lat, at.lon, at.lat})) continue;
      asked.push_back(i);
      places.push_back(at);
    }
    if (asked.empty()) continue;
    heights.resize(places.size());
    posts.resize(places.size());
    layers_[k].inside(places, heights, posts);
    for (std::size_t n = 0; n < asked.size(); ++n)
      if (!std::isnan(heights[n])) {
        p.heights[asked[n]] = heights[n];
        p.shares[asked[n]] = 1;
        p.from[asked[n]] = int(k);
      }
    std::erase_if(open, [&](std::size_t i) { return p.from[i] >= 0; });
  }
}

/// Layer k over what is known of those below it.
void HeightField::add_layer(std::size_t k, Places& p) const {
  const DemSource& source = *surface_.layers()[k].source;
  LayerBlend& blend = blends_[k - 1];
  std::vector<std::size_t> asked;
  std::vector<Geographic> places;
  for (std::size_t i = 0; i < p.where.size(); ++i) {
    const Geographic& at = p.where[i];
    // Where nothing lies below, the layer fills what is farther away, too.
    const bool may = p.from[i] < int(k) && !std::isnan(p.heights[i]) &&
                     (p.shares[i] < 1 || surface_.reaches(k, {at.lon, at.lat, at.lon, at.lat}));
    if (!may) continue;
    asked.push_back(i);
    places.push_back(at);
  }
  if (asked.empty()) return;
  std::vector<Vec2> posts(places.size());
  source.to_post(places, posts);
  std::vector<std::size_t> bent;
  std::vector<Vec2> at;
  std::vector<double> heights;
  for (std::size_t n = 0; n < asked.size(); ++n) {
    if (p.shares[asked[n]] == 0 || !blend.near(posts[n])) continue;
    bent.push_back(n);
    at.push_back(posts[n]);
    heights.push_back(p.heights[asked[n]]);
  }
  const auto below = [&](std::span<const Geographic> where, std::span<double> h,
                         std::span<double> shares) { fill(k, where, h, shares); };
  if (auto done = blend.bend(at, heights, below); !done) {
    if (!error_) error_ = done.error();
    return;
  }
  std::vector<double> old;
  old.reserve(asked.size());
  for (const std::size_t i : asked) old.push_back(p.heights[i]);
  for (std::size_t b = 0; b < bent.size(); ++b) p.heights[asked[bent[b]]] = heights[b];

  // What the layer says alone, where there is not all of a height below.
  std::vector<std::size_t> alone;
  places.clear();
  for (std::size_t n = 0; n < asked.size(); ++n)
    if (p.shares[asked[n]] < 1) alone.push_back(n), places.push_back(p.where[asked[n]]);
  if (alone.empty()) return;
  std::vector<double> own(places.size()), shares(places.size());
  layers_[k].filled(places, own, shares);
  for (std::size_t a = 0; a < alone.size(); ++a) {
    const std::size_t i = asked[alone[a]];
    const double share = p.shares[i];
    p.heights[i] = share * p.heights[i] + (1 - share) * (own[a] + (1 - shares[a]) * old[alone[a]]);
    p.shares[i] = std::max(share, shares[a]);
  }
}

/// The surface of the lowest `layers` layers, its voids filled.
void HeightField::fill(std::size_t layers, std::span<const Geographic> places,
                       std::span<double> heights, std::span<double> shares) const {
  Places p(places, heights);
  std::ranges::fill(heights, kNothing);
  find_own(0, layers, p);
  std::vector<std::size_t> open;
  std::vector<Geographic> where;
  for (std::size_t i = 0; i < places.size(); ++i)
    if (p.from[i] < 0) open.push_back(i), where.push_back(places[i]);
  std::vector<double> h(open.size()), s(open.size());
  layers_[0].filled(where, h, s);
  for (std::size_t n = 0; n < open.size(); ++n) p.heights[open[n]] = h[n], p.shares[open[n]] = s[n];
  for (std::size_t k = 1; k < layers; ++k) add_layer(k, p);
  std::ranges::copy(p.shares, shares.begin());
}

void HeightField::at(std::span<const Geographic> places, std::span<double> heights,
                     std::span<int> deciding) const {
  if (layers_.size() == 1) {
    layers_[0].at(places, heights);
    level(places, heights);
    for (std::size_t i = 0; i < deciding.size(); ++i) deciding[i] = std::isnan(heights[i]) ? -1 : 0;
    return;
  }
  Places p(places, heights);
  std::ranges::fill(heights, kNothing);
  find_own(0, layers_.size(), p);
  if (!deciding.empty()) std::ranges::copy(p.from, deciding.begin());
  for (std::size_t k = 1; k < layers_.size(); ++k) add_layer(k, p);
  level(places, heights);
}

/// What is level is so between posts, too, and in voids.
void HeightField::level(std::span<const Geographic> places, std::span<double> heights) const {
  const SurfaceShapes* shapes = surface_.shapes();
  if (!shapes || shapes->level_areas().empty()) return;
  for (std::size_t i = 0; i < places.size(); ++i)
    if (const auto level = shapes->level_at(places[i])) heights[i] = *level;
}

void HeightField::filled(std::span<const Geographic> places, std::span<double> heights) const {
  if (layers_.size() == 1 && !ground_) {
    layers_[0].filled(places, heights);
    return level(places, heights);
  }
  std::vector<double> shares(places.size());
  if (layers_.size() == 1)
    layers_[0].filled(places, heights, shares);
  else
    fill(layers_.size(), places, heights, shares);
  if (ground_) add_ground(places, heights, shares);
  level(places, heights);
}

/// What is filled is a share of some height: the rest is the ground's.
void HeightField::add_ground(std::span<const Geographic> places, std::span<double> heights,
                             std::span<const double> shares) const {
  std::vector<std::size_t> partly;
  std::vector<Geographic> where;
  for (std::size_t i = 0; i < places.size(); ++i)
    if (shares[i] < 1) partly.push_back(i), where.push_back(places[i]);
  std::vector<double> ground(where.size());
  ground_(where, ground);
  for (std::size_t k = 0; k < partly.size(); ++k)
    heights[partly[k]] += (1 - shares[partly[k]]) * ground[k];
}

void HeightField::raise(std::size_t layer, std::span<const Geographic> places,
                        std::span<double> heights) const {
  if (layer + 1 >= layers_.size()) return;
  std::vector<double> above(places.size(), kNothing);
  Places higher(places, above);
  find_own(layer + 1, layers_.size(), higher);
  Places p(places, heights);
  for (std::size_t i = 0; i < places.size(); ++i) {
    p.from[i] = int(layer);
    p.shares[i] = 1;
    if (higher.from[i] >= 0) heights[i] = kNothing;
  }
  for (std::size_t k = layer + 1; k < layers_.size(); ++k) add_layer(k, p);
  const SurfaceShapes* shapes = surface_.shapes();  // no rim bends what is level
  if (!shapes || shapes->level_areas().empty()) return;
  for (std::size_t i = 0; i < places.size(); ++i)
    if (!std::isnan(heights[i]))
      if (const auto level = shapes->level_at(places[i])) heights[i] = *level;
}

namespace {

/// What the layers say of a place.
Result<SurfaceHeight> height_of_layers(const Surface& surface, Geographic place) {
  if (const DemSource* dem = surface.only()) {
    const auto found = height_at(*dem, place);
    if (!found) return std::unexpected(found.error());
    return SurfaceHeight{*found, 0};
  }
  const HeightField field(surface);
  double height = 0;
  int layer = -1;
  field.at({&place, 1}, {&height, 1}, {&layer, 1});
  if (const auto error = field.error()) return std::unexpected(*error);
  if (layer >= 0) return SurfaceHeight{{Coverage::value, height}, std::size_t(layer)};
  // A void of one is a void; else it is outside of all.
  for (const SurfaceLayer& l : surface.layers()) {
    const auto found = height_at(*l.source, place);
    if (!found) return std::unexpected(found.error());
    if (found->coverage != Coverage::outside) return SurfaceHeight{{Coverage::void_, 0}, 0};
  }
  return SurfaceHeight{};
}

}  // namespace

Result<SurfaceHeight> height_at(const Surface& surface, Geographic place) {
  auto found = height_of_layers(surface, place);
  const SurfaceShapes* shapes = surface.shapes();
  if (!found || !shapes || found->height.coverage == Coverage::outside) return found;
  // Between posts the shore is where the polygon says, not half a cell beside it.
  place = within_first_turn(place);
  const auto level = shapes->level_at(place);
  if (level && !shapes->outside(place)) found->height = {Coverage::value, *level};
  return found;
}

}  // namespace tind
