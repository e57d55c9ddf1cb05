#include "terrain/progressive/stream/space_lattice.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <string>

#include "proto/stream/mesh_stream.h"

namespace tind {

namespace {

constexpr double kMostX = proto::kMostInSpace / 2.;  // leaves room for vertices outside the box

struct Box {
  Vec3 low{HUGE_VAL, HUGE_VAL, HUGE_VAL}, high{-HUGE_VAL, -HUGE_VAL, -HUGE_VAL};

  explicit Box(std::span<const Tin* const> meshes) {
    for (const Tin* mesh : meshes) {
      for (const Vec3& v : mesh->vertices) {
        low = {std::min(low.x, v.x), std::min(low.y, v.y), std::min(low.z, v.z)};
        high = {std::max(high.x, v.x), std::max(high.y, v.y), std::max(high.z, v.z)};
      }
    }
    if (!(low.x <= high.x)) low = high = {};
  }
  double widest() const { return std::max({high.x - low.x, high.y - low.y, high.z - low.z}); }
  double farthest() const {
    return std::max({std::abs(low.x), std::abs(low.y), std::abs(low.z), std::abs(high.x),
                     std::abs(high.y), std::abs(high.z)});
  }
};

/// None when the box is too wide, or too far from 0, for so fine a lattice.
std::optional<SpaceLattice> lattice_over(const Box& box, double per_unit) {
  if (!(box.widest() * per_unit / 2 <= kMostX && box.farthest() * per_unit < 0x1p51)) return {};
  const auto middle = [&](double a, double b) { return std::nearbyint((a + b) / 2 * per_unit); };
  return SpaceLattice{per_unit,
                      {middle(box.low.x, box.high.x), middle(box.low.y, box.high.y),
                       middle(box.low.z, box.high.z)}};
}

std::string short_number(double v) {
  std::array<char, 32> text;
  const auto end = std::to_chars(text.begin(), text.end(), v, std::chars_format::general, 4);
  return {text.begin(), end.ptr};
}

bool holds(const SpaceLattice& lattice, std::span<const Tin* const> meshes) {
  return std::ranges::all_of(meshes, [&](const Tin* mesh) {
    return std::ranges::all_of(mesh->vertices, [&](const Vec3& v) { return lattice.snap(v) == v; });
  });
}

}  // namespace

Vec3 SpaceLattice::whole(const Vec3& p) const {
  return {std::nearbyint(p.x * per_unit) - origin.x, std::nearbyint(p.y * per_unit) - origin.y,
          std::nearbyint(p.z * per_unit) - origin.z};
}

Vec3 SpaceLattice::place(const Vec3& x) const {
  return {(origin.x + x.x) / per_unit, (origin.y + x.y) / per_unit, (origin.z + x.z) / per_unit};
}

std::optional<SpaceLattice> exact_lattice(std::span<const Tin* const> meshes) {
  const Box box(meshes);
  double ten = 1;
  for (int digits = 0; digits <= 9; ++digits, ten *= 10)
    if (const auto l = lattice_over(box, ten); l && holds(*l, meshes)) return l;
  for (int bits = 1; bits <= 60; ++bits)
    if (const auto l = lattice_over(box, std::exp2(bits)); l && holds(*l, meshes)) return l;
  return {};
}

SpaceLattice finest_lattice(std::span<const Tin* const> meshes) {
  const Box box(meshes);
  int bits = 60;
  while (bits > -900 && !lattice_over(box, std::exp2(bits))) --bits;
  return lattice_over(box, std::exp2(bits)).value_or(SpaceLattice{});
}

SpaceLattice lattice_between(std::span<const Tin* const> meshes) {
  const Box box(meshes);
  auto exact = exact_lattice(meshes);
  if (!exact) return finest_lattice(meshes);
  // Twice as many steps hold every place of the lattice, and its quotients round to the same.
  const double enough = 1e6 / length(box.high - box.low);
  while (exact->per_unit < enough) {
    const auto finer = lattice_over(box, 2 * exact->per_unit);
    if (!finer) break;
    exact = finer;
  }
  return *exact;
}

Result<SpaceLattice> lattice_of_step(std::span<const Tin* const> meshes, double step) {
  if (!(step > 0 && std::isfinite(step)))
    return fail(Errc::invalid_argument, "the step of the coordinates must be above 0");
  double per_unit = 1 / step;  // 0.001 is not a double, 1000 is
  if (std::abs(per_unit - std::round(per_unit)) <= 1e-9 * per_unit) per_unit = std::round(per_unit);
  if (const auto l = lattice_over(Box(meshes), per_unit)) return *l;
  return fail(Errc::invalid_argument, "the step " + short_number(step) +
                                          " is too fine for a mesh of this size: at least " +
                                          short_number(1 / finest_lattice(meshes).per_unit));
}

double diagonal_of(const Tin& mesh) {
  const Tin* const meshes[] = {&mesh};
  const Box box(meshes);
  return length(box.high - box.low);
}

}  // namespace tind
