#pragma once
// Every triangle that a sequence of collapses ever had, and which of them can be in one mesh
// together: the multi-triangulation of [DeFloriani97], the vertex hierarchy of [Hoppe97] with the
// strictest of legality rules.
//
// A *node* is one collapse, seen from both sides: the triangles that it took away are the node's
// *fine* ones, those that came in their place its *coarse* ones; both cover the same ground. To
// refine is to apply a node: its coarse triangles go, its fine ones come. It may be applied when
// all its coarse triangles are there, that is, when the nodes that made them have been applied
// (its parents). So any set of nodes that holds the parents of each of its members - a *front* -
// stands for one mesh. That mesh was built by replacing patches of one valid mesh by others with
// the same rim: nothing flips, nothing overlaps, nothing is missing, whatever the order.
//
// And each triangle of it was measured, over every post that it covers, when it came about: the
// error of a front needs no estimate and no second look.
//
// Nodes are numbered as they were collapsed: 0 is the finest. A triangle has one maker (or belongs
// to the base) and one node that splits it (or is one of the finest). 24 bytes a triangle, about
// 170 bytes a post for half-edge collapses of a whole grid.

#include <cstdint>
#include <span>
#include <vector>

#include "terrain/mesh/halfedge_mesh.h"
#include "terrain/mesh/tin.h"
#include "terrain/raster/terrain.h"

namespace tind {

class MultiTriangulation {
 public:
  using Index = std::uint32_t;
  static constexpr Index kNone = ~Index(0);

  std::size_t nodes() const { return first_fine_.empty() ? 0 : first_fine_.size() - 1; }
  std::size_t triangles() const { return corners_.size(); }
  std::span<const Vec3> vertices() const { return vertices_; }  // post coordinates

  /// Triangles [base_begin(), triangles()) are the base mesh.
  Index base_begin() const { return first_fine_.back(); }

  const Triangle& corners(Index triangle) const { return corners_[triangle]; }
  /// Not below the largest vertical distance to any post that the triangle covers, metres.
  float error_m(Index triangle) const { return error_[triangle]; }
  /// Not below the steepest slope of the finest triangles under it, degrees.
  int steepest_deg(Index triangle) const { return steepest_[triangle]; }
  /// The node whose application takes the triangle away; kNone for the finest triangles.
  Index splitter(Index triangle) const { return splitter_[triangle]; }
  /// The node whose application brings it; kNone for the base. O(log nodes).
  Index maker(Index triangle) const;

  /// A coarse triangle of a node, by its maker (kNone: the base) and its number.
  struct Coarse {
    Index maker, triangle;
  };
  Index coarse_begin(Index node) const { return first_coarse_[node]; }
  Index coarse_end(Index node) const { return first_coarse_[node + 1]; }
  Coarse coarse(Index i) const {
    const Index c = coarse_[i];
    if (c & kBaseFlag) return {kNone, base_begin() + (c & ~kBaseFlag)};
    return {c / kMostFine, first_fine_[c / kMostFine] + c % kMostFine};
  }
  Index fine_begin(Index node) const { return first_fine_[node]; }
  Index fine_end(Index node) const { return first_fine_[node + 1]; }

  /// The vertex that the node adds when applied; vertices that no node adds belong to the base.
  Index added_vertex(Index node) const { return added_[node]; }
  /// Where the collapse moved the surviving vertex, a node adds that one's finer place as well.
  Index moved_vertex(Index node) const { return moved_.empty() ? kNone : moved_[node]; }
  /// Vertices of the base, in ascending order.
  std::vector<Index> base_vertices() const;

  std::size_t memory_bytes() const;

 private:
  friend class MultiTriangulationBuilder;
  static constexpr Index kBaseFlag = Index(1) << 31;
  static constexpr Index kMostFine = 64;  // fine triangles of one node

  std::vector<Vec3> vertices_;
  std::vector<Triangle> corners_;
  std::vector<float> error_;
  std::vector<std::uint8_t> steepest_;
  std::vector<Index> splitter_;
  std::vector<Index> coarse_;  // maker * kMostFine + place, or kBaseFlag + place in the base
  std::vector<Index> first_fine_, first_coarse_;
  std::vector<Index> added_, moved_;
};

/// Watches collapses and keeps what they replaced. Borrows the mesh (not yet collapsed) and the
/// posts; both outlive it.
class MultiTriangulationBuilder {
 public:
  using Index = HalfedgeMesh::Index;
  static constexpr std::size_t kMostNodes = (std::size_t(1) << 31) / MultiTriangulation::kMostFine;

  /// REQUIRES: mesh.vertex_slots() <= kMostNodes.
  MultiTriangulationBuilder(HalfedgeMesh& mesh, const Terrain& dem);

  /// Collapses h (origin(h) vanishes into dest(h)) and moves dest(h) to `at`. False, and nothing
  /// done, when too many triangles meet there for one node. REQUIRES: the collapse is legal and
  /// flips nothing.
  bool collapse(Index h, const Vec3& at);

  /// What is left is the base. The builder is used up.
  MultiTriangulation finish();

 private:
  struct Slot {  // a triangle of the mesh: what will be known of it
    Index splitter, coarse_at;
    float error;
    std::uint8_t steepest;
  };
  void measure(Index triangle, std::uint8_t steepest);
  std::uint8_t slope(Index triangle) const;
  void keep(Index triangle, Index reference);

  HalfedgeMesh& mesh_;
  const Terrain& dem_;
  MultiTriangulation made_;
  std::vector<Slot> slots_;
  std::vector<Index> vertex_;  // of a mesh's vertex slot: the vertex that stands there now
  std::vector<Index> star_;
};

}  // namespace tind
