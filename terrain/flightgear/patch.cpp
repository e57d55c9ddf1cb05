// Borders first, then the mesh that `bounded` fits between them, then the referee. The band of the
// fit leaves room for what straight triangles sag; where it was too little, it is tried again.

#include "terrain/flightgear/patch.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <optional>
#include <span>

#include "terrain/base/power_of_two.h"
#include "terrain/flightgear/patch_error.h"
#include "terrain/flightgear/patch_ground.h"
#include "terrain/geo/ellipsoid.h"
#include "terrain/geo/longitude.h"
#include "terrain/simplify/bounded/bounded_mesher.h"
#include "terrain/simplify/bounded/search_effort.h"
#include "terrain/surface/height_field.h"
#include "terrain/surface/post_warp.h"
#include "terrain/surface/rim_samples.h"
#include "terrain/surface/tile_posts.h"
#include "terrain/tile/border.h"
#include "terrain/tile/normals.h"
#include "terrain/tile/tile_model.h"

namespace tind::flightgear {
namespace {

constexpr double kE = kTileExtent;
constexpr double kRadians = std::numbers::pi / 180;
constexpr double kFitShare = 0.95;    // of the budget, for the fit of posts inside
constexpr double kBorderShare = 0.6;  // for that of the border
constexpr double kSagShare = 0.125;   // for what an edge of the frame sags, and bows sideways
constexpr int kMostCells = 128;
constexpr double kNarrower[] = {1, 0.8, 0.5};  // of that, where what sags was too much

enum Side { kWest, kSouth, kEast, kNorth };

TileEdge edge_of(GeoRect r, Side side) {
  if (side == kEast && r.east == 180) r.east = -180;  // the antimeridian is one line
  switch (side) {
    case kWest:
      return {{r.west, r.south}, {r.west, r.north}};
    case kSouth:
      return {{r.west, r.south}, {r.east, r.south}};
    case kEast:
      return {{r.east, r.south}, {r.east, r.north}};
    case kNorth:
      return {{r.west, r.north}, {r.east, r.north}};
  }
  return {};
}

GeoRect around(const TileEdge& e) { return {e.start.lon, e.start.lat, e.end.lon, e.end.lat}; }

/// Into so many pieces a rectangle (or a line) is cut that no straight piece is farther from it
/// than that share of the budget, neither below it nor beside it. A power of two.
int cells_of(const GeoRect& r, double budget) {
  const double lat = std::min(std::abs(r.south), std::abs(r.north)) * kRadians;
  const double circle = wgs84::kSemiMajor * std::cos(lat);  // of the parallel
  const double along = r.width() * kRadians, up = r.height() * kRadians;
  // A chord of an angle leaves a circle by radius * angle^2 / 8; a parallel's lies in its plane.
  const double sag = std::max(circle * along * along, wgs84::kSemiMajor * up * up) / 8;
  int cells = 1;
  while (sag / cells / cells > kSagShare * budget && cells < kMostCells) cells *= 2;
  return cells;
}

/// So that triangles beside it can follow what the ground is made of.
int ground_cells_of(const TileEdge& e) {
  const Vec2 degree = wgs84::metres_per_degree((e.start.lat + e.end.lat) / 2);
  const double length = std::hypot(std::abs(e.end.lon - e.start.lon) * degree.x,
                                   (e.end.lat - e.start.lat) * degree.y);
  int cells = 1;
  while (length / cells > 2 * kGroundDetail_m && cells < kMostCells) cells *= 2;
  return cells;
}

double height_step(double budget) {
  return std::clamp(power_of_two_at_most(budget / 32), 1.0 / 256, 1.0);
}

class PatchMaker {
 public:
  PatchMaker(const BucketPlan& plan, const GeoRect& rect, std::stop_token stop,
             const LandCover* cover)
      : plan_(plan), rect_(rect), stop_(std::move(stop)), cover_(cover), field_(plan.surface()) {
    patch_.rect = rect;
    budget_ = plan.budget_m(rect);
    field_.fill_towards([&plan](std::span<const Geographic> places, std::span<double> heights) {
      std::ranges::fill(heights, 0);
      plan.take_to_sea(places, heights);
      for (double& h : heights) h = -h;
    });
  }

  Result<Patch> make();

 private:
  const BucketPlan& plan_;
  const GeoRect rect_;
  const std::stop_token stop_;
  const LandCover* const cover_;
  HeightField field_;
  double budget_;
  std::vector<LayerWindow> windows_;
  std::optional<TilePosts> posts_;
  std::array<std::vector<BorderVertex>, 4> borders_;
  Patch patch_;

  Result<void> load();
  double void_share() const;
  void derive_borders();
  template <class Samples>
  HalfedgeMesh frame(const Samples&, double x_scale) const;
  template <class Samples>
  Tin fit(const Samples&, double eps) const;
  void place();
  Result<void> measure();
  Result<void> give_normals();
};

/// The posts around it, so that H is a matter of memory.
Result<void> PatchMaker::load() {
  constexpr int kMargin = 4;
  auto windows = surface_windows(plan_.surface(), rect_);
  if (!windows) return std::unexpected(windows.error());
  windows_ = std::move(*windows);
  for (const auto& [layer, w, step, alone] : windows_)
    if (auto done = field_.load(layer, w.col - kMargin, w.row - kMargin, int(w.cols) + 2 * kMargin,
                                int(w.rows) + 2 * kMargin);
        !done)
      return done;
  std::vector<Vec3> beside;
  if (!plan_.surface().only()) {
    auto samples = rim_samples(field_, rect_);
    if (!samples) return std::unexpected(samples.error());
    beside = std::move(*samples);
  }
  auto posts = TilePosts::read(field_, windows_, rect_, 0, beside);
  if (!posts) return std::unexpected(posts.error());
  posts_.emplace(std::move(*posts));
  patch_.posts = posts_->inside();
  return {};
}

/// At the middles of so many cells that what is missing is known to a thousandth of the patch.
double PatchMaker::void_share() const {
  constexpr int kSide = 32;
  std::vector<Geographic> places;
  for (int j = 0; j < kSide; ++j)
    for (int i = 0; i < kSide; ++i)
      places.push_back({rect_.west + (i + .5) / kSide * rect_.width(),
                        rect_.south + (j + .5) / kSide * rect_.height()});
  std::vector<double> heights(places.size());
  field_.at(places, heights);
  return double(std::ranges::count_if(heights, [](double h) { return std::isnan(h); })) /
         double(heights.size());
}

void PatchMaker::derive_borders() {
  for (const Side side : {kWest, kSouth, kEast, kNorth}) {
    const TileEdge edge = edge_of(rect_, side);
    const GeoRect line = around(edge);
    const double budget = plan_.budget_m(line);
    BorderOptions o;
    o.tolerance_m = kBorderShare * budget;
    o.height_step = height_step(budget);
    o.fixed_cells = cells_of(line, budget);
    if (cover_) o.fixed_cells = std::max(o.fixed_cells, ground_cells_of(edge));
    o.samples = 2048;
    Border border = make_border(edge, field_, plan_.surface(), o);
    borders_[side] = std::move(border.line);
    patch_.edge_error_m = std::max(patch_.edge_error_m, border.error_m);
  }
}

/// The rectangle with its borders, and a lattice against the earth's curvature.
template <class Samples>
HalfedgeMesh PatchMaker::frame(const Samples& samples, double x_scale) const {
  const auto& [west, south, east, north] = borders_;
  Tin corners;
  corners.vertices = {{0, 0, south.front().height},
                      {kE, 0, south.back().height},
                      {kE, kE, north.back().height},
                      {0, kE, north.front().height}};
  corners.triangles = {{0, 1, 2}, {0, 2, 3}};
  HalfedgeMesh mesh = *HalfedgeMesh::from_tin(corners);
  InsertionOptions o;
  o.x_scale = x_scale;
  DelaunayInsertion<Samples> insertion(mesh, samples, o);
  const auto insert = [&](const std::vector<BorderVertex>& line, auto&& place) {
    for (std::size_t i = 1; i + 1 < line.size(); ++i)
      insertion.insert_point(place(double(line[i].t), line[i].height));
  };
  insert(west, [](double t, double h) { return Vec3{0, t, h}; });
  insert(south, [](double t, double h) { return Vec3{t, 0, h}; });
  insert(east, [](double t, double h) { return Vec3{kE, t, h}; });
  insert(north, [](double t, double h) { return Vec3{t, kE, h}; });
  const int cells = cells_of(rect_, budget_);
  std::vector<Vec3> points;
  std::vector<Geographic> places;
  for (int j = 1; j < cells; ++j)
    for (int i = 1; i < cells; ++i) {
      points.push_back({std::round(i * kE / cells), std::round(j * kE / cells), 0});
      places.push_back(place_of(rect_, points.back()));
    }
  std::vector<double> heights(places.size());
  field_.filled(places, heights);
  for (std::size_t k = 0; k < points.size(); ++k)
    insertion.insert_point(
        {points[k].x, points[k].y, snap_height(heights[k], height_step(budget_))});
  return mesh;
}

/// Within eps of the samples as far as borders and steps let it; as if the earth were flat.
template <class Samples>
Tin PatchMaker::fit(const Samples& samples, double eps) const {
  const Vec2 degree = wgs84::metres_per_degree((rect_.south + rect_.north) / 2);
  const double unit_m = rect_.height() * degree.y / kE;
  MesherOptions o;
  o.eps = eps;
  if (!posts_->empty()) o.relief = posts_->max_m() - posts_->min_m();
  o.x_scale = std::max(0.05, rect_.width() * degree.x / (rect_.height() * degree.y));
  o.locked_border = o.integer_lattice = true;
  o.lattice_max = kE;
  o.height_step = height_step(budget_);
  const double place = std::min(plan_.spacing_m(rect_) / 4, eps) / unit_m;
  o.lattice_step = o.search_step_min =
      std::clamp(power_of_two_at_most(std::max(place, 1.0)), 1.0, 64.0);
  set_effort(tile_effort(plan_.effort()), o);
  HalfedgeMesh start = frame(samples, o.x_scale);
  o.pinned = std::uint32_t(start.vertex_slots());
  BoundedMesher mesher(std::move(start), samples, o);
  Progress progress;
  progress.stop = stop_;
  mesher.run(progress);
  return mesher.mesh().to_tin();
}

/// To where FlightGear has its vertices.
void PatchMaker::place() {
  const auto& vertices = patch_.mesh.vertices;
  std::vector<Geographic> places;
  std::vector<double> heights;
  for (const Vec3& v : vertices) {
    places.push_back(place_of(rect_, v));
    heights.push_back(v.z);
  }
  plan_.take_to_sea(places, heights);
  patch_.ecef.clear();
  const auto snap = [](double x) { return std::nearbyint(x / kLatticeStep) * kLatticeStep; };
  for (std::size_t i = 0; i < vertices.size(); ++i) {
    const Vec3 at = wgs84::to_ecef(within_first_turn(places[i]), heights[i]);
    patch_.ecef.push_back({snap(at.x), snap(at.y), snap(at.z)});
  }
}

Result<void> PatchMaker::measure() {
  const PatchShape shape{rect_, patch_.mesh, patch_.ecef};
  patch_.max_error_m =
      posts_->visit([&](const auto& samples) { return patch_error(shape, samples, plan_); });
  if (patch_.posts > 0) patch_.max_error_m += plan_.surface().info().rounding_m;
  return {};
}

/// From heights that are the same for all patches that share a vertex.
Result<void> PatchMaker::give_normals() {
  std::vector<Geographic> places;
  std::vector<double> reaches;
  for (const Vec3& v : patch_.mesh.vertices) {
    const Geographic p = within_first_turn(place_of(rect_, v));
    const double reach = plan_.spacing_m({p.lon, p.lat, p.lon, p.lat}) / 111320;
    reaches.push_back(reach);
    places.insert(places.end(), {{p.lon - reach, p.lat},
                                 {p.lon + reach, p.lat},
                                 {p.lon, std::max(-90.0, p.lat - reach)},
                                 {p.lon, std::min(90.0, p.lat + reach)},
                                 p});
  }
  std::vector<double> h(places.size());
  field_.filled(places, h);
  for (std::size_t i = 0; i < h.size(); i += 5) {
    const Vec2 degree = wgs84::metres_per_degree(places[i + 4].lat);
    const double reach = reaches[i / 5];
    patch_.normals.push_back(ecef_normal(places[i + 4],
                                         (h[i + 1] - h[i]) / (2 * reach * std::max(degree.x, 1.0)),
                                         (h[i + 3] - h[i + 2]) / (2 * reach * degree.y)));
  }
  if (const auto error = field_.error()) return std::unexpected(*error);
  return {};
}

Result<Patch> PatchMaker::make() {
  if (auto done = load(); !done) return std::unexpected(done.error());
  patch_.void_share = void_share();
  derive_borders();
  if (const auto error = field_.error()) return std::unexpected(*error);
  const auto ground = PatchGround::make(plan_, rect_, cover_);
  if (!ground) return std::unexpected(ground.error());
  std::optional<Patch> best;
  for (const double narrower : kNarrower) {
    if (best && best->max_error_m <= budget_) break;
    patch_.mesh = posts_->visit(
        [&](const auto& samples) { return fit(samples, narrower * kFitShare * budget_); });
    if (stop_.stop_requested()) return fail(Errc::cancelled, "stopped");
    ground->cut(patch_.mesh);
    place();
    if (auto done = measure(); !done) return std::unexpected(done.error());
    if (!best || patch_.max_error_m < best->max_error_m) best = patch_;
  }
  patch_ = std::move(*best);
  for (const std::uint32_t i : ground->of_triangles(patch_.mesh))
    patch_.materials.push_back(ground->materials()[i]);
  if (auto done = give_normals(); !done) return std::unexpected(done.error());
  return std::move(patch_);
}

}  // namespace

Result<Patch> make_patch(const BucketPlan& plan, const GeoRect& rect, std::stop_token stop,
                         const LandCover* cover) {
  return PatchMaker(plan, rect, std::move(stop), cover).make();
}

std::vector<GeoRect> patch_rects(const BucketPlan& plan, BucketId id) {
  int width = width_of_row(id.row);  // of patches, with the narrower of the rows beside it
  for (const int row : {id.row - 1, id.row + 1})
    if (row >= 0 && row < kRows) width = std::min(width, width_of_row(row));
  const int parts = plan.parts_of_eighth();
  const GeoRect whole = rect(id);
  std::vector<GeoRect> rects;
  for (int j = 0; j < parts; ++j)
    for (int k = 0; k < width_of_row(id.row) / width * parts; ++k) {
      const double west = whole.west + k * (width / 8.0 / parts);
      const double south = whole.south + j * (1 / 8.0 / parts);
      rects.push_back({west, south, west + width / 8.0 / parts, south + 1 / 8.0 / parts});
    }
  return rects;
}

}  // namespace tind::flightgear
