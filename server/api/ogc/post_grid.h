#pragma once
// How far apart a dataset's posts are, counted in a system that a client asks in.

#include "server/api/ogc/asked_crs.h"
#include "terrain/geo/coordinates.h"
#include "terrain/surface/surface.h"

namespace tind::api::ogc {

/// Of a DEM in longitudes and latitudes posts are equally far apart in degrees, and on the ground
/// the closer the nearer a pole: in such a system they are counted in its units. All else is
/// counted by ground lengths.
class PostGrid {
 public:
  /// Metres between posts.
  explicit PostGrid(Vec2 spacing_m) : spacing_m_(spacing_m) {}
  /// Of a dataset, in this system.
  PostGrid(const AskedCrs&, const Surface&);

  /// As many pixels along both sides as there are posts; not whole. `ground`: ground_m() of it.
  Vec2 pixels(const CrsBox&, Vec2 ground) const;

  /// Half a post wider on each side than the posts: the middles of as many pixels as there are
  /// posts are the posts. No wider than a turn, and not beyond the poles.
  CrsBox around(const AskedCrs&, const CrsBox& posts) const;

 private:
  Vec2 spacing_m_;
  Vec2 step_{0, 0};     // in units of the system; 0: they are not equally far apart in it
  double edge_ = 0;     // of the first pixel, where columns go around the globe
  bool wraps_ = false;  // they do
};

}  // namespace tind::api::ogc
