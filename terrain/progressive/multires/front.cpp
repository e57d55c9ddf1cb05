// The set is a bit for each node, and so is what has changed. From the two, what a client must do
// follows: a coarse triangle of a node that was applied goes if it was there before, and so on.

#include "terrain/progressive/multires/front.h"

#include <algorithm>

namespace tind {

Front::Front(const MultiTriangulation& all)
    : all_(all),
      bits_((all.nodes() + 63) / 64),
      changed_(bits_.size()),
      triangles_(all.triangles() - all.base_begin()) {}

bool Front::active(Index triangle) const {
  const Index maker = all_.maker(triangle);
  return (maker == kNone || applied(maker)) && !split(triangle);
}

bool Front::leaf(Index node) const {
  for (Index t = all_.fine_begin(node); t < all_.fine_end(node); ++t)
    if (split(t)) return false;
  return true;
}

void Front::toggle(Index node) {
  const std::uint64_t bit = std::uint64_t(1) << (node % 64);
  bits_[node / 64] ^= bit;
  if (changed_[node / 64] ^= bit; changed_[node / 64] & bit) touched_.push_back(node);
  const std::size_t fine = all_.fine_end(node) - all_.fine_begin(node);
  const std::size_t coarse = all_.coarse_end(node) - all_.coarse_begin(node);
  triangles_ += applied(node) ? fine - coarse : coarse - fine;
}

std::vector<Front::Index> Front::active_triangles() const {
  std::vector<Index> out;
  out.reserve(triangles_);
  for (std::size_t word = 0; word < bits_.size(); ++word)
    for (std::uint64_t left = bits_[word]; left != 0; left &= left - 1) {
      const Index node = Index(64 * word + std::size_t(__builtin_ctzll(left)));
      for (Index t = all_.fine_begin(node); t < all_.fine_end(node); ++t)
        if (!split(t)) out.push_back(t);
    }
  for (Index t = all_.base_begin(); t < all_.triangles(); ++t)
    if (!split(t)) out.push_back(t);
  return out;
}

Tin Front::to_tin() const {
  const std::vector<Index> triangles = active_triangles();
  std::vector<Index> used;
  used.reserve(3 * triangles.size());
  for (const Index t : triangles)
    used.insert(used.end(), all_.corners(t).begin(), all_.corners(t).end());
  std::sort(used.begin(), used.end());
  used.erase(std::unique(used.begin(), used.end()), used.end());
  Tin tin;
  for (const Index v : used) tin.vertices.push_back(all_.vertices()[v]);
  for (const Index t : triangles) {
    Triangle corners;
    for (int k = 0; k < 3; ++k)
      corners[k] =
          Index(std::lower_bound(used.begin(), used.end(), all_.corners(t)[k]) - used.begin());
    tin.triangles.push_back(corners);
  }
  return tin;
}

FrontChange Front::take_change() {
  const auto changed = [&](Index n) { return n != kNone && changed_[n / 64] >> (n % 64) & 1; };
  const auto was_applied = [&](Index n) { return n != kNone && applied(n) != changed(n); };
  const auto is_applied = [&](Index n) { return n != kNone && applied(n); };
  std::sort(touched_.begin(), touched_.end());
  touched_.erase(std::unique(touched_.begin(), touched_.end()), touched_.end());
  FrontChange out;
  for (const Index node : touched_) {
    if (!changed(node)) continue;  // there and back
    const bool on = applied(node);
    auto& vertices = on ? out.added_vertices : out.removed_vertices;
    vertices.push_back(all_.added_vertex(node));
    if (const Index moved = all_.moved_vertex(node); moved != kNone) vertices.push_back(moved);
    for (Index t = all_.fine_begin(node); t < all_.fine_end(node); ++t) {
      const Index s = all_.splitter(t);
      if (on && !is_applied(s)) out.added_triangles.push_back(t);
      if (!on && !was_applied(s)) out.removed_triangles.push_back(t);
    }
    for (Index i = all_.coarse_begin(node); i < all_.coarse_end(node); ++i) {
      const auto [maker, t] = all_.coarse(i);
      if (on && (maker == kNone || was_applied(maker))) out.removed_triangles.push_back(t);
      if (!on && (maker == kNone || is_applied(maker))) out.added_triangles.push_back(t);
    }
  }
  for (const Index node : touched_) changed_[node / 64] = 0;
  touched_.clear();
  for (auto* list :
       {&out.removed_triangles, &out.added_triangles, &out.removed_vertices, &out.added_vertices})
    std::sort(list->begin(), list->end());
  return out;
}

}  // namespace tind
