// qem, memoryless and bounded's count mode beside greedy insertion and public libraries, on the
// same mesh, in the same run, one thread each: Debian's libmeshoptimizer, and, with --cgal, CGAL's
// Lindstrom-Turk (half a minute a row).
//
//   qem_bench [--cgal] [--runs N] [DEM...]        default: bigtujunga.tif
//
// Every result is measured by the referee. Times are processor time, the best of N runs, in turns
// (CGAL: one run).

#include "terrain/mesh/validity.h"
#include "terrain/mesh/vertical_error.h"
#include "terrain/simplify/common/terrain_mesh.h"
#include "terrain/simplify/methods.h"
#include "terrain/simplify/options.h"
#include "terrain/simplify/simplify.h"
#include "tests/support/bench.h"

#if __has_include(<meshoptimizer.h>)
#include <meshoptimizer.h>
#define TIND_BENCH_MESHOPTIMIZER 1
#endif
#if TIND_WITH_CGAL
#include <CGAL/Simple_cartesian.h>
#include <CGAL/Surface_mesh.h>
#include <CGAL/Surface_mesh_simplification/Policies/Edge_collapse/Count_ratio_stop_predicate.h>
#include <CGAL/Surface_mesh_simplification/edge_collapse.h>
#endif

namespace {

using namespace tind;
using namespace tind::test;

constexpr std::array kEfforts = {Effort::fast, Effort::normal, Effort::best};

struct Contest {
  BenchDem dem;
  Tin full;  // x, y in posts
  double ratio = 1;
  std::size_t target = 0;
};

Tin ours(const Contest& c, const std::string& method, Effort effort = Effort::normal) {
  SimplifyOptions o;
  o.method = *method_named(method);
  if (auto* const bounded = std::get_if<BoundedOptions>(&o.method)) bounded->effort = effort;
  o.stop.ratio = c.ratio;
  return simplify(c.dem.terrain, o)->tin;
}

#ifdef TIND_BENCH_MESHOPTIMIZER
/// Times only the call itself: its arrays are made before.
Tin meshoptimizer(const Contest& c, double& seconds) {
  std::vector<float> positions;
  std::vector<unsigned> indices, result;
  for (const Vec3& v : c.full.vertices)
    for (const double x : {v.x * c.dem.terrain.spacing_x_m, v.y * c.dem.terrain.spacing_y_m, v.z})
      positions.push_back(float(x));
  for (const Triangle& t : c.full.triangles) indices.insert(indices.end(), t.begin(), t.end());
  result.resize(indices.size());
  seconds = processor_seconds_of([&] {
    result.resize(meshopt_simplify(result.data(), indices.data(), indices.size(), positions.data(),
                                   c.full.vertices.size(), 3 * sizeof(float), 3 * c.target, 1e9f, 0,
                                   nullptr));
  });
  Tin tin;
  tin.vertices = c.full.vertices;
  for (std::size_t i = 0; i < result.size(); i += 3)
    tin.triangles.push_back({result[i], result[i + 1], result[i + 2]});
  return tin;
}
#endif

#if TIND_WITH_CGAL
Tin lindstrom_turk(const Contest& c, double& seconds) {
  namespace sms = CGAL::Surface_mesh_simplification;
  using Mesh = CGAL::Surface_mesh<CGAL::Simple_cartesian<double>::Point_3>;
  Mesh mesh;
  for (const Vec3& v : c.full.vertices)
    mesh.add_vertex({v.x * c.dem.terrain.spacing_x_m, v.y * c.dem.terrain.spacing_y_m, v.z});
  for (const Triangle& t : c.full.triangles)
    mesh.add_face(Mesh::Vertex_index(t[0]), Mesh::Vertex_index(t[1]), Mesh::Vertex_index(t[2]));
  seconds = processor_seconds_of(
      [&] {  // stops by edges; a triangle mesh has three edges to two triangles
        sms::edge_collapse(mesh, sms::Count_ratio_stop_predicate<Mesh>(c.ratio));
      });
  mesh.collect_garbage();
  Tin tin;
  for (const auto v : mesh.vertices()) {
    const auto& p = mesh.point(v);
    tin.vertices.push_back(
        {p.x() / c.dem.terrain.spacing_x_m, p.y() / c.dem.terrain.spacing_y_m, p.z()});
  }
  for (const auto f : mesh.faces()) {
    Triangle t;
    int k = 0;
    for (const auto v : mesh.vertices_around_face(mesh.halfedge(f))) t[k++] = std::uint32_t(v);
    tin.triangles.push_back(t);
  }
  return tin;
}
#endif

void print_row(const char* name, const Contest& c, const Tin& tin, double seconds, double scale) {
  const VerticalError e = vertical_error(tin, c.dem.terrain.grid);
  fmt::print("{:22} {:9d} {:9.3f} {:9.2f} {:9.3f} {:8.2f} {:8d} {:9d}\n", name,
             tin.triangles.size(), seconds, scale > 0 ? seconds / scale : 0, e.rms_m, e.max_m,
             check_validity(tin).flipped, e.uncovered);
}

void run(const BenchDem& dem, double ratio, int runs, [[maybe_unused]] bool cgal) {
  Contest c{dem, terrain_mesh(dem.terrain)->mesh.to_tin(), ratio, 0};
  c.target = std::size_t(ratio * double(c.full.triangles.size()));
  fmt::print("\n{} to {:g} %: {} -> {} triangles\n", dem.name, 100 * ratio, c.full.triangles.size(),
             c.target);
  fmt::print("{:22} {:>9} {:>9} {:>9} {:>9} {:>8} {:>8} {:>9}\n", "", "triangles", "seconds",
             "x meshopt", "RMS m", "max m", "flipped", "uncovered");
  Tin public_result, qem, memoryless, greedy;
  double base = 1e9, qem_s = 1e9, memoryless_s = 1e9, greedy_s = 1e9;
  std::array<Tin, kEfforts.size()> bounded;
  std::array<double, kEfforts.size()> bounded_s;
  bounded_s.fill(1e9);
  for (int i = 0; i < runs; ++i) {
#ifdef TIND_BENCH_MESHOPTIMIZER
    double s = 0;
    public_result = meshoptimizer(c, s);
    base = std::min(base, s);
#endif
    qem_s = std::min(qem_s, processor_seconds_of([&] { qem = ours(c, "qem"); }));
    memoryless_s =
        std::min(memoryless_s, processor_seconds_of([&] { memoryless = ours(c, "memoryless"); }));
    greedy_s = std::min(greedy_s, processor_seconds_of([&] { greedy = ours(c, "greedy"); }));
    for (std::size_t k = 0; k < kEfforts.size(); ++k)
      bounded_s[k] =
          std::min(bounded_s[k],
                   processor_seconds_of([&] { bounded[k] = ours(c, "bounded", kEfforts[k]); }));
  }
  if (base == 1e9) base = 0;
  if (base > 0) print_row("meshopt_simplify", c, public_result, base, base);
  print_row("tind qem", c, qem, qem_s, base);
  print_row("tind memoryless", c, memoryless, memoryless_s, base);
  print_row("tind greedy", c, greedy, greedy_s, base);
  for (std::size_t k = 0; k < kEfforts.size(); ++k)
    print_row(("tind bounded " + name_of(kEfforts[k])).c_str(), c, bounded[k], bounded_s[k], base);
  for (std::size_t k = 0; k < kEfforts.size(); ++k) {
    const VerticalError e = vertical_error(bounded[k], dem.terrain.grid);
    fmt::print(
        "bounded {:6} / qem: time {:.2f}, RMS {:.3f}; / memoryless: time {:.2f}, RMS {:.3f}; "
        "/ greedy: maximum {:.3f}\n",
        name_of(kEfforts[k]), bounded_s[k] / qem_s,
        e.rms_m / vertical_error(qem, dem.terrain.grid).rms_m, bounded_s[k] / memoryless_s,
        e.rms_m / vertical_error(memoryless, dem.terrain.grid).rms_m,
        e.max_m / vertical_error(greedy, dem.terrain.grid).max_m);
  }
#if TIND_WITH_CGAL
  if (!cgal) return;
  double seconds = 0;
  const Tin tin = lindstrom_turk(c, seconds);
  print_row("CGAL Lindstrom-Turk", c, tin, seconds, base);
  fmt::print("memoryless / CGAL: time {:.3f}, RMS {:.3f}\n", memoryless_s / seconds,
             vertical_error(memoryless, dem.terrain.grid).rms_m /
                 vertical_error(tin, dem.terrain.grid).rms_m);
  for (std::size_t k = 0; k < kEfforts.size(); ++k)
    fmt::print("bounded {:6} / CGAL: time {:.3f}, RMS {:.3f}\n", name_of(kEfforts[k]),
               bounded_s[k] / seconds,
               vertical_error(bounded[k], dem.terrain.grid).rms_m /
                   vertical_error(tin, dem.terrain.grid).rms_m);
#endif
}

}  // namespace

int main(int argc, char** argv) {
  int runs = 3;
  bool cgal = false;
  std::vector<std::string> paths;
  for (int i = 1; i < argc; ++i) {
    const std::string arg = argv[i];
    if (arg == "--cgal")
      cgal = true;
    else if (arg == "--runs" && i + 1 < argc)
      runs = std::max(1, std::atoi(argv[++i]));
    else
      paths.push_back(arg);
  }
  if (paths.empty()) {
    const std::string path = default_dem("bigtujunga.tif");
    paths.push_back(path.empty() ? testdata("bigtujunga_crop.tif") : path);
  }
  for (const std::string& path : paths) {
    const BenchDem dem = load_dem(path);
    for (const double ratio : {0.1, 0.01}) run(dem, ratio, runs, cgal);
  }
}
