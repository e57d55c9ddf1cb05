#include "server/cli/options/mesh_input.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string_view>
#include <utility>

#include "proto/mesh/mesh_io.h"
#include "server/cli/program/exit.h"
#include "terrain/base/file_io.h"
#include "terrain/base/short_text.h"
#include "terrain/geo/ellipsoid.h"
#include "terrain/mesh/manifold.h"
#include "terrain/mesh/mesh_file.h"
#include "terrain/mesh/mesh_frame.h"
#include "terrain/mesh/terrain_tin.h"

namespace tind::cli {

namespace {

/// Beyond, squares of lengths lose their digits, and nothing on Earth is there.
constexpr double kFarthest = 1e12;

}  // namespace

bool is_mesh(const std::string& path) { return format_to_read(path) != nullptr; }

std::string mesh_refused(const std::string& path) {
  return path +
         ": is a mesh, and a raster is needed here; meshes are taken by simplify, measure, compare "
         "and progressive, and with --posts by the analyses (profile, volume, slope ...)";
}

Error not_a_dem(const Error& why, const std::vector<std::string>& files) {
  if (why.code != Errc::bad_data || files.size() != 1) return why;
  if (is_mesh(files[0])) return {Errc::unsupported, mesh_refused(files[0])};
  const MeshFormat* const format = format_only_written(files[0]);
  if (!format) return why;
  return {Errc::unsupported, files[0] + ": tind writes meshes like this (" + format->title +
                                 "), but reads neither them nor rasters; a raster becomes a "
                                 "GeoTIFF with gdal_translate, meshes are read of " +
                                 readable_extensions()};
}

namespace {

/// A file may say the normals of some corners only; those of the others are what the shape has.
void fill_normals(Tin& tin) {
  const auto none = [](const std::array<float, 3>& n) { return n == std::array<float, 3>{}; };
  if (std::ranges::none_of(tin.normals, none)) return;
  const auto own = vertex_normals(tin);
  for (std::size_t i = 0; i < tin.normals.size(); ++i)
    if (none(tin.normals[i])) tin.normals[i] = none(own[i]) ? std::array{0.f, 0.f, 1.f} : own[i];
}

std::string short_name(const std::string& name) {
  constexpr std::size_t kMost = 60;
  if (name.empty()) return "unnamed";
  return std::string(short_text(name, kMost)) + (name.size() > kMost ? "..." : "");
}

/// One after the other they may be a site; one over the other, a volume counts both.
void warn_of_surfaces(const std::string& path, const std::vector<std::string>& names) {
  constexpr std::size_t kShown = 4;
  if (names.size() < 2) return;
  std::string shown;
  for (std::size_t i = 0; i < std::min(names.size(), kShown); ++i)
    shown += (i > 0 ? ", " : "") + short_name(names[i]);
  if (names.size() > kShown) shown += fmt::format(" and {} more", names.size() - kShown);
  warn(
      fmt::format("{}: its {} surfaces ({}) are taken together, as one mesh; if they are not parts "
                  "of one ground, split the file: one surface each",
                  path, names.size(), shown));
}

}  // namespace

Result<void> check_unit(const std::string& path, const proto::MeshPlace& place,
                        const std::string& crs_name, double crs_unit_m) {
  constexpr double kSame = 1e-5;  // the two feet are written for each other
  const double said_m = place.said_unit_m;
  // What is local to a point of its CRS is in metres, whatever that counts in.
  const bool moved = place.local && (place.epsg > 0 || !place.crs_wkt.empty());
  if (moved || !(said_m > 0) || std::abs(crs_unit_m - said_m) < kSame * said_m) return {};
  return fail(Errc::invalid_argument,
              fmt::format("{}: its x and y are in units of {:.6g} m, and {} counts in units of "
                          "{:.6g} m: say the CRS that they are in (--crs, where a command takes "
                          "it), or correct in the file what is wrong",
                          path, said_m, crs_name, crs_unit_m));
}

Result<PlacedTin> read_placed_tin(const std::string& path, const std::string& crs) {
  auto file = read_mesh(path);
  if (!file) return std::unexpected(file.error());
  auto place = looked_up(std::move(file->place));
  if (!place) return fail(path, place.error());
  // (LandXML must name a length, also beside degrees.)
  if (crs.empty() && !place->geographic)
    if (auto ok = check_unit(path, *place, place->crs_name, place->unit_m); !ok)
      return std::unexpected(ok.error());
  warn_of_surfaces(path, file->surfaces);
  std::string texture = std::move(file->texture);
  const std::size_t materials = file->materials.size();
  Tin tin = from_file_mesh(std::move(*file));
  for (std::size_t i = 0; i < tin.vertices.size(); ++i) {
    const Vec3& v = tin.vertices[i];
    if (!(std::abs(v.x) <= kFarthest && std::abs(v.y) <= kFarthest && std::abs(v.z) <= kFarthest))
      return fail(Errc::bad_data,
                  path + ": vertex " + std::to_string(i) + " lies nowhere: coordinates go to 1e12");
  }
  if (tin.vertices.empty()) return fail(Errc::bad_data, path + ": there is no vertex in it");
  fill_normals(tin);
  return PlacedTin{std::move(tin), std::move(*place), std::move(texture), materials};
}

Result<void> check_surface(const std::string& path, const proto::MeshPlace& place) {
  if (!place.geographic || place.local) return {};
  return fail(Errc::unsupported,
              path +
                  ": its x and y are degrees and its z is a length: no surface in space can be "
                  "measured so; make it with --frame metric (simplify, refine), or of a DEM that "
                  "gdalwarp brought to metres");
}

Result<Tin> read_surface(const std::string& path) {
  auto read = read_placed_tin(path);
  if (!read) return std::unexpected(read.error());
  if (const auto ok = check_surface(path, read->place); !ok) return std::unexpected(ok.error());
  return std::move(read->tin);
}

Result<PlacedTerrain> read_terrain_tin(const std::string& path, const std::string& crs) {
  auto read = read_placed_tin(path, crs);
  if (!read) return std::unexpected(read.error());
  const bool attributed = has_attributes(read->tin);
  auto tin = as_terrain(std::move(read->tin));
  if (!tin) return fail(path, tin.error());
  PlacedTerrain placed{{std::move(*tin)}, std::move(read->place), attributed};
  TerrainTin& terrain = placed.terrain;
  const proto::MeshPlace& place = placed.place;
  terrain.z_unit_m = place.z_unit_m;
  if (!place.local) terrain.x_unit_m = terrain.y_unit_m = place.unit_m;
  if (place.geographic && !place.local) {
    const auto [low, high] = std::ranges::minmax(terrain.tin.vertices, {}, &Vec3::y);
    const Vec2 degree = wgs84::metres_per_degree(std::clamp((low.y + high.y) / 2, -89.0, 89.0));
    terrain.x_unit_m = degree.x, terrain.y_unit_m = degree.y;
  }
  return placed;
}

Result<Tin> read_shape(const std::string& path) {
  auto tin = read_surface(path);
  if (!tin) return tin;
  drop_attributes(*tin);
  weld(*tin);
  drop_unused_vertices(*tin);
  return tin;
}

Result<std::size_t> write_stream(const std::string& path, const Result<proto::MeshStream>& stream) {
  if (!stream) return std::unexpected(stream.error());
  const auto bytes = proto::encode(*stream);
  if (!bytes) return fail(Errc::internal, bytes.error().what);
  const std::string_view text(reinterpret_cast<const char*>(bytes->data()), bytes->size());
  if (const auto ok = write_whole_file(path, text); !ok) return std::unexpected(ok.error());
  return bytes->size();
}

}  // namespace tind::cli
