// What rounding does to the error, in the tile's own frame, which is the certificate's: a vertex is
// moved by at most d metres, up or aside; moving it aside by d changes the height at a place by at
// most d times the slope of the surface around there, and by no more than its relief there.
//
// What straightness does: let P(longitude, latitude, height) be the place in space. Over a triangle
// with corners q_i and weights w_i, the straight surface lies at sum w_i P(q_i), the certificate's
// at P(sum w_i q_i). By Taylor, with sum w_i (q_i - q) = 0, they differ by at most half of
// sum w_i |D2P[q_i - q, q_i - q]|, and a weighted mean of products of two coordinates'
// differences is at most a quarter of the product of their ranges (Popoviciu; Cauchy-Schwarz).
// D2P is written out below, upwards and aside, for the largest latitude of the triangle.

#include "terrain/encode/glb_tile.h"

#include <algorithm>
#include <map>
#include <nlohmann/json.hpp>
#include <numbers>

#include "proto/image/png.h"
#include "terrain/geo/ellipsoid.h"
#include "terrain/tile/border.h"
#include "terrain/tile/normals.h"

namespace tind {
namespace {

constexpr int kFinestLattice = 13;       // level
constexpr double kCoarsestPacked = 512;  // of compressed positions: on level 0, metres
constexpr double kRadians = std::numbers::pi / 180;

/// Metres to a unit of the tile's grid, the fewest at a triangle's vertices. At a pole, where all
/// longitudes are one place, nothing is moved along u.
struct Scale {
  double u = HUGE_VAL, v = HUGE_VAL;
};

Scale scale_of(const GeoRect& rect, const Tin& mesh, const Triangle& triangle) {
  Scale scale;
  for (const std::uint32_t i : triangle) {
    const Geographic p = place_of(rect, mesh.vertices[i]);
    const Vec2 degree = wgs84::metres_per_degree(p.lat);
    scale.v = std::min(scale.v, degree.y * rect.height() / kTileExtent);
    if (std::abs(p.lat) < 90) scale.u = std::min(scale.u, degree.x * rect.width() / kTileExtent);
  }
  return scale;
}

/// Metres up for a metre east, and for one north.
Vec2 slope_of(const GeoRect& rect, const Tin& mesh, const Triangle& triangle) {
  const Vec3& a = mesh.vertices[triangle[0]];
  const Vec3 p = mesh.vertices[triangle[1]] - a, q = mesh.vertices[triangle[2]] - a;
  const double area = p.x * q.y - q.x * p.y;  // positive: counter-clockwise
  if (!(area > 0)) return {};                 // of another maker
  const Scale scale = scale_of(rect, mesh, triangle);
  return {std::abs(p.z * q.y - q.z * p.y) / area / scale.u,
          std::abs(q.z * p.x - p.z * q.x) / area / scale.v};
}

/// The steepest triangles, and the lowest and highest vertices of triangles, in and around every
/// place of a tile.
class Relief {
 public:
  explicit Relief(const TileModel& tile)
      : rect_(tiling::rect(tile.id)), cells_(std::size_t(kCells) * kCells) {
    for (const Triangle& triangle : tile.mesh.triangles) {
      const Vec2 slope = slope_of(rect_, tile.mesh, triangle);
      each_cell(tile.mesh, triangle, 0, 0, [&](Cell& cell) {
        cell.slope = {std::max(cell.slope.x, slope.x), std::max(cell.slope.y, slope.y)};
        for (const std::uint32_t i : triangle) {
          cell.low = std::min(cell.low, tile.mesh.vertices[i].z);
          cell.high = std::max(cell.high, tile.mesh.vertices[i].z);
        }
      });
    }
  }

  /// How much the height changes from a place of the triangle to one so far east or west of it, and
  /// so far north or south, metres.
  double change(const Tin& mesh, const Triangle& triangle, double east, double north) {
    const Scale scale = scale_of(rect_, mesh, triangle);
    Cell all;
    each_cell(mesh, triangle, east / scale.u, north / scale.v, [&](const Cell& cell) {
      all.slope = {std::max(all.slope.x, cell.slope.x), std::max(all.slope.y, cell.slope.y)};
      all.low = std::min(all.low, cell.low), all.high = std::max(all.high, cell.high);
    });
    return std::min(all.slope.x * east + all.slope.y * north, all.high - all.low);
  }

 private:
  static constexpr int kCells = 64;  // a side
  struct Cell {
    Vec2 slope;
    double low = HUGE_VAL, high = -HUGE_VAL;
  };
  GeoRect rect_;
  std::vector<Cell> cells_;

  /// Those that the triangle's box, widened by so many units, touches.
  template <class Do>
  void each_cell(const Tin& mesh, const Triangle& triangle, double u, double v, const Do& look) {
    double west = HUGE_VAL, east = -HUGE_VAL, south = HUGE_VAL, north = -HUGE_VAL;
    for (const std::uint32_t i : triangle) {
      const Vec3& p = mesh.vertices[i];
      west = std::min(west, p.x), east = std::max(east, p.x);
      south = std::min(south, p.y), north = std::max(north, p.y);
    }
    const auto cell = [](double x) {
      return int(std::clamp(x / kTileExtent * kCells, 0.0, kCells - 1.0));
    };
    for (int row = cell(south - v); row <= cell(north + v); ++row)
      for (int col = cell(west - u); col <= cell(east + u); ++col)
        look(cells_[std::size_t(row) * kCells + std::size_t(col)]);
  }
};

/// A range of places, in radians and metres.
struct Extent {
  double lon = 0, lat = 0, height = 0;     // how wide
  double sine = 0, cosine = 0, sines = 0;  // the largest of latitude's; of their product
  double radius = 0;                       // of the earth, with the heights

  /// REQUIRES: at least one of `vertices`.
  template <class Vertices>
  Extent(const GeoRect& rect, const Tin& mesh, const Vertices& vertices) {
    double west = HUGE_VAL, east = -HUGE_VAL, south = HUGE_VAL, north = -HUGE_VAL;
    double low = HUGE_VAL, high = -HUGE_VAL;
    for (const std::uint32_t i : vertices) {
      const Geographic p = place_of(rect, mesh.vertices[i]);
      west = std::min(west, p.lon), east = std::max(east, p.lon);
      south = std::min(south, p.lat), north = std::max(north, p.lat);
      low = std::min(low, mesh.vertices[i].z), high = std::max(high, mesh.vertices[i].z);
    }
    lon = (east - west) * kRadians, lat = (north - south) * kRadians, height = high - low;
    const double far = std::max(std::abs(south), std::abs(north)) * kRadians;
    const double near =
        south < 0 && north > 0 ? 0 : std::min(std::abs(south), std::abs(north)) * kRadians;
    sine = std::sin(far), cosine = std::cos(near);
    sines = near < std::numbers::pi / 4 && far > std::numbers::pi / 4
                ? 0.5
                : std::max(std::sin(2 * near), std::sin(2 * far)) / 2;
    radius = kLargestRadius_m + std::max(0.0, high);
  }

  static constexpr double kLargestRadius_m = 6.4e6;  // of curvature, at the poles
};

/// From the straight surface over a triangle, or line, to that of the certificate.
struct Bend {
  double up_m = 0, east_m = 0, north_m = 0;
};

Bend bend_of(const Extent& e) {
  constexpr double kFlattening = 0.011;  // how a meridian's radius changes along it, at most
  const double down = e.radius * (e.cosine * e.cosine * e.lon * e.lon + e.lat * e.lat);
  const double north =
      e.radius * (e.sines * e.lon * e.lon + kFlattening * e.lat * e.lat) + 2 * e.height * e.lat;
  const double east = 2 * e.lon * (e.radius * e.sine * e.lat + e.height * e.cosine);
  const double turn = std::min(1.0, e.lon + e.lat);  // of what is up, on the way
  return {(down + turn * (north + east)) / 8, (east + turn * down) / 8, (north + turn * down) / 8};
}

/// Vertices on a side, from its south or its west on.
std::vector<std::uint32_t> side_of(const Tin& mesh, TileSide side) {
  const bool upright = side == TileSide::west || side == TileSide::east;
  const double at = side == TileSide::east || side == TileSide::north ? kTileExtent : 0;
  std::vector<std::uint32_t> line;
  for (std::uint32_t i = 0; i < mesh.vertices.size(); ++i)
    if ((upright ? mesh.vertices[i].x : mesh.vertices[i].y) == at) line.push_back(i);
  std::ranges::sort(
      line, {}, [&](std::uint32_t i) { return upright ? mesh.vertices[i].y : mesh.vertices[i].x; });
  return line;
}

constexpr std::array kSides = {TileSide::west, TileSide::south, TileSide::east, TileSide::north};

/// Over its own line, vertically, with vertices that are `moved` away: what lies aside of a tile's
/// edge is no step between two tiles.
double border_error(const GeoRect& rect, const Tin& mesh, double moved) {
  double most = moved;
  for (const TileSide side : kSides) {
    const bool upright = side == TileSide::west || side == TileSide::east;
    const auto line = side_of(mesh, side);
    for (std::size_t i = 1; i < line.size(); ++i) {
      const Extent e(rect, mesh, std::array{line[i - 1], line[i]});
      const Bend bend = bend_of(e);
      const double length = e.radius * (upright ? e.lat : e.lon * e.cosine);
      const double along = (upright ? bend.north_m : bend.east_m) + moved;
      const double change = length > 0 ? std::min(e.height, along * e.height / length) : 0;
      most = std::max(most, bend.up_m + moved + change);
    }
  }
  return most;
}

double on_lattice(double x, double step) { return std::round(x / step) * step; }

Vec3 on_lattice(const Vec3& p, double step) {
  return {on_lattice(p.x, step), on_lattice(p.y, step), on_lattice(p.z, step)};
}

/// Upwards to a micrometre, as the certificate's own figures are.
double round_up(double x) { return std::ceil(x * 1e6) / 1e6; }

std::string extras_of(const TileModel& tile, const SpaceError& space) {
  nlohmann::ordered_json extras;
  if (tile.certificate) {
    extras["max_error_m"] = round_up(tile.certificate->max_error_m + space.surface_m);
    extras["error_kind"] = "bound";
  }
  extras["rounding_m"] = round_up(space.moved_m);
  extras["tile"] = tile.id.text();
  return extras.dump();
}

std::array<float, 3> narrow(const Vec3& p) { return {float(p.x), float(p.y), float(p.z)}; }

/// As quantized-mesh sorts them: around the tile, clockwise. Nothing where a side has none, in
/// tiles of other makers.
std::optional<proto::Glb::Edges> edges_of(const Tin& mesh) {
  proto::Glb::Edges edges = {side_of(mesh, TileSide::west), side_of(mesh, TileSide::south),
                             side_of(mesh, TileSide::east), side_of(mesh, TileSide::north)};
  for (const auto* side : {&edges.left, &edges.bottom, &edges.right, &edges.top})
    if (side->size() < 2) return {};
  std::ranges::reverse(edges.bottom);
  std::ranges::reverse(edges.right);
  return edges;
}

/// A tile's vertices where a client draws them.
class Places {
 public:
  Places(const TileModel& tile, GlbCompression compression)
      : rect_(tiling::rect(tile.id)),
        step_(glb_lattice(tile.id.level, compression)),
        origin_(on_lattice(tile.volumes.center, step_)) {}

  const Vec3& origin() const { return origin_; }
  double step() const { return step_; }
  Vec3 exact(const Vec3& vertex) const { return wgs84::to_ecef(place_of(rect_, vertex), vertex.z); }
  /// From the origin.
  std::array<float, 3> drawn(const Vec3& vertex) const {
    return narrow(on_lattice(exact(vertex), step_) - origin_);
  }
  double moved_m(const Vec3& vertex) const {
    const auto [x, y, z] = drawn(vertex);
    return length(origin_ + Vec3{x, y, z} - exact(vertex));
  }

 private:
  GeoRect rect_;
  double step_;
  Vec3 origin_;
};

/// Counter-clockwise around the tile.
std::vector<std::uint32_t> around(const Tin& mesh, TileSide side) {
  auto line = side_of(mesh, side);
  if (side == TileSide::north || side == TileSide::west) std::ranges::reverse(line);
  return line;
}

/// Walls below the border, seen from outside; lit as the surface above them is, so that they do not
/// show.
proto::GlbPart walls(const TileModel& tile, const Places& places, double depth,
                     const proto::Glb& surface) {
  proto::GlbPart part;
  for (const TileSide side : kSides) {
    const auto line = around(tile.mesh, side);
    for (std::size_t k = 0; k < line.size(); ++k) {
      const std::uint32_t at = std::uint32_t(part.positions.size());
      Vec3 foot = tile.mesh.vertices[line[k]];
      foot.z -= depth;
      part.positions.push_back(surface.positions[line[k]]);
      part.positions.push_back(places.drawn(foot));
      if (!surface.normals.empty())
        part.normals.insert(part.normals.end(), 2, surface.normals[line[k]]);
      if (!surface.texcoords.empty())
        part.texcoords.insert(part.texcoords.end(), 2, surface.texcoords[line[k]]);
      if (!surface.colours.empty())
        part.colours.insert(part.colours.end(), 2, surface.colours[line[k]]);
      if (k == 0) continue;
      part.triangles.push_back({at - 2, at - 1, at + 1});
      part.triangles.push_back({at - 2, at + 1, at});
    }
  }
  part.extras = nlohmann::ordered_json{{"skirt", true}, {"depth_m", depth}}.dump();
  return part;
}

/// Gives each vertex the class of the triangles around it, and there another one for each further
/// class; those that were there keep their numbers.
template <class Part>
void set_covers(Part& part, const std::vector<std::uint16_t>& of_triangles) {
  const std::size_t before = part.positions.size();
  std::vector<bool> taken(before);
  std::map<std::pair<std::uint32_t, std::uint16_t>, std::uint32_t> others;
  part.covers.assign(before, proto::kNoGlbClass);
  const auto again = [](auto& values, std::uint32_t i) {
    if (values.empty()) return;
    const auto value = values[i];
    values.push_back(value);
  };
  for (std::size_t t = 0; t < part.triangles.size(); ++t)
    for (std::uint32_t& corner : part.triangles[t]) {
      if (!taken[corner]) part.covers[corner] = of_triangles[t];
      taken[corner] = true;
      if (part.covers[corner] == of_triangles[t]) continue;
      const auto [other, is_new] =
          others.try_emplace({corner, of_triangles[t]}, std::uint32_t(part.positions.size()));
      if (is_new) {
        again(part.positions, corner), again(part.normals, corner);
        again(part.texcoords, corner), again(part.colours, corner);
        part.covers.push_back(of_triangles[t]);
      }
      corner = other->second;
    }
}

/// Of the surface, and of walls that of the triangle that they hang from, two to a side.
void add_covers(proto::Glb& glb, const Tin& mesh, const GlbDrape& drape) {
  glb.classes = drape.classes;
  set_covers(glb, drape.covers);
  if (glb.parts.empty()) return;
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint16_t> on_side;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
    for (int k = 0; k < 3; ++k) {
      const Triangle& corners = mesh.triangles[t];
      on_side[{corners[std::size_t(k)], corners[std::size_t((k + 1) % 3)]}] = drape.covers[t];
    }
  std::vector<std::uint16_t> of_walls;
  for (const TileSide side : kSides) {
    const auto line = around(mesh, side);
    for (std::size_t k = 1; k < line.size(); ++k) {
      const auto found = on_side.find({line[k - 1], line[k]});
      of_walls.insert(of_walls.end(), 2,
                      found == on_side.end() ? proto::kNoGlbClass : found->second);
    }
  }
  set_covers(glb.parts.back(), of_walls);
}

using Positions = std::vector<std::array<float, 3>>;

/// The least and the most of each coordinate.
std::pair<std::array<float, 3>, std::array<float, 3>> box_of(const proto::Glb& glb) {
  std::array<float, 3> low = glb.positions.front(), high = low;
  const auto widen = [&](const Positions& positions) {
    for (const auto& p : positions)
      for (std::size_t k = 0; k < 3; ++k)
        low[k] = std::min(low[k], p[k]), high[k] = std::max(high[k], p[k]);
  };
  widen(glb.positions);
  for (const proto::GlbPart& part : glb.parts) widen(part.positions);
  return {low, high};
}

/// Positions become steps of the lattice from the lowest corner on, which 16 bits hold; the same
/// places, exactly. Left as it is where there are more.
void compress(proto::Glb& glb, double step) {
  constexpr double kMostSteps = 65535;
  const auto [low, high] = box_of(glb);
  for (std::size_t k = 0; k < 3; ++k)
    if (double(high[k]) - double(low[k]) > kMostSteps * step) return;
  const auto count = [&, low = low](Positions& positions) {
    for (auto& p : positions)
      for (std::size_t k = 0; k < 3; ++k) p[k] = float((double(p[k]) - double(low[k])) / step);
  };
  count(glb.positions);
  for (proto::GlbPart& part : glb.parts) count(part.positions);
  for (std::size_t k = 0; k < 3; ++k) glb.origin[k] += double(low[k]), glb.axes[k][k] = step;
  glb.meshopt = true;
}

/// One pixel, or one a cell.
std::string png_of(const std::vector<std::uint8_t>& mask) {
  const int side = int(std::lround(std::sqrt(double(mask.size()))));
  return proto::encode_png(side, side, 1, mask);
}

}  // namespace

double glb_lattice(int level, GlbCompression compression) {
  if (compression == GlbCompression::meshopt)
    return std::max(std::ldexp(kCoarsestPacked, -level), std::ldexp(1, -kFinestLattice));
  return 1.0 / double(1u << std::min(level, kFinestLattice));
}

SpaceError space_error(const TileModel& tile, GlbCompression compression) {
  const GeoRect rect = tiling::rect(tile.id);
  const Places places(tile, compression);
  SpaceError error;
  for (const Vec3& v : tile.mesh.vertices)
    error.moved_m = std::max(error.moved_m, places.moved_m(v));
  Relief relief(tile);
  for (const Triangle& triangle : tile.mesh.triangles) {
    const Bend bend = bend_of(Extent(rect, tile.mesh, triangle));
    const double up = bend.up_m + error.moved_m, east = bend.east_m + error.moved_m,
                 north = bend.north_m + error.moved_m;
    error.shift_m = std::max(error.shift_m, std::hypot(up, east, north));
    error.surface_m =
        std::max(error.surface_m, up + relief.change(tile.mesh, triangle, east, north));
  }
  error.edge_m = border_error(rect, tile.mesh, error.moved_m);
  return error;
}

std::vector<std::uint8_t> encode_glb(const TileModel& tile, const GlbTileOptions& options) {
  const Places places(tile, options.compression);
  proto::Glb glb;
  glb.origin = {places.origin().x, places.origin().y, places.origin().z};
  glb.positions.reserve(tile.mesh.vertices.size());
  for (const Vec3& v : tile.mesh.vertices) glb.positions.push_back(places.drawn(v));
  for (const auto& oct : tile.normals) glb.normals.push_back(narrow(oct_decode(oct)));
  glb.triangles.assign(tile.mesh.triangles.begin(), tile.mesh.triangles.end());
  glb.extras = extras_of(tile, space_error(tile, options.compression));
  glb.matt = options.matt;
  glb.colours = options.drape.colours;
  if (options.edges) glb.edges = edges_of(tile.mesh);
  if (options.water && !tile.water_mask.empty()) {
    glb.water_mask_png = png_of(tile.water_mask);
    for (const Vec3& v : tile.mesh.vertices)
      glb.texcoords.push_back({float(v.x / kTileExtent), float(1 - v.y / kTileExtent)});
  }
  if (options.skirt_m > 0) glb.parts.push_back(walls(tile, places, options.skirt_m, glb));
  if (!glb.parts.empty() && glb.parts.back().triangles.empty()) glb.parts.clear();
  if (!options.drape.classes.empty()) add_covers(glb, tile.mesh, options.drape);
  if (options.compression == GlbCompression::meshopt) compress(glb, places.step());
  return proto::encode(glb);
}

std::vector<std::uint8_t> encode_glb(const TileModel& tile) { return encode_glb(tile, {}); }

}  // namespace tind
