#pragma once
// View-dependent refinement [Hoppe97] that follows a camera: from one view to the next only what
// changes is looked at.
//
// Every triangle that is good enough has a *slack*, how far the camera may move before it might not
// be; a queue ordered by that tells which to look at again. The same for every node that could be
// taken back. So an update costs in proportion to how far the camera went, not to the mesh.

#include <memory>
#include <optional>
#include <vector>

#include "terrain/base/result.h"
#include "terrain/progressive/multires/camera.h"
#include "terrain/progressive/multires/front.h"
#include "terrain/raster/dem_source.h"

namespace tind {

/// Where the vertices of a multi-triangulation lie on the ellipsoid.
struct ViewGeometry {
  LocalFrame frame;
  std::vector<std::array<float, 3>> position;  // local, per vertex
  double extent_m = 0;
};

/// `window_col`, `window_row`: the DEM's post that is the triangulation's (0, 0). Fails
/// (unsupported) for a DEM without a place on the earth.
Result<ViewGeometry> view_geometry(const MultiTriangulation&, const DemSource&,
                                   std::int64_t window_col = 0, std::int64_t window_row = 0);

class ViewFront {
 public:
  /// Borrows both.
  ViewFront(const MultiTriangulation&, const ViewGeometry&);

  /// Every post in the picture is then drawn within the tolerance, if the finest triangles can.
  void look(const Camera&);

  const Front& front() const { return front_; }
  FrontChange take_change() { return front_.take_change(); }
  std::size_t memory_bytes() const {
    return front_.memory_bytes() + sizeof(Watch) * watches_.capacity();
  }

 private:
  using Index = Front::Index;
  struct Watch {
    double due;  // on the odometer
    Index id;
    bool node;
    bool operator<(const Watch& o) const { return due > o.due; }  // the first due on top
  };
  View::Verdict judge(Index triangle) const;
  void watch(Index id, bool node, double slack);
  void watch_all();
  void refine();
  void coarsen();
  bool removable(Index node, double& slack) const;

  const MultiTriangulation& all_;
  const ViewGeometry& geometry_;
  Front front_;
  std::optional<View> view_;
  double odometer_ = 0;  // all motion until now
  std::vector<Watch> watches_;
  std::vector<Index> open_, candidates_;
};

}  // namespace tind
