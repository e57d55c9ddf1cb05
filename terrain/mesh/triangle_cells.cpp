// Level by level each cell with many members is cut in the middle of its longest side; a member
// goes where it meets the half's box, by the axes that separate a triangle from a box
// (Akenine-Moeller 2001). A plane through a cell meets about half of its eight eighths. So after
// three levels a cell has half the members and there are four times as many memberships: these, not
// a depth, say when it is enough.

#include "terrain/mesh/triangle_cells.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

namespace tind {
namespace {

constexpr std::size_t kFew = 16;  // members that are not worth a cut
constexpr std::size_t kMemberships = 64, kMostMemberships = std::size_t(1) << 24;
constexpr int kDeepest = 48;

double sum_of(const Vec3& v) { return std::abs(v.x) + std::abs(v.y) + std::abs(v.z); }

/// More than rounding moves anything by in the tests of a box there.
double slack_at(const Vec3& low, const Vec3& high) { return 1e-12 * (sum_of(low) + sum_of(high)); }

/// What separates a triangle from boxes: the axes, in all but their order.
class Separator {
 public:
  Separator(const Tin& tin, const Triangle& t)
      : a_(tin.vertices[t[0]]), b_(tin.vertices[t[1]]), c_(tin.vertices[t[2]]) {}

  bool meets(const Vec3& low, const Vec3& high) const {
    const Vec3 middle = (low + high) * 0.5, half = (high - low) * 0.5;
    const Vec3 a = a_ - middle, b = b_ - middle, c = c_ - middle;
    const auto apart = [&](const Vec3& axis) {
      const double p = dot(axis, a), q = dot(axis, b), r = dot(axis, c);
      const double reach =
          std::abs(axis.x) * half.x + std::abs(axis.y) * half.y + std::abs(axis.z) * half.z;
      return std::min({p, q, r}) > reach || std::max({p, q, r}) < -reach;
    };
    constexpr std::array<Vec3, 3> kAxes = {Vec3{1, 0, 0}, Vec3{0, 1, 0}, Vec3{0, 0, 1}};
    for (const Vec3& axis : kAxes)
      if (apart(axis)) return false;
    const std::array<Vec3, 3> edges = {b - a, c - b, a - c};
    if (apart(cross(edges[0], edges[1]))) return false;
    for (const Vec3& edge : edges)
      for (const Vec3& axis : kAxes)
        if (apart(cross(axis, edge))) return false;
    return true;
  }

 private:
  const Vec3 &a_, &b_, &c_;
};

TriangleCells::Cell cell_of(const Vec3& low, const Vec3& high) {
  const double slack = slack_at(low, high);
  const Vec3 by{slack, slack, slack};
  return {low - by, high + by};
}

std::pair<TriangleCells::Cell, TriangleCells::Cell> halves(const TriangleCells::Cell& cell) {
  const Vec3 size = cell.high - cell.low;
  Vec3 high = cell.high, low = cell.low;
  double Vec3::*const axis = size.x >= size.y && size.x >= size.z ? &Vec3::x
                             : size.y >= size.z                   ? &Vec3::y
                                                                  : &Vec3::z;
  high.*axis = low.*axis = (cell.low.*axis + cell.high.*axis) / 2;
  return {cell_of(cell.low, high), cell_of(low, cell.high)};
}

}  // namespace

TriangleCells::TriangleCells(const Tin& tin, std::span<const std::uint32_t> triangles) {
  Vec3 low{HUGE_VAL, HUGE_VAL, HUGE_VAL}, high{-HUGE_VAL, -HUGE_VAL, -HUGE_VAL};
  for (const std::uint32_t t : triangles)
    for (const auto v : tin.triangles[t]) {
      const Vec3& p = tin.vertices[v];
      low = {std::min(low.x, p.x), std::min(low.y, p.y), std::min(low.z, p.z)};
      high = {std::max(high.x, p.x), std::max(high.y, p.y), std::max(high.z, p.z)};
    }
  struct Open {
    std::size_t cell;
    std::vector<std::uint32_t> members;
  };
  cells_.push_back(cell_of(low, high));
  std::vector<Open> open(1), next;
  open[0].members.resize(triangles.size());
  for (std::uint32_t i = 0; i < triangles.size(); ++i) open[0].members[i] = i;
  const auto close = [&](const Open& one) {
    Cell& cell = cells_[one.cell];
    cell.first = members_.size(), cell.count = std::uint32_t(one.members.size());
    members_.insert(members_.end(), one.members.begin(), one.members.end());
  };
  const std::size_t enough = std::min(kMemberships * triangles.size(), kMostMemberships);
  std::size_t memberships = triangles.size();
  for (int depth = 0; !open.empty(); ++depth) {
    const bool last = depth == kDeepest || memberships > enough;
    next.clear();
    for (Open& one : open) {
      if (last || one.members.size() <= kFew) {
        close(one);
        continue;
      }
      const auto [left, right] = halves(cells_[one.cell]);
      cells_[one.cell].leaf = false, cells_[one.cell].first = cells_.size();
      for (const Cell& half : {left, right}) {
        Open child{cells_.size(), {}};
        cells_.push_back(half);
        for (const std::uint32_t i : one.members)
          if (Separator(tin, tin.triangles[triangles[i]]).meets(half.low, half.high))
            child.members.push_back(i);
        memberships += child.members.size();
        next.push_back(std::move(child));
      }
      memberships -= one.members.size();
      one.members = {};
    }
    std::swap(open, next);
  }
}

}  // namespace tind
