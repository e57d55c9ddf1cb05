#include "terrain/simplify/collapse/collapse_method.h"

#include <algorithm>
#include <array>
#include <string>

namespace tind {

std::size_t target_triangles(const StopAt& stop, std::size_t input) {
  if (stop.triangles) return *stop.triangles;
  // Rounded down, for it is a limit; but 0.29 of 100 is 29, whatever the product says.
  if (stop.ratio) return std::size_t(std::floor(*stop.ratio * double(input) * (1 + 1e-12)));
  return 0;
}

std::string stop_note(const StopAt& stop, std::size_t input, std::size_t left) {
  if (stop.max_error_m) return {};
  const std::size_t target = target_triangles(stop, input);
  if (target > input) {
    return "the full mesh has only " + std::to_string(input) + " triangles, not " +
           std::to_string(target);
  }
  if (left <= target) return {};
  return "stopped at " + std::to_string(left) + " triangles, not " + std::to_string(target) +
         ": any further collapse would flip a triangle or move the border";
}

void put_on_lattice(HalfedgeMesh& mesh, const Lattice& lattice) {
  for (HalfedgeMesh::Index v = 0; v < mesh.vertex_slots(); ++v)
    mesh.position(v) = lattice.snap(mesh.position(v));
}

std::vector<double> error_ladder(double from, double to) {
  struct Step {
    double first, factor;  // of a power of ten
    int parts;
  };
  constexpr std::array<Step, 3> kDecade = {{{1, 2, 12}, {2, 2.5, 16}, {5, 2, 12}}};
  std::vector<double> rungs;
  for (int ten = int(std::floor(std::log10(from)));; ++ten) {
    // A power of ten that is as exact as text would be.
    const double unit = ten < 0 ? 1 / std::pow(10, -ten) : std::pow(10, ten);
    for (const Step& s : kDecade) {
      for (int k = 0; k < s.parts; ++k) {
        const double rung = unit * s.first * std::pow(s.factor, double(k) / s.parts);
        if (!(rung > from)) continue;
        rungs.push_back(rung);
        if (rung >= to) return rungs;
      }
    }
  }
}

std::vector<double> error_ladder(const HeightGrid& grid, const StopAt& stop,
                                 const Lattice& lattice) {
  float low = HUGE_VALF, high = -HUGE_VALF;
  for (const float z : grid.values())
    if (!std::isnan(z)) low = std::min(low, z), high = std::max(high, z);
  const double relief = high >= low ? double(high) - low : 0;
  if (!(relief > 0)) return {};
  // Below this, rungs would be many and each of little use.
  const double least = std::max(lattice.z_step_m, 1e-4 * relief);
  return error_ladder(std::max(least, stop.max_error_m.value_or(0)), relief);
}

}  // namespace tind
