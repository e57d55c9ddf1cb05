#include "terrain/mesh/mesh_frame.h"

#include <string>
#include <utility>

#include "terrain/raster/crs_code.h"

namespace tind {

namespace {

bool turns_over(const Affine& a) {  // (col, -row) to (x, y)
  return a.x_row * a.y_col - a.x_col * a.y_row < 0;
}

void turn_triangles(Tin& tin) {
  for (Triangle& t : tin.triangles) std::swap(t[1], t[2]);
}

}  // namespace

Tin MeshMap::from_posts(Tin tin) const {
  for (Vec3& v : tin.vertices) {
    const Vec2 p = xy.apply(v.x, -v.y);
    v = {p.x, p.y, z_per_metre == 1 ? v.z : v.z * z_per_metre};
  }
  if (turns_over(xy)) turn_triangles(tin);
  return tin;
}

Tin MeshMap::to_posts(Tin tin) const {
  for (Vec3& v : tin.vertices) {
    const Vec2 p = xy.invert(v.x, v.y);
    v = {p.x, -p.y, z_per_metre == 1 ? v.z : v.z / z_per_metre};
  }
  if (turns_over(xy)) turn_triangles(tin);
  return tin;
}

MeshMap mesh_map(const DemInfo& info, MeshFrame frame, bool source_units) {
  MeshMap map{info.post_to_crs, source_units ? 1 / info.z_unit_m : 1};
  if (frame == MeshFrame::metric) map.xy = {0, info.spacing_x_m, 0, 0, 0, -info.spacing_y_m};
  return map;
}

Result<proto::MeshPlace> mesh_place(const DemInfo& info, MeshFrame frame, bool source_units) {
  proto::MeshPlace place;
  const auto code = crs_code(info.crs_wkt);
  if (!code) return std::unexpected(code.error());
  place.epsg = code->epsg;
  place.geographic = code->geographic;
  place.unit_m = info.crs_wkt.empty() ? info.crs_unit_m : code->unit_m;
  place.crs_wkt = info.crs_wkt;
  place.crs_name = info.crs_name;
  place.vertical_datum = name(info.datum);
  place.z_unit_m = source_units ? info.z_unit_m : 1;
  const Affine xy = mesh_map(info, frame, source_units).xy;
  place.lattice = {xy.x0, xy.x_col, xy.x_row, xy.y0, xy.y_col, xy.y_row};
  if (frame != MeshFrame::metric) return place;
  const Affine& crs = info.post_to_crs;
  place.local = true;
  place.origin = {crs.x0, crs.y0};
  place.to_crs = {crs.x_col / info.spacing_x_m, -crs.x_row / info.spacing_y_m,
                  crs.y_col / info.spacing_x_m, -crs.y_row / info.spacing_y_m};
  return place;
}

Result<proto::MeshPlace> looked_up(proto::MeshPlace said) {
  const auto code = crs_code(said.epsg > 0 ? "EPSG:" + std::to_string(said.epsg) : said.crs_wkt);
  if (!code) return std::unexpected(code.error());
  if (code->name.empty()) return said;
  said.geographic = code->geographic;
  if (!code->geographic) said.unit_m = code->unit_m;
  if (said.epsg == 0) said.epsg = code->epsg;
  if (said.crs_name.empty()) said.crs_name = code->name;
  if (said.crs_wkt.empty()) said.crs_wkt = code->wkt;  // for formats that take no code
  return said;
}

Tin in_crs(Tin tin, const proto::MeshPlace& place) {
  const auto& [x0, y0] = place.origin;
  const auto& m = place.to_crs;
  for (Vec3& v : tin.vertices)
    v = {x0 + m[0] * v.x + m[1] * v.y, y0 + m[2] * v.x + m[3] * v.y, v.z};
  if (m[0] * m[3] - m[1] * m[2] < 0) turn_triangles(tin);
  return tin;
}

proto::Mesh to_file_mesh(Tin tin) {
  proto::Mesh mesh;
  mesh.positions.reserve(tin.vertices.size());
  for (const Vec3& v : tin.vertices) mesh.positions.push_back({v.x, v.y, v.z});
  mesh.triangles = std::move(tin.triangles);
  mesh.colours = std::move(tin.colours);
  mesh.normals = std::move(tin.normals);
  mesh.texcoords = std::move(tin.texcoords);
  return mesh;
}

Tin from_file_mesh(proto::Mesh mesh) {
  Tin tin;
  tin.vertices.reserve(mesh.positions.size());
  for (const auto& p : mesh.positions) tin.vertices.push_back({p[0], p[1], p[2]});
  tin.triangles = std::move(mesh.triangles);
  tin.colours = std::move(mesh.colours);
  tin.normals = std::move(mesh.normals);
  tin.texcoords = std::move(mesh.texcoords);
  return tin;
}

}  // namespace tind
