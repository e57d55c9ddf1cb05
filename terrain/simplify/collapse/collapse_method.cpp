#include "terrain/simplify/collapse/collapse_method.h"

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

}  // namespace tind
