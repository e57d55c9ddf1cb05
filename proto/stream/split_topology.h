#pragma once
// The triangles of a progressive mesh, and nothing but which vertex is where: a split and its
// inverse in a few writes to flat arrays. No positions, no geometry.
//
// Half-edge h = 3 f + k runs along face f, which lies on its left. Split i owns the face slots
// base + 2 i and base + 2 i + 1, used or not (on the border the second stays empty), so that the
// arrays after i splits depend on i alone, whichever way it was reached.

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace tind::proto {

class SplitTopology {
 public:
  using Index = std::uint32_t;
  static constexpr Index kNone = ~Index(0);
  using Face = std::array<Index, 3>;

  /// Empty `problem` when the faces are a manifold with border whose vertices are 0..vertices-1,
  /// all used; else one line, and the object must not be used. `splits` is room to reserve.
  SplitTopology(std::span<const Face> faces, std::size_t vertices, std::size_t splits,
                std::string& problem);
  SplitTopology() = default;

  static Index next(Index h) { return h % 3 == 2 ? h - 2 : h + 1; }
  static Index prev(Index h) { return h % 3 == 0 ? h + 2 : h - 1; }
  Index origin(Index h) const { return origin_[h]; }
  Index dest(Index h) const { return origin_[next(h)]; }
  Index twin(Index h) const { return twin_[h]; }

  std::size_t vertices() const { return base_vertices_ + splits_; }
  std::size_t splits() const { return splits_; }
  std::size_t face_slots() const { return base_faces_ + 2 * splits_; }
  std::size_t faces() const { return faces_; }
  bool used(Index face) const { return origin_[3 * face] != kNone; }

  /// The neighbours of v counter-clockwise: all around, or from border to border. Where it begins
  /// depends on the faces' history only, so two who do the same splits see the same.
  struct Fan {
    std::vector<Index> ring;   // neighbours
    std::vector<Index> edges;  // half-edge v -> ring[i] with a face; on the border one fewer
    bool border = false;
  };
  void fan(Index v, Fan&) const;

  /// Where a split happens: the half-edge vertex -> left whose face is the first to go over. On the
  /// border, where no face goes over, the half-edge left -> vertex, and `lone` is set.
  struct Place {
    Index edge = kNone;
    bool lone = false;
  };
  /// Finds it; edge == kNone when left is no neighbour, or no fan leads from left to right.
  Place place(Index vertex, Index left, Index right) const;

  /// Splits the vertex at `place`; the new one is vertices(). REQUIRES: place() found it.
  void split(Place, Index right);
  /// Undoes the last split.
  void unsplit();

  /// Hints for the cache.
  [[gnu::always_inline]] void prefetch(Index h) const {
    __builtin_prefetch(&origin_[h]);
    __builtin_prefetch(&twin_[h]);
  }

 private:
  std::vector<Index> origin_, twin_;  // per half-edge slot
  std::vector<Index> out_;            // per vertex: a half-edge that leaves it
  std::size_t base_vertices_ = 0, base_faces_ = 0, splits_ = 0, faces_ = 0;

  Index first_out(Index v) const;
  void link(Index h, Index g) {
    if (h != kNone) twin_[h] = g;
    if (g != kNone) twin_[g] = h;
  }
};

}  // namespace tind::proto
