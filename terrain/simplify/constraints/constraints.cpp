// Shapes become a repaired network (constraint_network.h), its points get heights
// (constraint_heights.h), and the mesh near it is triangulated anew (constrained_mesh.h).

#include "terrain/simplify/constraints/constraints.h"

#include "terrain/simplify/constraints/constrained_mesh.h"
#include "terrain/simplify/constraints/constraint_heights.h"
#include "terrain/simplify/constraints/constraint_network.h"

namespace tind {

std::string edges_alone_note(std::size_t triangles) {
  return "the edges that must stay alone need " + std::to_string(triangles) +
         " triangles, those in voids counted";
}

Result<Constraints> constrain(const Terrain& dem, const ConstraintShapes& shapes) {
  const HeightGrid& grid = dem.grid;
  if (grid.cols() < 2 || grid.rows() < 2 || grid.cols() > 32768 || grid.rows() > 32768) {
    return fail(Errc::out_of_range,
                "lines need a DEM of 2 x 2 to 32768 x 32768 posts: cut it to a part first");
  }
  Constraints out;
  out.dem = dem;
  auto net = constraint_network(grid, shapes, out.report);
  if (!net) return std::unexpected(net.error());
  give_heights(grid, shapes, *net, out);
  if (const auto ok = make_constrained_mesh(grid, *net, out); !ok)
    return std::unexpected(ok.error());
  out.flat = std::move(net->flat);
  out.boundary = std::move(net->boundary);
  return out;
}

}  // namespace tind
