// look(): the odometer moves on; what is due is judged. Triangles that are too coarse are split,
// with all that this needs; then nodes that nobody needs any more are taken back, leaf by leaf.

#include "terrain/progressive/multires/view_front.h"

#include <algorithm>
#include <cmath>

#include "terrain/geo/ellipsoid.h"

namespace tind {

Result<ViewGeometry> view_geometry(const MultiTriangulation& all, const DemSource& dem,
                                   std::int64_t window_col, std::int64_t window_row) {
  if (dem.info().crs_kind == CrsKind::none)
    return fail(Errc::unsupported,
                "the DEM has no coordinate system: a camera has no place above it");
  std::vector<Vec2> posts;
  posts.reserve(all.vertices().size());
  for (const Vec3& v : all.vertices())
    posts.push_back({v.x + double(window_col), -v.y + double(window_row)});
  std::vector<Geographic> places(posts.size());
  dem.to_geographic(posts, places);
  GeoRect box{HUGE_VAL, HUGE_VAL, -HUGE_VAL, -HUGE_VAL};
  for (Geographic& p : places) {
    if (std::isnan(p.lon + p.lat))
      return fail(Errc::unsupported, "a post of the DEM has no longitude and latitude");
    // On this side of the antimeridian as the first.
    p.lon -= 360 * std::round((p.lon - places.front().lon) / 360);
    box = {std::min(box.west, p.lon), std::min(box.south, p.lat), std::max(box.east, p.lon),
           std::max(box.north, p.lat)};
  }
  ViewGeometry out;
  out.frame = LocalFrame::at({(box.west + box.east) / 2, (box.south + box.north) / 2});
  out.position.reserve(places.size());
  for (std::size_t i = 0; i < places.size(); ++i) {
    const Vec3 p = out.frame.from_ecef(wgs84::to_ecef(places[i], all.vertices()[i].z));
    out.extent_m = std::max(out.extent_m, length(p));
    out.position.push_back({float(p.x), float(p.y), float(p.z)});
  }
  return out;
}

ViewFront::ViewFront(const MultiTriangulation& all, const ViewGeometry& geometry)
    : all_(all), geometry_(geometry), front_(all) {}

View::Verdict ViewFront::judge(Index t) const {
  const Triangle& c = all_.corners(t);
  const auto& at = geometry_.position;
  return view_->judge(at[c[0]], at[c[1]], at[c[2]], all_.error_m(t), all_.steepest_deg(t));
}

void ViewFront::watch(Index id, bool node, double slack) {
  watches_.push_back({odometer_ + slack, id, node});
  std::push_heap(watches_.begin(), watches_.end());
}

/// Everything is due: at the first look, with another lens, or when stale entries have piled up.
void ViewFront::watch_all() {
  watches_.clear();
  open_.clear();
  candidates_.clear();
  for (const Index t : front_.active_triangles()) {
    open_.push_back(t);
    const Index maker = all_.maker(t);
    if (maker != Front::kNone) candidates_.push_back(maker);
  }
  std::sort(candidates_.begin(), candidates_.end());
  candidates_.erase(std::unique(candidates_.begin(), candidates_.end()), candidates_.end());
}

void ViewFront::look(const Camera& camera) {
  const View next(camera, geometry_.frame, geometry_.extent_m);
  const bool follows = view_ && next.same_lens(*view_);
  if (follows) odometer_ += next.motion_from(*view_);
  view_ = next;
  open_.clear();
  candidates_.clear();
  if (!follows || watches_.size() > 4 * front_.triangle_count() + 1024) {
    watch_all();
  } else {
    while (!watches_.empty() && watches_.front().due <= odometer_) {
      const Watch due = watches_.front();
      std::pop_heap(watches_.begin(), watches_.end());
      watches_.pop_back();
      if (due.node)
        candidates_.push_back(due.id);
      else if (front_.active(due.id))
        open_.push_back(due.id);
    }
  }
  refine();
  coarsen();
}

void ViewFront::refine() {
  while (!open_.empty()) {
    const Index t = open_.back();
    open_.pop_back();
    const Index node = all_.splitter(t);
    if (node == Front::kNone || front_.applied(node)) continue;
    const View::Verdict verdict = judge(t);
    if (!verdict.too_coarse) {
      watch(t, false, verdict.slack_m);
      continue;
    }
    front_.apply(node, [&](Index n) {
      candidates_.push_back(n);
      for (Index f = all_.fine_begin(n); f < all_.fine_end(n); ++f) open_.push_back(f);
    });
  }
}

/// A node stays while one of its coarse triangles would be too coarse: then for `slack` at a guess.
bool ViewFront::removable(Index node, double& slack) const {
  for (Index i = all_.coarse_begin(node); i < all_.coarse_end(node); ++i) {
    const View::Verdict verdict = judge(all_.coarse(i).triangle);
    if (!verdict.too_coarse) continue;
    slack = verdict.slack_m;
    return false;
  }
  return true;
}

void ViewFront::coarsen() {
  while (!candidates_.empty()) {
    const Index node = candidates_.back();
    candidates_.pop_back();
    if (!front_.applied(node) || !front_.leaf(node)) continue;
    double slack = 0;
    if (!removable(node, slack)) {
      watch(node, true, slack);
      continue;
    }
    front_.take_back(node);
    for (Index i = all_.coarse_begin(node); i < all_.coarse_end(node); ++i) {
      const auto [maker, t] = all_.coarse(i);
      watch(t, false, judge(t).slack_m);
      if (maker != Front::kNone) candidates_.push_back(maker);
    }
  }
}

}  // namespace tind
