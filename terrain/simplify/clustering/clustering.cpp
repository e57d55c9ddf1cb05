// Rows come in, cells collect: each triangle of the full mesh adds its plane, weighted by its area
// squared (Lindstrom 2000), to the cells of its three corners. When the last row is in, each cell
// places its vertex, cells without a post borrow a height, and quadrilaterals are split.

#include "terrain/simplify/clustering/clustering.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "terrain/mesh/manifold.h"
#include "terrain/mesh/vertical_error.h"
#include "terrain/simplify/collapse/collapse_method.h"
#include "terrain/simplify/common/springs.h"
#include "terrain/simplify/insertion/coarse_constrained.h"

namespace tind {

namespace {

/// How near to its cell's border a vertex may come, in posts. A power of two above the lattice that
/// positions are snapped to.
constexpr double kMargin = 1.0 / 16;

struct Cell {
  double xx = 0, xy = 0, xz = 0, yy = 0, yz = 0, zz = 0;  // planes, in metres around the cell's
  double bx = 0, by = 0, bz = 0;                          // centre and reference height
  double sum_x = 0, sum_y = 0, sum_z = 0;                 // of its valid posts, same frame
  float reference = 0;                                    // height of its first valid post
  std::uint32_t posts = 0;
  int min_col = std::numeric_limits<int>::max(), max_col = -1;  // box of its valid posts
  int min_row = std::numeric_limits<int>::max(), max_row = -1;
};

/// One axis of the division: cell i holds the posts first(i) .. first(i + 1) - 1.
struct Axis {
  int posts, cells;

  int first(int cell) const { return int(std::int64_t(cell) * posts / cells); }
  int cell(int post) const {
    int i = int(std::int64_t(post) * cells / posts);
    while (first(i + 1) <= post) ++i;
    while (first(i) > post) --i;
    return i;
  }
  bool single(int cell) const { return first(cell + 1) - first(cell) == 1; }
  double centre(int cell) const { return (first(cell) + first(cell + 1) - 1) / 2.0; }
  /// Where the vertex may be. The outermost cells' vertices lie on the outermost posts, and a cell
  /// of one post has its vertex there: the finest division is the full mesh.
  double low(int cell) const {
    if (single(cell)) return first(cell);
    if (cell == cells - 1) return posts - 1;
    return cell == 0 ? 0 : first(cell) - 0.5 + kMargin;
  }
  double high(int cell) const {
    if (single(cell)) return first(cell);
    if (cell == 0) return 0;
    return cell == cells - 1 ? posts - 1 : first(cell + 1) - 0.5 - kMargin;
  }
};

class Clusters {
 public:
  Clusters(const ClusterGrid& grid, double sx, double sy)
      : x_{grid.cols, grid.across},
        y_{grid.rows, grid.down},
        sx_(sx),
        sy_(sy),
        cells_(std::size_t(grid.across) * grid.down),
        cell_of_col_(grid.cols) {
    for (int c = 0; c < grid.cols; ++c) cell_of_col_[c] = x_.cell(c);
  }

  void add_posts(int row, std::span<const float> z);
  void add_triangles(int row, std::span<const float> north, std::span<const float> south);
  Result<Tin> mesh();
  Result<Tin> mesh_around(const Constraints&);

 private:
  Axis x_, y_;
  double sx_, sy_;
  std::vector<Cell> cells_;
  std::vector<int> cell_of_col_;

  Cell& cell(int i, int j) { return cells_[std::size_t(j) * x_.cells + i]; }
  void add_plane(int i, int j, const Vec3& n, int col, int row, float z);
  Vec3 place(int i, int j) const;
  double borrowed_height(int i, int j, const std::vector<Vec3>& vertices) const;
  bool may_cover_posts(const Vec3& a, const Vec3& b, const Vec3& c, int i, int j) const;
};

void Clusters::add_posts(int row, std::span<const float> z) {
  const int j = y_.cell(row);
  for (int c = 0; c < int(z.size()); ++c) {
    if (std::isnan(z[c])) continue;
    const int i = cell_of_col_[c];
    Cell& k = cell(i, j);
    if (k.posts++ == 0) k.reference = z[c];
    k.sum_x += (c - x_.centre(i)) * sx_;
    k.sum_y += (y_.centre(j) - row) * sy_;
    k.sum_z += double(z[c]) - k.reference;
    k.min_col = std::min(k.min_col, c), k.max_col = std::max(k.max_col, c);
    k.min_row = std::min(k.min_row, row), k.max_row = row;
  }
}

/// The plane with normal n (its length is the weight) through post (col, row, z), into cell (i, j).
void Clusters::add_plane(int i, int j, const Vec3& n, int col, int row, float z) {
  Cell& k = cell(i, j);
  const Vec3 p{(col - x_.centre(i)) * sx_, (y_.centre(j) - row) * sy_, double(z) - k.reference};
  const double d = -dot(n, p);
  k.xx += n.x * n.x, k.xy += n.x * n.y, k.xz += n.x * n.z;
  k.yy += n.y * n.y, k.yz += n.y * n.z, k.zz += n.z * n.z;
  k.bx += d * n.x, k.by += d * n.y, k.bz += d * n.z;
}

void Clusters::add_triangles(int row, std::span<const float> north, std::span<const float> south) {
  const int up = y_.cell(row), down = y_.cell(row + 1);
  for (int c = 0; c + 1 < int(north.size()); ++c) {
    const float nw = north[c], ne = north[c + 1], sw = south[c], se = south[c + 1];
    if (std::isnan(ne) || std::isnan(sw)) continue;
    const int left = cell_of_col_[c], right = cell_of_col_[c + 1];
    auto add = [&](const Vec3& n) {  // the two corners that both triangles share
      add_plane(right, up, n, c + 1, row, ne);
      add_plane(left, down, n, c, row + 1, sw);
    };
    if (!std::isnan(nw)) {
      const Vec3 n{(nw - double(ne)) * sy_, (sw - double(nw)) * sx_, sx_ * sy_};
      add(n);
      add_plane(left, up, n, c, row, nw);
    }
    if (!std::isnan(se)) {
      const Vec3 n{(sw - double(se)) * sy_, (se - double(ne)) * sx_, sx_ * sy_};
      add(n);
      add_plane(right, down, n, c + 1, row + 1, se);
    }
  }
}

/// The point of the cell where the sum of squared distances is least: each of x and y is solved
/// for, clamped into the cell, and what follows is solved with what is already known.
Vec3 Clusters::place(int i, int j) const {
  const Cell& k = cells_[std::size_t(j) * x_.cells + i];
  const double cx = x_.centre(i), cy = y_.centre(j);
  const double n = std::max(1u, k.posts), s = kClusterSpring * (k.xx + k.yy + k.zz) + 1e-12;
  const double xx = k.xx + s, yy = k.yy + s, zz = k.zz + s;
  const double bx = k.bx - s * k.sum_x / n, by = k.by - s * k.sum_y / n,
               bz = k.bz - s * k.sum_z / n;
  // Eliminate z, then x and y are a 2 x 2 system.
  const double a = xx - k.xz * k.xz / zz, b = k.xy - k.xz * k.yz / zz, d = yy - k.yz * k.yz / zz;
  const double f = -(bx - k.xz * bz / zz), g = -(by - k.yz * bz / zz);
  const double det = a * d - b * b;
  auto in_cell = [](const Axis& axis, int cell, double post) {
    return snap_to_lattice(std::clamp(post, axis.low(cell), axis.high(cell)));
  };
  const double col = in_cell(x_, i, cx + (f * d - b * g) / det / sx_);
  const double x = (col - cx) * sx_;
  const double row = in_cell(y_, j, cy - (g - b * x) / d / sy_);
  const double y = (cy - row) * sy_;
  return {col, -row, k.reference - (bz + k.xz * x + k.yz * y) / zz};
}

/// A cell without a post that lies in a triangle has a neighbour with one.
double Clusters::borrowed_height(int i, int j, const std::vector<Vec3>& vertices) const {
  double sum = 0;
  int n = 0;
  for (int v = std::max(0, j - 1); v <= std::min(y_.cells - 1, j + 1); ++v) {
    for (int u = std::max(0, i - 1); u <= std::min(x_.cells - 1, i + 1); ++u) {
      const std::size_t at = std::size_t(v) * x_.cells + u;
      if (cells_[at].posts == 0) continue;
      sum += vertices[at].z;
      ++n;
    }
  }
  return n > 0 ? sum / n : 0;
}

/// Whether triangle abc meets the box of valid posts of one of its quadrilateral's four cells.
bool Clusters::may_cover_posts(const Vec3& a, const Vec3& b, const Vec3& c, int i, int j) const {
  for (int v = j; v <= j + 1; ++v) {
    for (int u = i; u <= i + 1; ++u) {
      const Cell& k = cells_[std::size_t(v) * x_.cells + u];
      if (k.posts == 0) continue;
      const Vec3 box[4] = {{double(k.min_col), -double(k.max_row), 0},
                           {double(k.max_col), -double(k.max_row), 0},
                           {double(k.max_col), -double(k.min_row), 0},
                           {double(k.min_col), -double(k.min_row), 0}};
      auto apart = [&](const Vec3& p, const Vec3& q) {  // all of the box right of pq
        return std::all_of(std::begin(box), std::end(box),
                           [&](const Vec3& r) { return orient2d(p, q, r) < 0; });
      };
      const bool beside =
          std::max({a.x, b.x, c.x}) < k.min_col || std::min({a.x, b.x, c.x}) > k.max_col ||
          std::max({a.y, b.y, c.y}) < -k.max_row || std::min({a.y, b.y, c.y}) > -k.min_row;
      if (!beside && !apart(a, b) && !apart(b, c) && !apart(c, a)) return true;
    }
  }
  return false;
}

Result<Tin> Clusters::mesh() {
  Tin tin;
  tin.vertices.resize(cells_.size());
  for (int j = 0; j < y_.cells; ++j)
    for (int i = 0; i < x_.cells; ++i) tin.vertices[std::size_t(j) * x_.cells + i] = place(i, j);
  bool voids = false;
  for (int j = 0; j < y_.cells; ++j) {
    for (int i = 0; i < x_.cells; ++i) {
      const std::size_t at = std::size_t(j) * x_.cells + i;
      if (cells_[at].posts == 0) tin.vertices[at].z = borrowed_height(i, j, tin.vertices);
      const int posts = (x_.first(i + 1) - x_.first(i)) * (y_.first(j + 1) - y_.first(j));
      voids |= int(cells_[at].posts) < posts;
    }
  }
  auto add = [&](std::uint32_t p, std::uint32_t q, std::uint32_t r, int i, int j) {
    const std::vector<Vec3>& v = tin.vertices;
    if (!voids || may_cover_posts(v[p], v[q], v[r], i, j)) tin.triangles.push_back({p, q, r});
  };
  for (int j = 0; j + 1 < y_.cells; ++j) {
    for (int i = 0; i + 1 < x_.cells; ++i) {
      const std::uint32_t nw = std::uint32_t(j) * x_.cells + i, ne = nw + 1, sw = nw + x_.cells,
                          se = sw + 1;
      const Vec3 &a = tin.vertices[nw], &b = tin.vertices[sw], &c = tin.vertices[se],
                 &d = tin.vertices[ne];
      const bool rising = surely_ccw(a, b, d) && surely_ccw(c, d, b);   // sw to ne
      const bool falling = surely_ccw(b, c, a) && surely_ccw(d, a, c);  // nw to se
      // Of two good diagonals the one that bends less: the flatter of the two in height.
      const bool use_rising = rising && (!falling || std::abs(b.z - d.z) <= std::abs(a.z - c.z));
      if (use_rising)
        add(nw, sw, ne, i, j), add(se, ne, sw, i, j);
      else
        add(sw, se, nw, i, j), add(ne, nw, se, i, j);
    }
  }
  if (tin.triangles.empty()) return fail(Errc::bad_data, "no valid post: nothing to mesh");
  if (voids) {
    make_manifold(tin);
    drop_unused_vertices(tin);
  }
  return tin;
}

/// Lines go from cell to cell by their first point in each.
Result<Tin> Clusters::mesh_around(const Constraints& constraints) {
  std::vector<LineChain> chains;
  const auto cell_at = [&](std::uint32_t v) {
    const Vec3& p = constraints.mesh.vertices[v];
    return std::pair{cell_of_col_[std::size_t(p.x)], y_.cell(int(-p.y))};
  };
  for (const auto* parts : {&constraints.parts, &constraints.elsewhere}) {
    for (const LinePart& part : *parts) {
      LineChain chain = {part.a};
      for (std::size_t i = part.first; i < part.last; ++i)
        if (cell_at(constraints.inner[i]) != cell_at(chain.back()))
          chain.push_back(constraints.inner[i]);
      chain.push_back(part.b);
      chains.push_back(std::move(chain));
    }
  }
  std::vector<Vec3> places;
  for (int j = 0; j < y_.cells; ++j) {
    for (int i = 0; i < x_.cells; ++i) {
      if (cell(i, j).posts == 0) continue;
      Vec3 p = place(i, j);
      const std::uint32_t flat = constraints.flat.holding(p.x, p.y);
      if (flat != PolygonSet::kNone) p.z = constraints.level[flat];
      places.push_back(p);
    }
  }
  auto made = triangulate_lines(constraints, chains, places);
  if (!made) return std::unexpected(made.error());
  if (made->tin.triangles.empty()) return fail(Errc::bad_data, "no valid post: nothing to mesh");
  drop_unused_vertices(made->tin);
  return std::move(made->tin);
}

Result<Simplified> cluster_once(const Terrain& dem, const ClusterGrid& division,
                                const Constraints* constraints, const Progress& progress) {
  const ReadRow read = [&](int row, std::span<float> out) -> Result<void> {
    std::ranges::copy(dem.grid.row(row), out.begin());
    return {};
  };
  Result<Tin> tin =
      cluster_rows(division, dem.spacing_x_m, dem.spacing_y_m, read, progress, constraints);
  if (!tin) return std::unexpected(tin.error());
  Simplified out;
  out.tin = std::move(*tin);
  out.details["clusters_across"] = division.across;
  out.details["clusters_down"] = division.down;
  return out;
}

/// The largest `size` in [low, high] (doubling of cells, in logarithmic steps) that `fits`; `low`
/// where none does.
template <class Fits>
Result<Simplified> search(double low, double high, int passes, Fits&& fits) {
  Result<Simplified> best = fail(Errc::internal, "no division fits");
  std::uint64_t steps = 0;
  for (int i = 0; i < passes; ++i) {
    const double middle = std::sqrt(low * high);
    bool ok = false;
    Result<Simplified> trial = fits(i == 0 ? low : middle, ok);
    if (!trial) return trial;
    ++steps;
    if (ok || i == 0) best = std::move(trial);
    if (i > 0) (ok ? low : high) = middle;
  }
  if (best) best->steps = steps;
  return best;
}

}  // namespace

ClusterGrid cluster_grid(int cols, int rows, double sx, double sy, std::uint64_t triangles) {
  const double width = (cols - 1) * sx, height = (rows - 1) * sy;
  // Where posts are not square, cells of the finest division are not, either.
  if (triangles >= 2 * std::uint64_t(cols - 1) * std::uint64_t(rows - 1))
    return {cols, rows, cols, rows};
  // (across - 1) (down - 1) = triangles / 2 and (across - 1) / (down - 1) = width / height.
  const double pairs = double(std::max<std::uint64_t>(1, triangles / 2));
  ClusterGrid grid{cols, rows, 2, 2};
  const double across = std::sqrt(pairs * width / height);
  const int wide = int(std::clamp(std::floor(across), 1.0, double(cols - 1)));
  double least_waste = std::numeric_limits<double>::infinity();
  for (int w = std::max(1, wide - 2); w <= std::min(cols - 1, wide + 3); ++w) {
    const int h = int(std::clamp(std::floor(pairs / w), 1.0, double(rows - 1)));
    const double waste = pairs - double(w) * h;
    if (waste < 0 || waste >= least_waste) continue;
    least_waste = waste;
    grid.across = w + 1;
    grid.down = h + 1;
  }
  return grid;
}

Result<Tin> cluster_rows(const ClusterGrid& grid, double sx, double sy, const ReadRow& read,
                         const Progress& progress, const Constraints* constraints) {
  Clusters clusters(grid, sx, sy);
  std::vector<float> north(grid.cols), south(grid.cols);
  for (int row = 0; row < grid.rows; ++row) {
    if (progress.stopped()) return fail(Errc::cancelled, "simplification was stopped");
    if (row % 64 == 0) progress.at(double(row) / grid.rows);
    if (const Result<void> ok = read(row, south); !ok) return std::unexpected(ok.error());
    clusters.add_posts(row, south);
    if (row > 0) clusters.add_triangles(row - 1, north, south);
    north.swap(south);
  }
  return constraints ? clusters.mesh_around(*constraints) : clusters.mesh();
}

Result<Simplified> simplify_cluster(const Terrain& dem, const ClusterOptions&,
                                    const RunOptions& options, const Progress& progress) {
  const HeightGrid& grid = dem.grid;
  const std::size_t full = 2 * std::size_t(grid.cols() - 1) * std::size_t(grid.rows() - 1);
  std::size_t input = 0;
  for (int r = 0; r + 1 < grid.rows(); ++r) {
    for (int c = 0; c + 1 < grid.cols(); ++c) {
      const int valid = !grid.is_void(c, r) + !grid.is_void(c + 1, r) + !grid.is_void(c, r + 1) +
                        !grid.is_void(c + 1, r + 1);
      input += std::size_t(std::max(0, valid - 2));
    }
  }
  const Constraints* const lines = options.constraints.get();
  if (lines) input = lines->mesh.triangles.size();
  const std::size_t target = target_triangles(options.stop, input);
  auto trial = [&](double triangles) {
    return cluster_once(dem,
                        cluster_grid(grid.cols(), grid.rows(), dem.spacing_x_m, dem.spacing_y_m,
                                     std::uint64_t(triangles)),
                        lines, progress);
  };
  Result<Simplified> out = fail(Errc::internal, "");
  if (options.stop.max_error_m) {
    // From the finest division (every post a vertex: no error) to the coarsest that keeps
    // the bound.
    out = search(double(full), 2, 14, [&](double triangles, bool& ok) {
      Result<Simplified> r = trial(triangles);
      ok = r && vertical_error(r->tin, grid, options.threads).max_m <= *options.stop.max_error_m;
      return r;
    });
  } else if (input == full && !lines) {
    out = trial(double(std::min(target, input)));
    if (out) out->steps = 1;
  } else {  // voids, lines: how many cells hold a post is known afterwards only
    out = search(2, double(full), 14, [&](double triangles, bool& ok) {
      Result<Simplified> r = trial(triangles);
      ok = r && r->tin.triangles.size() <= std::max<std::size_t>(target, 2);
      return r;
    });
  }
  if (!out) return out;
  out->input_triangles = input;
  if (!options.stop.max_error_m && out->tin.triangles.size() != target) {
    const bool lines_alone = lines && out->tin.triangles.size() > std::max<std::size_t>(target, 2);
    out->note = lines_alone ? edges_alone_note(out->tin.triangles.size())
                            : "clusters come in whole rows and columns: " +
                                  std::to_string(out->tin.triangles.size()) + " triangles, not " +
                                  std::to_string(target);
  }
  return out;
}

}  // namespace tind
