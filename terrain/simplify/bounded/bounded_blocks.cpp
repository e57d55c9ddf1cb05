// The grid is cut into fixed blocks. Block borders are lines that both sides derive alike (a cone
// filter along the posts); blocks are meshed independently inside locked borders, then sewn to what
// lies north of them, and a last pass thins what lies along the seams.
//
// It goes by rows of blocks. Row j is sewn to the mesh above it while the blocks of row j + 1 are
// being made. Vertices on the line to row j + 1 are frozen until that row is there; triangles
// that no later seam can touch leave for the result. So heights are in memory for three rows of
// blocks (more with more threads than there are blocks in a row), and triangles that can still
// change for two. Blocks depend on the size of the grid alone: the result is the same for any
// number of threads.

#include "terrain/simplify/bounded/bounded_blocks.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include "terrain/base/parallel.h"
#include "terrain/mesh/manifold.h"

namespace tind {

namespace {

using Index = std::uint32_t;
constexpr Index kNone = ~Index(0);
constexpr double kInfinity = std::numeric_limits<double>::infinity();

std::vector<int> cuts(int posts, int block_posts) {
  const int blocks = std::max(1, int(std::lround(double(posts) / block_posts)));
  std::vector<int> at;
  for (int k = 0; k <= blocks; ++k) at.push_back(int(std::int64_t(posts - 1) * k / blocks));
  return at;
}

/// Some rows of the DEM.
struct Window {
  HeightGrid z;
  int first = 0;  // row of the DEM

  int end() const { return first + z.rows(); }
  float at(int col, int row) const { return z.at(col, row - first); }

  /// Forgets rows before `from` and reads on to row `last`.
  Result<void> slide(const HeightRows& dem, int from, int last) {
    HeightGrid next(dem.cols, last - from + 1);
    for (int row = from; row < std::min(end(), last + 1); ++row)
      std::ranges::copy(z.row(row - first), next.row(row - from).begin());
    const int start = std::max(from, end());
    if (start <= last) {
      auto fresh = dem.read(start, last - start + 1);
      if (!fresh) return std::unexpected(fresh.error());
      for (int row = start; row <= last; ++row)
        std::ranges::copy(fresh->row(row - start), next.row(row - from).begin());
    }
    z = std::move(next);
    first = from;
    return {};
  }
};

/// A horizontal line between block rows: heights of the block corners, and the inner vertices of
/// each stretch between two of them.
struct Line {
  std::vector<double> corners;
  std::vector<std::vector<Vec3>> stretches;
};

struct BlockRow {
  int index = 0;
  double low = kInfinity, high = -kInfinity;  // of its heights
  Line top, bottom;
  std::vector<std::vector<Vec3>> sides;  // inner vertices of the vertical lines, from the west
  std::vector<Tin> blocks;
  std::vector<std::uint64_t> steps;  // collapses made in each
};

class BlockMesher {
 public:
  BlockMesher(const HeightRows& dem, const BlockOptions& options, const Progress& progress)
      : dem_(dem),
        options_(options),
        progress_(progress),
        col_cuts_(cuts(dem.cols, options.block_posts)),
        row_cuts_(cuts(dem.rows, options.block_posts)) {
    quiet_.stop = progress.stop;
  }

  Result<BlockResult> run() {
    const int across = int(col_cuts_.size()) - 1, down = int(row_cuts_.size()) - 1;
    const int threads = options_.threads > 0 ? options_.threads : hardware_threads();
    const int at_once = std::max(1, (threads + across - 1) / across);  // rows of blocks
    std::vector<BlockRow> waiting;                                     // to be sewn
    for (int j = 0; j < down; j += at_once) {
      const int count = std::min(at_once, down - j);
      const int oldest = waiting.empty() ? j : waiting[0].index;
      auto read = window_.slide(dem_, row_cuts_[std::max(0, oldest - 1)], row_cuts_[j + count]);
      if (!read) return std::unexpected(read.error());
      std::vector<BlockRow> rows;
      rows.reserve(std::size_t(count));
      for (int k = 0; k < count; ++k)
        rows.push_back(prepare(j + k, k == 0 ? last_line_ : rows.back().bottom));
      last_line_ = rows.back().bottom;
      const std::size_t sewing = waiting.empty() ? 0 : 1;
      parallel_for(sewing + std::size_t(count * across), threads, [&](std::size_t i) {
        if (progress_.stopped()) return;
        if (i < sewing) return sew_all(waiting);
        mesh_block(rows[(i - sewing) / across], int((i - sewing) % across));
      });
      waiting = std::move(rows);
      progress_.at(0.95 * double(j + count) / down);
      if (progress_.stopped()) return fail(Errc::cancelled, "stopped");
      if (!error_) return std::unexpected(error_.error());
    }
    sew_all(waiting);
    if (progress_.stopped()) return fail(Errc::cancelled, "stopped");
    if (!error_) return std::unexpected(error_.error());
    if (!any_valid_) return fail(Errc::bad_data, "the grid holds no valid height at all");
    result_.blocks = std::uint64_t(across) * std::uint64_t(down);
    return std::move(result_);
  }

 private:
  const HeightRows& dem_;
  const BlockOptions& options_;
  const Progress& progress_;
  Progress quiet_;
  std::vector<int> col_cuts_, row_cuts_;  // block borders, ends included
  Window window_;
  Line last_line_;
  bool any_valid_ = false;
  double last_valid_ = 0;  // a height to take where there is none
  Result<void> error_;

  BlockResult result_;
  Tin open_;                   // the part of the mesh that may still change
  std::vector<Index> placed_;  // its vertices in result_, where they are there already
  double low_ = kInfinity, high_ = -kInfinity;  // heights of the row sewn last

  double height(int col, int row) const { return double(window_.at(col, row)) + options_.offset; }
  bool is_void(int col, int row) const { return std::isnan(window_.at(col, row)); }

  // --- lines between blocks ----------------------------------------------------------------------

  /// The height of a block corner: its post, or where that is void the nearest valid one in the row
  /// of blocks that ends at `first` or `last`.
  double corner_height(int col, int row, int first, int last) {
    if (!is_void(col, row)) return last_valid_ = height(col, row);
    double best = kInfinity, found = last_valid_;
    for (int reach = 1; reach <= 2 * options_.block_posts && best > reach; reach *= 2) {
      const int left = std::max(0, col - reach), right = std::min(dem_.cols - 1, col + reach);
      for (int r = std::max(first, row - reach); r <= std::min(last, row + reach); ++r) {
        for (int c = left; c <= right; ++c) {
          const double d = std::hypot(double(c - col), double(r - row));
          if (d < best && !is_void(c, r)) best = d, found = height(c, r);
        }
      }
    }
    return last_valid_ = found;
  }

  /// The posts between two block corners, thinned by a cone filter: inner vertices only.
  std::vector<Vec3> stretch(int col, int row, int dcol, int drow, int length, double from_height,
                            double end_height) const {
    const double tolerance = 0.7 * options_.mesher.eps;
    std::vector<Vec3> line;
    int from = 0;
    for (;;) {
      double lo = -kInfinity, hi = kInfinity, slope = 0;
      int reached = from;
      bool open = true;
      for (int i = from + 1; i < length && open; ++i) {
        const int c = col + dcol * i, r = row + drow * i;
        if (is_void(c, r)) continue;
        const double h = height(c, r), n = i - from;
        const double l = std::max(lo, (h - tolerance - from_height) / n);
        const double u = std::min(hi, (h + tolerance - from_height) / n);
        open = l <= u;
        if (open) lo = l, hi = u, reached = i, slope = (l + u) / 2;
      }
      const double direct = (end_height - from_height) / (length - from);
      if (open && direct >= lo && direct <= hi) return line;
      if (reached == from) return line;
      from_height += slope * (reached - from);
      from = reached;
      line.push_back({double(col + dcol * from), -double(row + drow * from), from_height});
    }
  }

  Line make_line(int row, int first, int last) {
    Line line;
    for (const int col : col_cuts_) line.corners.push_back(corner_height(col, row, first, last));
    for (std::size_t i = 0; i + 1 < col_cuts_.size(); ++i)
      line.stretches.push_back(stretch(col_cuts_[i], row, 1, 0, col_cuts_[i + 1] - col_cuts_[i],
                                       line.corners[i], line.corners[i + 1]));
    return line;
  }

  BlockRow prepare(int j, Line top) {
    const int first = row_cuts_[j], last = row_cuts_[j + 1];
    BlockRow row;
    row.index = j;
    for (int r = first; r <= last; ++r) {
      for (const float z : window_.z.row(r - window_.first)) {
        if (std::isnan(z)) continue;
        if (!any_valid_) last_valid_ = double(z) + options_.offset;
        any_valid_ = true;
        row.low = std::min(row.low, double(z)), row.high = std::max(row.high, double(z));
      }
    }
    row.top = j == 0 ? make_line(first, first, last) : std::move(top);
    row.bottom = make_line(last, first, last);
    for (std::size_t i = 0; i < col_cuts_.size(); ++i)
      row.sides.push_back(stretch(col_cuts_[i], first, 0, 1, last - first, row.top.corners[i],
                                  row.bottom.corners[i]));
    row.blocks.resize(col_cuts_.size() - 1);
    row.steps.resize(col_cuts_.size() - 1);
    return row;
  }

  // --- one block ---------------------------------------------------------------------------------

  GridSamples samples(int col, int row, int cols, int rows) const {
    GridSamples s;
    s.cols = cols, s.rows = rows;
    s.x0 = col, s.y0 = -row;
    s.z = window_.z.row(row - window_.first).data() + col;
    s.stride = std::size_t(dem_.cols);
    s.offset = options_.offset;
    return s;
  }

  void mesh_block(BlockRow& row, int i) const {
    const int c0 = col_cuts_[i], c1 = col_cuts_[i + 1];
    const int r0 = row_cuts_[row.index], r1 = row_cuts_[row.index + 1];
    Tin corners;
    corners.vertices = {{double(c0), -double(r1), row.bottom.corners[i]},
                        {double(c1), -double(r1), row.bottom.corners[i + 1]},
                        {double(c1), -double(r0), row.top.corners[i + 1]},
                        {double(c0), -double(r0), row.top.corners[i]}};
    corners.triangles = {{0, 1, 2}, {0, 2, 3}};
    HalfedgeMesh mesh = *HalfedgeMesh::from_tin(corners);
    const GridSamples posts = samples(c0, r0, c1 - c0 + 1, r1 - r0 + 1);
    MesherOptions o = options_.mesher;
    o.relief = std::max(0.0, row.high - row.low);
    o.locked_border = true;
    {
      InsertionOptions insertion;
      insertion.x_scale = o.x_scale;
      DelaunayInsertion<GridSamples> frame(mesh, posts, insertion);
      for (const auto* line :
           {&row.top.stretches[i], &row.bottom.stretches[i], &row.sides[i], &row.sides[i + 1]})
        for (const Vec3& p : *line) frame.insert_point(p);
    }
    BoundedMesher<GridSamples> mesher(std::move(mesh), posts, o);
    mesher.run(quiet_);
    row.blocks[i] = mesher.mesh().to_tin();
    row.steps[i] = mesher.stats().swept + mesher.stats().searched;
  }

  // --- sewing ------------------------------------------------------------------------------------

  void sew_all(std::vector<BlockRow>& rows) {
    for (BlockRow& row : rows)
      if (error_ && !progress_.stopped()) error_ = sew(row);
  }

  /// Adds the blocks of a row to the open mesh; `seam` marks vertices on block borders that are
  /// whole now.
  void join(const BlockRow& row, std::vector<std::uint8_t>& seam) {
    const double top = -double(row_cuts_[row.index]), bottom = -double(row_cuts_[row.index + 1]);
    const bool last = row.index + 2 == int(row_cuts_.size());
    std::map<std::pair<double, double>, Index> shared;
    seam.assign(open_.vertices.size(), 0);
    for (Index v = 0; v < open_.vertices.size(); ++v) {
      const Vec3& p = open_.vertices[v];
      if (p.y == top) shared[{p.x, p.y}] = v, seam[v] = 1;
    }
    std::vector<Index> index;
    for (const Tin& block : row.blocks) {
      index.clear();
      for (const Vec3& p : block.vertices) {
        const bool on_side = p.x == std::floor(p.x) &&
                             std::binary_search(col_cuts_.begin(), col_cuts_.end(), int(p.x));
        if (!on_side && p.y != top && p.y != bottom) {
          index.push_back(Index(open_.vertices.size()));
        } else {
          const auto [there, is_new] = shared.try_emplace({p.x, p.y}, Index(open_.vertices.size()));
          index.push_back(there->second);
          if (!is_new) continue;
        }
        open_.vertices.push_back(p);
        seam.push_back(on_side || p.y == top || (last && p.y == bottom));
      }
      for (const Triangle& t : block.triangles)
        open_.triangles.push_back({index[t[0]], index[t[1]], index[t[2]]});
    }
    placed_.resize(open_.vertices.size(), kNone);
  }

  /// Marks all vertices of triangles that have a marked one, `rings` times.
  static void widen(std::vector<std::uint8_t>& marks, const Tin& tin, int rings) {
    for (int k = 0; k < rings; ++k) {
      std::vector<std::uint8_t> wider = marks;
      for (const Triangle& t : tin.triangles)
        if (marks[t[0]] | marks[t[1]] | marks[t[2]]) wider[t[0]] = wider[t[1]] = wider[t[2]] = 1;
      marks.swap(wider);
    }
  }

  /// Vertices that must stay while row j is being sewn: on the line to the next row, and those
  /// whose triangles are not all here, or reach beyond the rows of blocks j - 1 and j.
  std::vector<std::uint8_t> frozen_vertices(int j) const {
    std::vector<std::uint8_t> frozen(open_.vertices.size(), 0);
    const bool last = j + 2 == int(row_cuts_.size());
    const double bottom = -double(row_cuts_[j + 1]);
    const double limit = j >= 2 ? -double(row_cuts_[j - 1]) : kInfinity;
    for (Index v = 0; v < frozen.size(); ++v) {
      const double y = open_.vertices[v].y;
      frozen[v] = y >= limit || (!last && y == bottom);
    }
    for (const Triangle& t : open_.triangles)
      if (std::ranges::any_of(t, [&](Index v) { return open_.vertices[v].y > limit; }))
        for (const Index v : t) frozen[v] = 1;
    return frozen;
  }

  Result<void> sew(BlockRow& row) {
    const int j = row.index;
    std::vector<std::uint8_t> seam;
    join(row, seam);
    row.blocks.clear();
    for (const std::uint64_t n : row.steps) result_.steps += n;
    widen(seam, open_, 2);
    auto mesh = HalfedgeMesh::from_tin(open_);
    if (!mesh) return fail("sewing blocks", mesh.error());
    const int first = row_cuts_[std::max(0, j - 1)], last = row_cuts_[j + 1];
    MesherOptions o = options_.mesher;
    o.relief = std::max(0.0, std::max(high_, row.high) - std::min(low_, row.low));
    low_ = row.low, high_ = row.high;
    const GridSamples posts = samples(0, first, dem_.cols, last - first + 1);
    BoundedMesher<GridSamples> mesher(std::move(*mesh), posts, o);
    mesher.mend(std::move(seam), frozen_vertices(j), quiet_);
    result_.steps += mesher.stats().swept + mesher.stats().searched;
    std::vector<Index> now;
    open_ = mesher.mesh().to_tin(&now);
    std::vector<Index> placed(open_.vertices.size(), kNone);
    for (Index v = 0; v < now.size(); ++v)
      if (now[v] != kNone) placed[now[v]] = placed_[v];
    placed_ = std::move(placed);
    release(j + 2 == int(row_cuts_.size()) ? -kInfinity : -double(row_cuts_[j]));
    return {};
  }

  /// Moves triangles that have no vertex below the line y = `limit` to the result.
  void release(double limit) {
    Tin open;
    std::vector<Index> moved(open_.vertices.size(), kNone), placed;
    for (Triangle t : open_.triangles) {
      if (std::ranges::any_of(t, [&](Index v) { return open_.vertices[v].y < limit; })) {
        for (Index& v : t) {
          if (moved[v] == kNone)
            moved[v] = Index(open.vertices.size()), open.vertices.push_back(open_.vertices[v]);
          v = moved[v];
        }
        open.triangles.push_back(t);
      } else {
        for (Index& v : t) {
          if (placed_[v] == kNone) {
            placed_[v] = Index(result_.tin.vertices.size());
            result_.tin.vertices.push_back(open_.vertices[v]);
          }
          v = placed_[v];
        }
        result_.tin.triangles.push_back(t);
      }
    }
    placed.resize(open.vertices.size(), kNone);
    for (Index v = 0; v < moved.size(); ++v)
      if (moved[v] != kNone) placed[moved[v]] = placed_[v];
    open_ = std::move(open);
    placed_ = std::move(placed);
    split_fans();
  }

  /// Where triangles have left between two others of a vertex, it becomes two; all of them frozen,
  /// and one again in the result.
  void split_fans() {
    for (const Index v : make_manifold(open_).copy_of) placed_.push_back(placed_[v]);
  }
};

}  // namespace

HeightRows rows_of(const HeightGrid& grid) {
  return {grid.cols(), grid.rows(), [&grid](int first, int count) {
            HeightGrid part(grid.cols(), count);
            const auto from = grid.values().subspan(std::size_t(first) * grid.cols(), part.size());
            std::ranges::copy(from, part.values().begin());
            return part;
          }};
}

Result<BlockResult> mesh_in_blocks(const HeightRows& dem, const BlockOptions& options,
                                   const Progress& progress) {
  return BlockMesher(dem, options, progress).run();
}

}  // namespace tind
