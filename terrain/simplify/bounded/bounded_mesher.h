#pragma once
// The working parts of `bounded`: a mesh, the samples that it must stay close to, and the edits
// that keep it close. bounded.h says what the method promises and why it works.
//
// Invariant between edits: every valid sample lies within `eps` of the mesh, and every triangle is
// certainly counter-clockwise. Insertion may give up a sample, so callers measure the result.

#include <cstdint>
#include <span>
#include <vector>

#include "terrain/base/progress.h"
#include "terrain/mesh/halfedge_mesh.h"
#include "terrain/simplify/bounded/bounded_star.h"
#include "terrain/simplify/common/samples.h"
#include "terrain/simplify/insertion/delaunay_insertion.h"

namespace tind {

struct MesherOptions {
  double eps = 1;                // half width of the band, metres
  double relief = 0;             // range of the samples' heights: what rounding is in proportion to
  double x_scale = 1;            // metric length of an x unit over that of a y unit
  bool any_place = false;        // samples lie anywhere (InsertionOptions)
  bool locked_border = false;    // border vertices stay as they are (tiles)
  bool integer_lattice = false;  // vertices on integers in [0, lattice_max] (tiles)
  double lattice_max = 0;
  double lattice_step = 1;                       // vertices on multiples of it
  double height_step = 0;                        // vertex heights are multiples of it (0: free)
  double height_min = -1e30, height_max = 1e30;  // of every vertex
  std::uint32_t pinned = 0;    // the first vertices of the mesh keep their place and never vanish
  double search_step_min = 1;  // smallest move of a vertex in xy, mesh units
  bool search = true;          // directed search for edges that nearly collapse
  double search_reach = 1;     // how nearly: a gap of at most this times eps
  int search_tries = 32;       // places tried for one edge
  int move_tries = 12;         // places tried for one vertex between two rounds
  double step_gain = 0;        // what a step of either must win, times eps
  int rounds = 1;              // rounds of moving vertices and sweeping again
  bool flips = false;          // each with a pass of edge flips between the two
  bool turns = false;          // of edges where insertion gave up, beside lines that are kept
  /// Above 0: samples within so much of one at which insertion gave up become vertices, too.
  double surround = 0;
};

struct BoundedStats {
  std::uint64_t inserted = 0, swept = 0, searched = 0, moved = 0;
};

template <class Samples>
class BoundedMesher {
 public:
  using Index = HalfedgeMesh::Index;
  static constexpr Index kNone = HalfedgeMesh::kNone;

  BoundedMesher(HalfedgeMesh mesh, const Samples& samples, const MesherOptions& options);

  /// Before run(): the edges of `lines` (not owned) stay, as DelaunayInsertion::keep has it, and
  /// the vertices on them keep their places and heights.
  void keep(LinePoints* lines) { lines_ = lines; }

  /// The whole algorithm: insert, sweep, search, rounds.
  void run(const Progress& progress = {});

  /// Sweep, search and rounds for a mesh that is within the band already, only at the vertices that
  /// `active` marks and what they touch. Those that `frozen` marks keep place and height.
  void mend(std::vector<std::uint8_t> active, std::vector<std::uint8_t> frozen,
            const Progress& progress = {});

  /// For a mesh that is within the band of some of the samples, or nearly: those that are out of it
  /// become vertices, and what is superfluous around them vanishes.
  void refine(const Progress& progress = {});

  HalfedgeMesh& mesh() { return mesh_; }
  const BoundedStats& stats() const { return stats_; }

 private:
  HalfedgeMesh mesh_;
  const Samples& samples_;
  MesherOptions options_;
  LinePoints* lines_ = nullptr;
  double eps_;  // a hair less than options_.eps, so that rounding cannot break the bound
  BoundedStats stats_;
  Star<Samples> star_;                // the one at hand
  Star<Samples> around_;              // that of the vertex that is to vanish
  std::vector<Index> edges_;          // those to its neighbours
  std::vector<Vec3> origin_;          // by vertex: the sample that it was inserted for
  std::vector<std::uint8_t> active_;  // by vertex: 0 outside the part to be mended
  std::vector<std::uint8_t> frozen_;  // by vertex: keeps place and height (empty: none)
  std::vector<std::uint8_t> dirty_;   // by vertex: worth another try

  InsertionOptions insertion_options() const;
  void insert(const Progress&);
  void turn_edges(const Progress&);
  void surround_peaks(const Progress&);
  bool turn_if_better(Index h, double excess_here);
  std::vector<Index> spatial_order() const;
  std::uint64_t sweep(bool search, const Progress&);
  std::span<const Index> edges_to_targets(Index v);
  void take_over(std::size_t k, bool at_border);
  bool try_targets(Index v, bool search);
  bool directed_search(Index h, const Vec3& start, double gap);
  void decimate(const Progress&);
  void relax(const Progress&);
  void move_vertex(Index v);
  double squares(const Vec3& a, const Vec3& b, const Vec3& c, double limit) const;
  double excess(const Vec3& a, const Vec3& b, const Vec3& c) const;
  void flip_edges(const Progress&);

  bool on_line(Index v) const { return lines_ && lines_->on_line(v); }
  bool may_vanish(Index v) const;
  /// Keeps place and height.
  bool stays(Index v) const { return on_line(v) || (!frozen_.empty() && frozen_[v]); }
  bool may_move(Index v) const { return v >= options_.pinned && !mesh_.on_border(v) && !stays(v); }
  bool straight_border(Index v) const;
  void collapse(Index h, const Vec3& apex);
};

}  // namespace tind
