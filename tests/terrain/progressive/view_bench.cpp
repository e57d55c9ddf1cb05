// View-dependent refinement over two neighbouring 1-degree cells: is every post in view within the
// tolerance, how many triangles does that take beside a uniform mesh of the same guarantee, and how
// long does an update take beside refining from scratch.
//
//   view_bench [CAMERAS [DEM ...]]     1000 cameras over the shared N49W123 + N49W124 by default

#include <map>

#include "terrain/geo/ellipsoid.h"
#include "terrain/progressive/multires/levelled_collapse.h"
#include "terrain/progressive/multires/refine_region.h"
#include "terrain/progressive/multires/view_front.h"
#include "tests/support/bench.h"
#include "tests/terrain/progressive/posts_in_view.h"

namespace {

using namespace tind;

struct World {
  std::shared_ptr<const DemSource> dem;
  HeightGrid grid;
  MultiTriangulation all;
  ViewGeometry geometry;
  std::vector<Vec3> places;
  const Affine& map() const { return dem->info().post_to_crs; }
};

/// Triangles of the uniform front within `error`; measured on a ladder of errors of 2^(1/4), at the
/// next larger one, which favours the uniform mesh.
std::size_t uniform_triangles(const World& w, double error, std::map<int, std::size_t>& known) {
  const int step = std::max(-20, int(std::ceil(4 * std::log2(std::max(error, 0.01)))));
  if (const auto it = known.find(step); it != known.end()) return it->second;
  const double e = std::exp2(step / 4.0);
  const Region none = Region::polygon({{-9, 9}, {-8, 9}, {-8, 8}});
  return known[step] = refine_region(w.all, none, {e, e}).triangle_count();
}

void random_cameras(const World& w, int cameras) {
  std::mt19937 random(1);
  std::map<int, std::size_t> known;
  std::size_t posts = 0, beyond = 0, above_fifth = 0;
  double worst = 0, ours = 0, theirs = 0;
  std::vector<double> ratios, triangles;
  for (int i = 0; i < cameras; ++i) {
    const Camera camera = test::random_camera(w.grid, w.map(), random);
    ViewFront view(w.all, w.geometry);
    view.look(camera);
    const test::InView in =
        test::look_at_posts(view.front().to_tin(), w.grid, w.places, w.map(), camera);
    posts += in.posts;
    beyond += in.worst_px > camera.tolerance_px;
    worst = std::max(worst, in.worst_px / camera.tolerance_px);
    if (in.posts == 0) continue;
    const double focal = test::Pinhole(camera).focal;
    const double uniform =
        double(uniform_triangles(w, camera.tolerance_px * in.nearest_m / focal, known));
    const double own = double(view.front().triangle_count());
    ours += own, theirs += uniform;
    ratios.push_back(own / uniform);
    triangles.push_back(own);
    above_fifth += own / uniform > 0.2;
  }
  std::sort(ratios.begin(), ratios.end());
  fmt::print(
      "{} random cameras, 1920 x 1080, 60 degrees, 1 px: {} posts in view, {} cameras with a post "
      "beyond the tolerance, the worst at {:.3f} of it\n"
      "  triangles: median {:.0f}; of a uniform mesh of the same guarantee: {:.4f} in all, median "
      "{:.4f}, 95th percentile {:.4f}, most {:.4f}; above 0.2: {} cameras\n",
      cameras, posts, beyond, worst, test::median(triangles), ours / theirs, test::median(ratios),
      ratios[ratios.size() * 95 / 100], ratios.back(), above_fifth);
}

/// A flight at 250 m/s, with the tolerance at which the front has about 100,000 vertices.
void flight(const World& w, double frames_per_second) {
  const GeoRect& b = w.dem->info().bounds;
  Camera camera;
  camera.position = {b.west + 0.25 * b.width(), b.south + 0.4 * b.height()};
  camera.height_m = 3000, camera.heading_deg = 80, camera.pitch_deg = -8;
  for (double lo = 0.05, hi = 8; hi / lo > 1.02;) {
    camera.tolerance_px = std::sqrt(lo * hi);
    ViewFront view(w.all, w.geometry);
    view.look(camera);
    (view.front().triangle_count() > 200000 ? lo : hi) = camera.tolerance_px;
  }
  ViewFront view(w.all, w.geometry);
  view.look(camera);
  view.take_change();
  std::vector<double> update, scratch, changed, vertices;
  const double lon = wgs84::metres_per_degree(camera.position.lat).x;
  for (int frame = 0; frame < 120; ++frame) {
    camera.position.lon += 250 / frames_per_second / lon;
    update.push_back(test::seconds_of([&] { view.look(camera); }));
    const FrontChange change = view.take_change();
    changed.push_back(double(change.added_triangles.size() + change.removed_triangles.size()));
    vertices.push_back(double(view.front().triangle_count()) / 2);
    if (frame % 10 == 9) {
      ViewFront anew(w.all, w.geometry);
      scratch.push_back(test::seconds_of([&] { anew.look(camera); }));
    }
  }
  double mean = 0;
  for (const double s : update) mean += s / double(update.size());
  fmt::print(
      "250 m/s at {:.0f} views a second, {:.0f} vertices ({:.2f} px): update {:.3f} ms (mean "
      "{:.3f}), from "
      "scratch {:.1f} ms: {:.4f} of it; {:.0f} triangles change\n",
      frames_per_second, test::median(vertices), camera.tolerance_px, 1e3 * test::median(update),
      1e3 * mean, 1e3 * test::median(scratch), mean / test::median(scratch), test::median(changed));
}

}  // namespace

int main(int argc, char** argv) {
  const int cameras = argc > 1 ? std::atoi(argv[1]) : 1000;
  std::vector<std::string> files(argv + std::min(argc, 2), argv + argc);
  if (files.empty()) files = {test::default_dem("N49W124.tif"), test::default_dem("N49W123.tif")};
  const auto dem = DemSource::open(files);
  if (!dem) {
    fmt::print(stderr, "{}\n", dem.error().what);
    return 2;
  }
  const DemInfo& info = (*dem)->info();
  World w{*dem, *(*dem)->read(0, 0, int(info.cols), int(info.rows)), {}, {}, {}};
  const double built = test::seconds_of([&] {
    w.all = *levelled_terrain({w.grid, info.spacing_x_m, info.spacing_y_m}, {.threads = 2});
  });
  w.geometry = *view_geometry(w.all, *w.dem);
  w.places = test::post_places(w.grid, w.map());
  fmt::print("{} x {} posts: {} nodes, {} triangles, {} in the base, {:.0f} MB, {:.1f} s\n",
             info.cols, info.rows, w.all.nodes(), w.all.triangles(),
             w.all.triangles() - w.all.base_begin(), double(w.all.memory_bytes()) / 1e6, built);
  for (const double rate : {60.0, 30.0, 10.0}) flight(w, rate);
  random_cameras(w, cameras);
}
