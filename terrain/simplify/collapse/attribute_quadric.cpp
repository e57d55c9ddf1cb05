// EQEM over the shared collapse engine. The cost class is one template over the dimension and the
// rules of the surface; what the attributes mean is known only where they are read and written.

#include "terrain/simplify/collapse/attribute_quadric.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "terrain/simplify/collapse/collapse_method.h"
#include "terrain/simplify/collapse/colour_fit.h"
#include "terrain/simplify/collapse/placement.h"
#include "terrain/simplify/common/springs.h"

namespace tind {

namespace {

using Index = HalfedgeMesh::Index;
constexpr Index kNone = HalfedgeMesh::kNone;

constexpr double kBorderWeight = 10;  // planes that hold the borders of general meshes
/// Weights of a whole unit of colour, texture or normal against the box's diagonal, at
/// attribute_weight = 1; from the experiment in docs/methods.md.
constexpr double kColourWeight = 0.0015, kTextureWeight = 0.08, kNormalWeight = 0.0016;

/// What a triangle may show wrongly of colours that a mesh is held to, at attribute_weight = 1;
/// from the experiment in docs/methods.md. (The order of collapses alone says little: the bound of
/// the heights decides nearly all of them.)
constexpr double kColourBound = 2;

/// Which attributes take part; scales turn a unit of each into metres.
struct Layout {
  bool texture = false, colour = false, normal = false;
  double texture_scale = 1, colour_scale = 1, normal_scale = 1;
  AttributeMetric metric = AttributeMetric::joint;

  int dimension() const { return 3 + 2 * texture + 3 * colour + 3 * normal; }
};

/// The most that a layout can hold.
constexpr int kMost = 8;

/// Attributes of a vertex as K floats, scaled, and back.
template <int K>
std::array<float, K> pack(const Tin& tin, std::size_t v, const Layout& l) {
  std::array<float, kMost> all{};
  int i = 0;
  if (l.texture)
    for (const float x : tin.texcoords[v]) all[i++] = float(x * l.texture_scale);
  if (l.colour)
    for (const float x : tin.colours[v]) all[i++] = float(x * l.colour_scale);
  if (l.normal)
    for (const float x : tin.normals[v]) all[i++] = float(x * l.normal_scale);
  std::array<float, K> out{};
  std::copy_n(all.begin(), K, out.begin());
  return out;
}

template <int K>
void unpack(const std::array<float, K>& in, const Layout& l, Tin& tin) {
  std::array<float, kMost> all{};
  std::copy_n(in.begin(), K, all.begin());
  int i = 0;
  auto take = [&](double scale) { return float(all[i++] / scale); };
  if (l.texture) tin.texcoords.push_back({take(l.texture_scale), take(l.texture_scale)});
  if (l.colour)
    tin.colours.push_back({take(l.colour_scale), take(l.colour_scale), take(l.colour_scale)});
  if (l.normal)
    tin.normals.push_back({take(l.normal_scale), take(l.normal_scale), take(l.normal_scale)});
}

/// Colours back into 0..1, normals back to unit length.
template <int K>
void make_valid(std::array<float, K>& attributes, const Layout& l) {
  std::array<float, kMost> a{};
  std::copy_n(attributes.begin(), K, a.begin());
  int i = l.texture ? 2 : 0;
  if (l.colour)
    for (const int end = i + 3; i < end; ++i) a[i] = std::clamp(a[i], 0.0f, float(l.colour_scale));
  if (l.normal) {
    const float n = std::sqrt(a[i] * a[i] + a[i + 1] * a[i + 1] + a[i + 2] * a[i + 2]);
    if (n > 0)
      for (const int end = i + 3; i < end; ++i) a[i] *= float(l.normal_scale) / n;
  }
  std::copy_n(a.begin(), K, attributes.begin());
}

template <int N, class Rules>
class AttributeCost {
 public:
  static constexpr bool kOnlyGrows = true;
  static constexpr int K = N - 3;
  using Attributes = std::array<float, K>;

  AttributeCost(const HalfedgeMesh& mesh, Rules& rules, const Layout& layout,
                std::vector<Attributes> attributes)
      : rules_(rules),
        layout_(layout),
        attribute_(std::move(attributes)),
        quadric_(mesh.vertex_slots()) {
    for (Index t = 0; t < mesh.triangle_slots(); ++t)
      if (mesh.alive_triangle(t)) add_triangle(mesh, 3 * t);
    if (Rules::kPlanar == 3)
      for (Index h = 0; h < mesh.halfedge_slots(); ++h)
        if (mesh.alive_triangle(h / 3) && mesh.twin(h) == kNone) add_wall(mesh, h);
  }

  [[gnu::always_inline]] void prefetch(Index v) const {
    constexpr std::size_t kLine = 64;
    const char* const q = reinterpret_cast<const char*>(&quadric_[v]);
    for (std::size_t i = 0; i < sizeof(QuadricN<N>); i += kLine) __builtin_prefetch(q + i);
    __builtin_prefetch(q + sizeof(QuadricN<N>) - 1);
    __builtin_prefetch(&attribute_[v]);
  }

  Proposal propose(const HalfedgeMesh& m, Index h) const {
    const Merge rule = rules_.rule(h);
    if (rule == Merge::never) return {};
    const Index a = m.origin(h), b = m.dest(h);
    const Placed<N> p = place_merged<N>(rules_, rule, merged(m, a, b), m, a, b);
    return {p.cost, p.at};
  }

  void merge(const HalfedgeMesh& m, Index h, const Vec3& at) {
    const Index a = m.origin(h), b = m.dest(h);
    QuadricN<N> q = merged(m, a, b);
    OffsetN<N> d{};
    const Vec3 move = metric_offset(rules_, m.position(a), at);
    d[0] = float(move.x), d[1] = float(move.y), d[2] = float(move.z);
    q.least(d, 3);
    Attributes now;
    for (int i = 0; i < K; ++i) now[i] = attribute_[a][i] + d[3 + i];
    make_valid<K>(now, layout_);
    for (int i = 0; i < K; ++i) d[3 + i] = now[i] - attribute_[a][i];
    q.move_origin(d);
    quadric_[b] = q;
    attribute_[b] = now;
    rules_.merged(a, b);
  }

  const Attributes& attributes(Index v) const { return attribute_[v]; }

 private:
  Rules& rules_;
  Layout layout_;
  std::vector<Attributes> attribute_;
  std::vector<QuadricN<N>> quadric_;

  /// Both ends' quadrics, relative to a.
  QuadricN<N> merged(const HalfedgeMesh& m, Index a, Index b) const {
    OffsetN<N> to_a;
    const Vec3 move = metric_offset(rules_, m.position(b), m.position(a));
    to_a[0] = float(move.x), to_a[1] = float(move.y), to_a[2] = float(move.z);
    for (int i = 0; i < K; ++i) to_a[3 + i] = attribute_[a][i] - attribute_[b][i];
    QuadricN<N> q = quadric_[b];
    q.move_origin(to_a);
    q.add(quadric_[a]);
    return q;
  }

  PointN<N> point(const HalfedgeMesh& m, Index v, const Vec3& origin) const {
    const Vec3 p = metric_offset(rules_, origin, m.position(v));
    PointN<N> out{p.x, p.y, p.z};
    if (layout_.metric == AttributeMetric::joint)
      for (int i = 0; i < K; ++i) out[3 + i] = attribute_[v][i];
    return out;
  }

  void add_triangle(const HalfedgeMesh& m, Index h) {
    const Vec3& origin = m.position(m.origin(h));
    const PointN<N> p = point(m, m.origin(h), origin), q = point(m, m.dest(h), origin),
                    r = point(m, m.apex(h), origin);
    const double area = length(cross({q[0], q[1], q[2]}, {r[0], r[1], r[2]})) / 2;
    QuadricN<N> plane = QuadricN<N>::of_triangle(p, q, r, area, kQuadricNSpring * area / 3);
    if (layout_.metric != AttributeMetric::joint) {
      // With equal attributes at all corners the plane says: any change of them is an error.
      // A third of the triangle's area belongs to each corner.
      for (int i = 3; i < N; ++i) plane.a[QuadricN<N>::at(i, i)] *= 1.0f / 3;
    }
    for (Index k = h; k < h + 3; ++k) quadric_[m.origin(k)].add(plane);
  }

  /// A plane through a border edge, at right angles to its triangle; attributes play no part.
  void add_wall(const HalfedgeMesh& m, Index h) {
    const Vec3 &a = m.position(m.origin(h)), &b = m.position(m.dest(h));
    const Vec3 along = b - a, normal = cross(along, m.position(m.apex(h)) - a);
    const Vec3 out = cross(along, normal);
    const double scale = dot(out, out) > 0 ? kBorderWeight * dot(along, along) / dot(out, out) : 0;
    const double n[3] = {out.x, out.y, out.z};
    QuadricN<N> wall;
    for (int i = 0; i < 3; ++i)
      for (int j = i; j < 3; ++j) wall.a[QuadricN<N>::at(i, j)] = float(scale * n[i] * n[j]);
    quadric_[m.origin(h)].add(wall);
    quadric_[m.dest(h)].add(wall);
  }
};

/// Of the box around all vertices; slots of void posts have no height and do not count.
double diagonal(const Tin& tin) {
  constexpr double kFar = std::numeric_limits<double>::max();
  Vec3 low{kFar, kFar, kFar}, high{-kFar, -kFar, -kFar};
  for (const Vec3& v : tin.vertices) {
    if (!std::isfinite(v.z)) continue;
    low = {std::min(low.x, v.x), std::min(low.y, v.y), std::min(low.z, v.z)};
    high = {std::max(high.x, v.x), std::max(high.y, v.y), std::max(high.z, v.z)};
  }
  return std::max(length(high - low), 1e-30);
}

/// `tin` carries the attributes, in the frame in which distances make sense.
Result<Layout> layout_of(const Tin& tin, const AttributeQemOptions& options) {
  Layout l;
  const AttributeChoice want = options.attributes;
  const bool automatic = want == AttributeChoice::automatic;
  l.texture =
      automatic ? tin.colours.empty() && !tin.texcoords.empty() : want == AttributeChoice::texture;
  l.colour = automatic
                 ? !tin.colours.empty()
                 : want == AttributeChoice::colour || want == AttributeChoice::colour_and_normal;
  l.normal = automatic ? !l.texture && !tin.normals.empty() : asks_for_normals(options);
  if ((l.texture && tin.texcoords.empty()) || (l.colour && tin.colours.empty()) ||
      (l.normal && tin.normals.empty()))
    return fail(Errc::invalid_argument, "the mesh has no " + name_of(want) + " to go by");
  constexpr double kMostWeight = 1e6;  // beyond, floats know nothing of the shape any more
  if (!(options.weight >= 0 && options.weight <= kMostWeight))
    return fail(Errc::invalid_argument, "the attribute weight must be a number from 0 to 1e6");
  l.metric = options.metric;
  // Nothing may be scaled to nothing, or it could not be read back.
  const double weight =
      l.metric == AttributeMetric::ignored ? 1e-7 : std::max(1e-7, options.weight);
  const double unit = weight * diagonal(tin);
  l.texture_scale = kTextureWeight * unit;
  l.colour_scale = kColourWeight * unit;
  l.normal_scale = kNormalWeight * unit;
  return l;
}

template <int N, class Rules>
Result<Simplified> run(HalfedgeMesh& mesh, Rules& rules, const Tin& attributed,
                       const Layout& layout, const RunOptions& options, const Progress& progress) {
  std::vector<std::array<float, N - 3>> packed(mesh.vertex_slots());
  for (Index v = 0; v < packed.size(); ++v) packed[v] = pack<N - 3>(attributed, v, layout);
  AttributeCost<N, Rules> cost(mesh, rules, layout, std::move(packed));
  Simplified out;
  out.input_triangles = mesh.triangle_count();
  const CollapseStop until{target_triangles(options.stop, out.input_triangles), kNever};
  CollapseRun done;
  if (options.recorder) {
    OnLattice on_lattice(cost, options.recorder->lattice);
    done = collapse_edges(mesh, on_lattice, rules, until, progress.part(0, 0.5));
    const auto bound = [&](double e) -> Rules& {
      rules.bound(e);
      return rules;
    };
    if (!done.cancelled)
      done = record_by_bounds(mesh, on_lattice, bound,
                              rules.ladder(options.stop, options.recorder->lattice),
                              *options.recorder, progress.part(0.5, 1));
  } else {
    done = collapse_edges(mesh, cost, rules, until, progress);
  }
  if (done.cancelled) return fail(Errc::cancelled, "simplification was stopped");
  out.steps = done.collapses;
  out.note = stop_note(options.stop, out.input_triangles, mesh.triangle_count());
  out.details["dimension"] = N;
  out.details["coefficients"] = QuadricN<N>::kCoefficients;
  std::vector<Index> place;
  out.tin = mesh.to_tin(&place);
  for (Index v = 0; v < place.size(); ++v)
    if (place[v] != kNone) unpack<N - 3>(cost.attributes(v), layout, out.tin);
  return out;
}

template <class Rules>
Result<Simplified> run_any(HalfedgeMesh& mesh, Rules& rules, const Tin& attributed,
                           const AttributeQemOptions& method, const RunOptions& options,
                           const Progress& progress) {
  const Result<Layout> layout = layout_of(attributed, method);
  if (!layout) return std::unexpected(layout.error());
  switch (layout->dimension()) {
    case 3:
      return run<3>(mesh, rules, attributed, *layout, options, progress);
    case 5:
      return run<5>(mesh, rules, attributed, *layout, options, progress);
    case 6:
      return run<6>(mesh, rules, attributed, *layout, options, progress);
    case 9:
      return run<9>(mesh, rules, attributed, *layout, options, progress);
    default:
      return fail(Errc::internal, "no quadric of this dimension");
  }
}

template <int N>
Result<std::uint64_t> run_held(HeldMesh& held, const Tin& attributed, const Layout& layout,
                               const Progress& progress) {
  TerrainRules rules(held);
  const HalfedgeMesh& mesh = held.terrain.mesh;
  std::vector<std::array<float, N - 3>> packed(mesh.vertex_slots());
  for (Index v = 0; v < packed.size(); ++v) packed[v] = pack<N - 3>(attributed, v, layout);
  AttributeCost<N, TerrainRules> cost(mesh, rules, layout, std::move(packed));
  Result<std::uint64_t> steps = collapse_within(held, cost, progress);
  fit_to_colours(held, progress);
  return steps;
}

/// The terrain's vertices in metres with normals of the slope (central differences where both
/// neighbours are valid, one-sided where one is) and, if there is a drape, colours.
Tin attributed_vertices(const TerrainMesh& terrain, const HeightGrid& grid,
                        const AttributeQemOptions& options) {
  auto slope = [&](int c, int r, int dc, int dr, double step) {
    const bool after = grid.inside(c + dc, r + dr) && !grid.is_void(c + dc, r + dr);
    const bool before = grid.inside(c - dc, r - dr) && !grid.is_void(c - dc, r - dr);
    const double high = after ? grid.at(c + dc, r + dr) : grid.at(c, r);
    const double low = before ? grid.at(c - dc, r - dr) : grid.at(c, r);
    if (std::isnan(high - low)) return 0.0;
    return after || before ? (high - low) / (step * (after + before)) : 0.0;
  };
  Tin tin;
  const auto positions = terrain.mesh.positions();
  for (const Vec3& p : positions) {
    // A vertex on a line between posts takes after the nearest.
    const int c = int(std::lround(p.x)), r = int(std::lround(-p.y));
    tin.vertices.push_back(terrain.metric(p));
    const double dx = slope(c, r, 1, 0, terrain.metres_x),
                 dy = slope(c, r, 0, -1, terrain.metres_y);
    const double n = 1 / std::sqrt(dx * dx + dy * dy + 1);
    tin.normals.push_back({float(-dx * n), float(-dy * n), float(n)});
    if (options.drape) tin.colours.push_back((*options.drape)[std::size_t(r) * grid.cols() + c]);
  }
  return tin;
}

}  // namespace

std::vector<std::array<float, 3>> vertex_normals(const Tin& tin) {
  std::vector<Vec3> sum(tin.vertices.size());
  for (const Triangle& t : tin.triangles) {
    const Vec3 &a = tin.vertices[t[0]], &b = tin.vertices[t[1]], &c = tin.vertices[t[2]];
    const Vec3 n = cross(b - a, c - a);
    for (const auto v : t) sum[v] = sum[v] + n;
  }
  std::vector<std::array<float, 3>> normals;
  normals.reserve(sum.size());
  for (const Vec3& n : sum) {
    const double l = length(n);
    if (l > 0)
      normals.push_back({float(n.x / l), float(n.y / l), float(n.z / l)});
    else
      normals.push_back({0, 0, 1});
  }
  return normals;
}

Result<Tin> terrain_with_attributes(const Terrain& dem, const AttributeQemOptions& options,
                                    const Constraints* constraints) {
  const Result<TerrainMesh> terrain = terrain_mesh(dem, constraints);
  if (!terrain) return std::unexpected(terrain.error());
  const Tin slots = attributed_vertices(*terrain, dem.grid, options);
  std::vector<Index> place;
  Tin tin = terrain->mesh.to_tin(&place);
  for (Index v = 0; v < place.size(); ++v) {
    if (place[v] == kNone) continue;
    tin.vertices[place[v]] = slots.vertices[v];
    tin.normals.push_back(slots.normals[v]);
    if (options.drape) tin.colours.push_back(slots.colours[v]);
  }
  return tin;
}

Result<Simplified> simplify_attribute_qem(const Terrain& dem, const AttributeQemOptions& method,
                                          const RunOptions& options, const Progress& progress) {
  if (method.drape && method.drape->size() != dem.grid.size())
    return fail(Errc::invalid_argument, "the drape needs one colour for each post");
  Result<TerrainMesh> terrain = terrain_mesh(dem, options.constraints.get());
  if (!terrain) return std::unexpected(terrain.error());
  if (options.recorder) put_on_lattice(terrain->mesh, options.recorder->lattice);
  const Tin attributed = attributed_vertices(*terrain, dem.grid, method);
  TerrainRules rules(*terrain, dem.grid, options.stop.max_error_m);
  return run_any(terrain->mesh, rules, attributed, method, options, progress);
}

Result<Simplified> attribute_qem_mesh(const Tin& tin, const AttributeQemOptions& method,
                                      const RunOptions& options, const Progress& progress) {
  Result<HalfedgeMesh> mesh = HalfedgeMesh::from_tin(tin);
  if (!mesh) return std::unexpected(mesh.error());
  SurfaceRules rules(*mesh);
  const auto seams = double(rules.seam_vertices());
  const auto run_on = [&](const Tin& attributed) {
    auto made = run_any(*mesh, rules, attributed, method, options, progress);
    if (made) made->details[kSeamVertices] = seams;
    return made;
  };
  if (!asks_for_normals(method) || !tin.normals.empty()) return run_on(tin);
  Tin with_normals = tin;
  with_normals.normals = vertex_normals(tin);
  return run_on(with_normals);
}

Result<std::uint64_t> collapse_held(HeldMesh& held, const AttributeQemOptions& method,
                                    const Progress& progress) {
  const HalfedgeMesh& mesh = held.terrain.mesh;
  Tin attributed;
  for (const Vec3& p : mesh.positions()) attributed.vertices.push_back(held.terrain.metric(p));
  for (Index t = 0; t < mesh.triangle_slots(); ++t)
    if (mesh.alive_triangle(t))
      attributed.triangles.push_back(
          {mesh.origin(3 * t), mesh.origin(3 * t + 1), mesh.origin(3 * t + 2)});
  attributed.normals = vertex_normals(attributed);
  if (held.colours) {
    for (const Vec3& p : mesh.positions()) attributed.colours.push_back(held.colours->at(p.x, p.y));
    held.colour_bound = kColourBound / (method.weight * method.weight);
  }
  AttributeQemOptions asked = method;
  if (!held.colours && asked.attributes == AttributeChoice::colour)
    asked.metric = AttributeMetric::ignored;  // an image that is not here
  if (!held.colours && asked.attributes != AttributeChoice::automatic)
    asked.attributes = AttributeChoice::normal;
  const Result<Layout> layout = layout_of(attributed, asked);
  if (!layout) return std::unexpected(layout.error());
  switch (layout->dimension()) {
    case 9:
      return run_held<9>(held, attributed, *layout, progress);
    case 6:
      return run_held<6>(held, attributed, *layout, progress);
    default:
      return run_held<3>(held, attributed, *layout, progress);
  }
}

}  // namespace tind
