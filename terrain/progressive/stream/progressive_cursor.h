#pragma once
// A progressive mesh held at any state, and moved to any other by splits and their inverses.

#include <array>
#include <span>

#include "proto/stream/split_topology.h"
#include "terrain/base/result.h"
#include "terrain/progressive/stream/progressive_mesh.h"

namespace tind {

class ProgressiveCursor {
 public:
  using Index = std::uint32_t;

  /// At the base. Keeps a reference to `mesh`, which must outlive it. Fails (bad_data) when the
  /// base is no manifold or a split names what is not there. One pass over all splits.
  static Result<ProgressiveCursor> open(const ProgressiveMesh& mesh);

  std::size_t position() const { return topology_.splits(); }
  std::size_t size() const { return mesh_->splits.size(); }
  std::size_t triangles() const { return topology_.faces(); }
  /// The bound on the vertical error of the mesh as it is now.
  double error_m() const;

  /// The state after `count` splits. GUARANTEES: the same arrays whichever way it was reached.
  /// O(|count - position()|), no search and no allocation on the way down.
  void seek(std::size_t count);

  /// The first state whose bound is at most `error_m`; the last one if none is.
  std::size_t position_for_error(double error_m) const;
  /// The last state of at most `triangles` triangles (the base if even that has more).
  std::size_t position_for_triangles(std::size_t triangles) const;

  /// The mesh as it is now. With `ahead` in 0..1, the geomorph to the next state: its triangles,
  /// with the two vertices of the next split on their way from where the one lies now.
  Tin extract() const;
  Tin geomorph(double ahead);

  std::span<const Vec3> positions() const { return {positions_.data(), topology_.vertices()}; }
  const proto::SplitTopology& topology() const { return topology_; }

 private:
  const ProgressiveMesh* mesh_ = nullptr;
  proto::SplitTopology topology_;
  std::vector<proto::SplitTopology::Place> places_;  // of each split
  std::vector<std::uint32_t> triangles_after_;       // of each split
  std::vector<Vec3> positions_;                      // of all vertices there will ever be

  void up();
  void down();
};

}  // namespace tind
