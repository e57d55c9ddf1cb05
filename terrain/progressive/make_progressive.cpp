// The method collapses, a recorder listens; read backwards, what it heard is the list of splits.
//
// A collapse that merges at the place of the vertex that goes is told the other way around: then
// the vertex that stays does not move, which is cheap to write down and pleasant to look at.

#include "terrain/progressive/make_progressive.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "terrain/progressive/bounded_collapses.h"
#include "terrain/progressive/least_error.h"
#include "terrain/simplify/collapse_engine.h"

namespace tind {

namespace {

using Index = HalfedgeMesh::Index;
constexpr Index kNone = HalfedgeMesh::kNone;
static_assert(VertexSplit::kNone == kNone);

float rounded_up(double v) {
  const float f = float(v);
  return double(f) < v ? std::nextafter(f, std::numeric_limits<float>::infinity()) : f;
}

class SplitRecorder {
 public:
  explicit SplitRecorder(const HeightGrid& grid) : grid_(grid) {}

  /// The fine mesh, before the first collapse.
  void start(const HalfedgeMesh& mesh) {
    mesh_ = &mesh;
    label_.resize(mesh.vertex_slots());
    for (Index v = 0; v < label_.size(); ++v) label_[v] = v;
    double worst = 0;
    for (Index h = 0; h < mesh.halfedge_slots(); h += 3) {
      if (!mesh.alive_triangle(h / 3)) continue;
      worst =
          std::max(worst, triangle_error(grid_, mesh.position(mesh.origin(h)),
                                         mesh.position(mesh.dest(h)), mesh.position(mesh.apex(h))));
    }
    fine_error_ = error_ = worst;
  }

  /// Before each collapse.
  void collapse(const Collapse& c) {
    error_ = std::max(error_, error_after(c));
    const auto at = [](const Vec3& p, const Vec3& q) { return p.x == q.x && p.y == q.y; };
    const bool turn = c.right != kNone && at(c.kept_after, c.removed_position) &&
                      !at(c.kept_after, c.kept_before);
    VertexSplit s;
    s.vertex_coarse = c.kept_after;
    s.vertex_fine = turn ? c.removed_position : c.kept_before;
    s.added = turn ? c.kept_before : c.removed_position;
    s.left = label_[turn ? c.right : c.left];
    s.right = c.right == kNone ? kNone : label_[turn ? c.left : c.right];
    if (turn) std::swap(label_[c.removed], label_[c.kept]);
    s.vertex = label_[c.kept];
    s.error_m = rounded_up(error_);
    added_.push_back(label_[c.removed]);
    splits_.push_back(s);
  }

  /// After the last collapse.
  void finish(const HalfedgeMesh& mesh) {
    pm.fine_error_m = fine_error_;
    std::vector<Index> base_index;
    pm.base = mesh.to_tin(&base_index);
    std::vector<Index> id(label_.size(), kNone);  // of a label
    for (Index v = 0; v < base_index.size(); ++v)
      if (base_index[v] != kNone) id[label_[v]] = base_index[v];
    std::ranges::reverse(splits_);
    std::ranges::reverse(added_);
    for (std::size_t i = 0; i < splits_.size(); ++i)
      id[added_[i]] = Index(pm.base.vertices.size() + i);
    for (VertexSplit& s : splits_) {
      s.vertex = id[s.vertex];
      s.left = id[s.left];
      if (s.right != kNone) s.right = id[s.right];
    }
    pm.splits = std::move(splits_);
  }

  ProgressiveMesh pm;

 private:
  const HeightGrid& grid_;
  const HalfedgeMesh* mesh_ = nullptr;
  std::vector<Index> label_;  // which vertex a slot holds: turned collapses swap two
  std::vector<VertexSplit> splits_;
  std::vector<Index> added_;  // the label that each split adds
  double error_ = 0, fine_error_ = 0;

  /// The largest error of the triangles that the collapse leaves around the merged vertex.
  double error_after(const Collapse& c) const {
    const HalfedgeMesh& m = *mesh_;
    double worst = 0;
    for (const auto& [v, other] : {std::pair{c.removed, c.kept}, {c.kept, c.removed}}) {
      m.for_each_out(v, [&, gone = other](Index e) {
        const Index p = m.dest(e), q = m.apex(e);
        if (p == gone || q == gone) return;
        worst = std::max(worst, triangle_error(grid_, c.kept_after, m.position(p), m.position(q)));
      });
    }
    return worst;
  }
};

constexpr std::array<const char*, 6> kMethods = {"edge-cost",     "qem",     "memoryless",
                                                 "attribute-qem", "bounded", "triangle-collapse"};

}  // namespace

bool makes_progressive(const std::string& method) {
  return std::ranges::find(kMethods, method) != kMethods.end();
}

Result<ProgressiveMesh> make_progressive(const HeightGrid& grid, double spacing_x_m,
                                         double spacing_y_m, const SimplifyOptions& method,
                                         std::size_t base_triangles, const Progress& progress,
                                         const Lattice& lattice) {
  if (!makes_progressive(method.method)) {
    return fail(Errc::invalid_argument,
                "'" + method.method +
                    "' does not collapse edges, so it makes no progressive mesh; edge-cost, qem, "
                    "memoryless, attribute-qem, triangle-collapse and bounded do");
  }
  if (!(lattice.per_post >= 1 && lattice.per_post <= 1024 &&
        std::exp2(std::round(std::log2(lattice.per_post))) == lattice.per_post &&
        lattice.z_step_m >= 0 && std::isfinite(lattice.z_step_m))) {
    return fail(Errc::invalid_argument,
                "the lattice must be a power of two from 1 to 1024 for each post, and its step of "
                "height must not be negative");
  }
  SplitRecorder splits(grid);
  CollapseRecorder recorder;
  recorder.lattice = lattice;
  recorder.triangles = std::max<std::size_t>(base_triangles, 1);
  recorder.fine = [&](const HalfedgeMesh& mesh) { splits.start(mesh); };
  recorder.collapse = [&](const Collapse& c) { splits.collapse(c); };
  recorder.base = [&](const HalfedgeMesh& mesh) { splits.finish(mesh); };
  SimplifyOptions options = method;
  options.recorder = &recorder;
  if (!options.stop.triangles && !options.stop.ratio && !options.stop.max_error_m)
    options.stop.ratio = 1;
  const Result<Simplified> run =
      options.method == "bounded"
          ? record_bounded_collapses(grid, spacing_x_m, spacing_y_m, options, progress)
          : simplify(grid, spacing_x_m, spacing_y_m, options, progress);
  if (!run) return std::unexpected(run.error());
  return std::move(splits.pm);
}

}  // namespace tind
