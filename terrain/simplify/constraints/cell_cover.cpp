#include "terrain/simplify/constraints/cell_cover.h"

#include <algorithm>
#include <cmath>

#include "terrain/mesh/exact_line.h"

namespace tind {

void CellCover::mark(const Vec3& a, const Vec3& b, int around) {
  const int c0 = int(std::floor(std::min(a.x, b.x))) - around,
            c1 = int(std::floor(std::max(a.x, b.x))) + around;
  const int r0 = int(std::floor(-std::max(a.y, b.y))) - around,
            r1 = int(std::floor(-std::min(a.y, b.y))) + around;
  for (int r = std::max(0, r0); r <= std::min(rows_ - 2, r1); ++r)
    for (int c = std::max(0, c0); c <= std::min(cols_ - 2, c1); ++c) marked_[cell(c, r)] = 1;
}

void CellCover::mark_along(const Vec3& a, const Vec3& b, int around) {
  const int n = int(std::sqrt(squared_xy(a, b))) + 1;
  for (int i = 0; i < n; ++i)
    mark(a + (b - a) * (double(i) / n), a + (b - a) * (double(i + 1) / n), around);
}

bool CellCover::at_marked(int c, int r) const {
  for (int dr = -1; dr <= 0; ++dr)
    for (int dc = -1; dc <= 0; ++dc)
      if (c + dc >= 0 && r + dr >= 0 && c + dc < cols_ - 1 && r + dr < rows_ - 1 &&
          marked(c + dc, r + dr))
        return true;
  return false;
}

std::vector<CellCover::Post> CellCover::covered(int c, int r) const {
  std::vector<Post> corners;
  for (const auto& [dc, dr] : {Post{0, 0}, {0, 1}, {1, 1}, {1, 0}})
    if (valid(c + dc, r + dr)) corners.push_back({c + dc, r + dr});
  if (corners.size() < 3) corners.clear();
  return corners;
}

bool CellCover::is_rim(int c, int r, const Post& p, const Post& q) const {
  if (p[0] != q[0] && p[1] != q[1]) return true;  // across a cell with one void
  int dc = 0, dr = 0;
  if (p[0] == q[0])
    dc = p[0] == c ? -1 : 1;
  else
    dr = p[1] == r ? -1 : 1;
  const int nc = c + dc, nr = r + dr;
  if (nc < 0 || nr < 0 || nc > cols_ - 2 || nr > rows_ - 2) return true;
  return !marked(nc, nr) || covered(nc, nr).empty();
}

bool CellCover::covers(const Vec3& p) const {
  const int c = std::clamp(int(p.x), 0, cols_ - 2), r = std::clamp(int(-p.y), 0, rows_ - 2);
  if (!marked(c, r)) return false;
  const auto corners = covered(c, r);
  for (std::size_t k = 0; k < corners.size(); ++k) {
    const Post &a = corners[k], &b = corners[(k + 1) % corners.size()];
    if (orient2d({double(a[0]), -double(a[1]), 0}, {double(b[0]), -double(b[1]), 0}, p) < 0)
      return false;
  }
  return !corners.empty();
}

}  // namespace tind
