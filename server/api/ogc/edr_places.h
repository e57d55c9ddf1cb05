#pragma once
// Where an EDR query asks for heights: its own places, places along a line, beside it, or on a grid
// over an area.

#include <expected>
#include <vector>

#include "proto/coverage_json.h"
#include "server/api/ogc/asked_crs.h"
#include "server/api/ogc/edr_query.h"

namespace tind::api::ogc {

struct EdrPlaces {
  std::vector<Geographic> where;  // NaN: no place, or outside the area; nobody is asked there
  std::vector<Vec2> points;       // the same in the query's system; of a grid none
  // Of a grid, rows from the north.
  bool grid = false;
  proto::CoverageAxis x, y;
  /// Of a trajectory: where each of its lines begins.
  std::vector<std::size_t> lines;
};

/// How far apart the data's own places are, metres, for who asks for no number of them.
double spacing_m(const services::ServedDataset&);

/// At most kMostPlaces: fewer than the data has where they would be more. The places of a
/// trajectory and the middle of a corridor lie on geodesics; of a trajectory all given ones are
/// among them. An area's grid is that of its bounding box; places on its rim are inside. The
/// problem names the parameter.
std::expected<EdrPlaces, http::ParameterProblem> edr_places(const EdrQuery&, const AskedCrs&,
                                                            double spacing_m);

/// Where a row lies in a polygon: ranges of x, both ends inside. By the even-odd rule, so that
/// inner rings are holes, whichever way they go.
std::vector<std::pair<double, double>> spans_inside(const std::vector<std::vector<Vec2>>& rings,
                                                    double y);

}  // namespace tind::api::ogc
