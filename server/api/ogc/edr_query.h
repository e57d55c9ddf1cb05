#pragma once
// The parameters of queries of Environmental Data Retrieval, read and checked as far as that goes
// without the dataset.

#include <array>
#include <expected>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "proto/wkt.h"
#include "server/api/elevation/heights.h"
#include "server/http/message/problem.h"
#include "server/http/message/request_parser.h"
#include "server/http/operation.h"
#include "terrain/base/enum_names.h"

namespace tind::api::ogc {

enum class EdrShape { position, trajectory, corridor, area, cube };

struct EdrQuery {
  EdrShape shape = EdrShape::position;
  std::string crs = "CRS84";     // of crs_named(); of coords, bbox and the answer
  proto::WktGeometry coords;     // of all but a cube
  std::array<double, 4> bbox{};  // of a cube, as written
  int along = 0, across = 0;     // positions (resolution-x, -y); 0: as dense as the data
  double width_m = 0;            // of a corridor
  HeightQuestion question;
  bool geojson = false;
};

/// What such a query takes and answers: the rows by which it is read.
http::Operation edr_operation(EdrShape);

/// Every problem names its parameter. What has no meaning for terrain is taken and counts for
/// nothing: z and datetime, since collections have no levels and no times, Z and M of coords, and
/// the height of a corridor, which the standard demands.
std::expected<EdrQuery, std::vector<http::ParameterProblem>> read_edr_query(EdrShape,
                                                                            std::string_view query,
                                                                            const http::Fields&);

}  // namespace tind::api::ogc

namespace tind {
template <>
struct EnumNames<api::ogc::EdrShape> {
  using Shape = api::ogc::EdrShape;
  static constexpr const char* kWhat = "query";
  static constexpr std::pair<Shape, const char*> kAll[] = {{Shape::position, "position"},
                                                           {Shape::trajectory, "trajectory"},
                                                           {Shape::corridor, "corridor"},
                                                           {Shape::area, "area"},
                                                           {Shape::cube, "cube"}};
};
}  // namespace tind
