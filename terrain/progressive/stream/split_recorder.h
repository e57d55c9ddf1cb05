#pragma once
// Listens to a method that collapses; read backwards, what it heard is the list of splits.
//
// A collapse that merges at the place of the vertex that goes is told the other way around: then
// the vertex that stays does not move, which is cheap to write down and pleasant to look at. So is
// one with the border on its left: a split has the border on its right.
//
// What is an error, and when the places are the same, is for `Measure` to say:
//
//   double fine(const HalfedgeMesh&)                        before the first collapse
//   double after(const HalfedgeMesh&, const Collapse&)      of what the collapse leaves; before it
//   bool other_way(const HalfedgeMesh&, const Collapse&)    whether to tell it so; false where the
//                                                           vertex that stays is on a border

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include "terrain/mesh/halfedge_mesh.h"
#include "terrain/progressive/stream/progressive_mesh.h"
#include "terrain/simplify/common/collapse_recorder.h"

namespace tind {

/// To the next float that is not below v.
inline float rounded_up(double v) {
  const float f = float(v);
  return double(f) < v ? std::nextafter(f, std::numeric_limits<float>::infinity()) : f;
}

/// Measure::other_way of terrain: the merged vertex is where the removed one was, seen from above.
inline bool other_way_from_above(const HalfedgeMesh& m, const Collapse& c) {
  const auto same = [](const Vec3& p, const Vec3& q) { return p.x == q.x && p.y == q.y; };
  return same(c.kept_after, c.removed_position) && !same(c.kept_after, c.kept_before) &&
         !m.on_border(c.kept);
}

template <class Measure>
class SplitRecorder : public CollapseRecorder {
 public:
  using Index = HalfedgeMesh::Index;
  static constexpr Index kNone = HalfedgeMesh::kNone;
  static_assert(VertexSplit::kNone == kNone);

  /// `measure` is not owned.
  SplitRecorder(Measure& measure, const Lattice& on, std::size_t base_triangles)
      : CollapseRecorder(on, std::max<std::size_t>(base_triangles, 1)), measure_(measure) {}

  ProgressiveMesh mesh;  // once base() has been called

  void fine(const HalfedgeMesh& m) override {
    mesh_ = &m;
    label_.resize(m.vertex_slots());
    for (Index v = 0; v < label_.size(); ++v) label_[v] = v;
    fine_error_ = error_ = measure_.fine(m);
  }

  void collapse(const Collapse& c) override {
    error_ = std::max(error_, measure_.after(*mesh_, c));
    const bool turn = c.left == kNone || (c.right != kNone && measure_.other_way(*mesh_, c));
    VertexSplit s;
    s.vertex_coarse = c.kept_after;
    s.vertex_fine = turn ? c.removed_position : c.kept_before;
    s.added = turn ? c.kept_before : c.removed_position;
    const Index left = turn ? c.right : c.left, right = turn ? c.left : c.right;
    s.left = label_[left];
    s.right = right == kNone ? kNone : label_[right];
    if (turn) std::swap(label_[c.removed], label_[c.kept]);
    s.vertex = label_[c.kept];
    s.error_m = rounded_up(error_);
    added_.push_back(label_[c.removed]);
    splits_.push_back(s);
  }

  void base(const HalfedgeMesh& m) override {
    mesh.fine_error_m = fine_error_;
    std::vector<Index> base_index;
    mesh.base = m.to_tin(&base_index);
    std::vector<Index> id(label_.size(), kNone);  // of a label
    for (Index v = 0; v < base_index.size(); ++v)
      if (base_index[v] != kNone) id[label_[v]] = base_index[v];
    std::ranges::reverse(splits_);
    std::ranges::reverse(added_);
    for (std::size_t i = 0; i < splits_.size(); ++i)
      id[added_[i]] = Index(mesh.base.vertices.size() + i);
    for (VertexSplit& s : splits_) {
      s.vertex = id[s.vertex];
      s.left = id[s.left];
      if (s.right != kNone) s.right = id[s.right];
    }
    mesh.splits = std::move(splits_);
  }

 private:
  Measure& measure_;
  const HalfedgeMesh* mesh_ = nullptr;
  std::vector<Index> label_;  // which vertex a slot holds: turned collapses swap two
  std::vector<VertexSplit> splits_;
  std::vector<Index> added_;  // the label that each split adds
  double error_ = 0, fine_error_ = 0;
};

}  // namespace tind
