// One row a format. What a row calls does not know the others.

#include "terrain/mesh/mesh_file.h"

#include <algorithm>
#include <filesystem>

#include "terrain/base/file_io.h"
#include "terrain/base/lower_extension.h"
#include "terrain/raster/vector_file.h"

namespace tind {
namespace {

using proto::Mesh;

Result<std::string> triangles(VectorFormat format, const Mesh& m) {
  std::string description;
  for (const std::string& line : proto::place_lines(m.place))
    description += (description.empty() ? "" : "; ") + line;
  return encode_triangles(format, {m.positions, m.triangles,
                                   m.place.local ? std::string() : m.place.crs_wkt, description});
}

Result<std::string> ply(const Mesh& m) { return proto::encode_ply(m); }
Result<std::string> obj(const Mesh& m) { return proto::encode_obj(m); }
Result<std::string> stl(const Mesh& m) { return proto::encode_stl(m).bytes; }
Result<std::string> two_dm(const Mesh& m) { return proto::encode_2dm(m); }
Result<std::string> vtu(const Mesh& m) { return proto::encode_vtu(m); }
Result<std::string> dxf(const Mesh& m) { return proto::encode_dxf(m); }
Result<std::string> gpkg(const Mesh& m) { return triangles(VectorFormat::geopackage, m); }
Result<std::string> fgb(const Mesh& m) { return triangles(VectorFormat::flatgeobuf, m); }

template <class Wanted>
const MeshFormat* by_extension(const std::string& path, Wanted wanted) {
  const std::string extension = lower_extension(path);
  for (const MeshFormat& f : mesh_formats())
    if (wanted(f) && std::ranges::find(f.extensions, extension) != f.extensions.end()) return &f;
  return nullptr;
}

bool writes(const MeshFormat& f) { return f.encode != nullptr; }
bool reads(const MeshFormat& f) { return f.decode != nullptr; }

/// "a, b or c".
std::string listed(const std::vector<std::string>& words, const char* last) {
  std::string all;
  for (std::size_t i = 0; i < words.size(); ++i)
    all += (i == 0 ? "" : i + 1 < words.size() ? ", " : last) + words[i];
  return all;
}

template <class Wanted>
std::string extensions_of(Wanted wanted) {
  std::vector<std::string> all;
  for (const MeshFormat& f : mesh_formats())
    if (wanted(f)) all.push_back(f.extensions.front());
  return listed(all, " or ");
}

}  // namespace

std::span<const MeshFormat> mesh_formats() {
  static const std::vector<MeshFormat> kAll = {
      {.name = "ply",
       .extensions = {".ply"},
       .title = "PLY, binary",
       .crs = "EPSG code, or WKT",
       .numbers = "double",
       .meant_for = "QGIS, MeshLab, Blender, CloudCompare",
       .colours = true,
       .normals = true,
       .texcoords = true,
       .encode = ply,
       .decode = proto::decode_ply},
      {.name = "obj",
       .extensions = {".obj"},
       .title = "Wavefront OBJ",
       .crs = "EPSG code, as a comment",
       .numbers = "double",
       .meant_for = "Blender, MeshLab, most 3D programs",
       .media_type = "model/obj",
       .colours = true,
       .normals = true,
       .texcoords = true,
       .encode = obj,
       .decode = proto::decode_obj,
       .one_unit = true},
      {.name = "stl",
       .extensions = {".stl"},
       .title = "STL, binary",
       .crs = "none",
       .numbers = "float32, from an origin in the header",
       .meant_for = "slicers for 3D printing",
       .media_type = "model/stl",
       .encode = stl,
       .decode = proto::decode_stl,
       .as_in_file = proto::as_in_stl,
       .origin = proto::stl_origin,
       .one_unit = true},
      {.name = "glb",
       .extensions = {".glb"},
       .title = "glTF 2.0, binary",
       .crs = "EPSG code and WKT, as extras of the node",
       .numbers = "float32 columns and rows, placed in double by the node",
       .meant_for = "Blender, three.js, engines",
       .media_type = "model/gltf-binary",
       .colours = true,
       .normals = true,
       .texcoords = true,
       .encode = proto::encode_glb,
       .as_in_file = proto::as_in_glb,
       .one_unit = true},
      {.name = "2dm",
       .extensions = {".2dm"},
       .title = "2DM of SMS",
       .crs = "EPSG code, as a comment",
       .numbers = "double",
       .meant_for = "QGIS, SMS, TUFLOW",
       .media_type = "text/plain",
       .encode = two_dm,
       .decode = proto::decode_2dm},
      {.name = "ugrid",
       .extensions = {".nc"},
       .title = "UGRID in NetCDF",
       .crs = "EPSG code and WKT",
       .numbers = "double",
       .meant_for = "QGIS, Delft3D, xarray",
       .media_type = "application/x-netcdf",
       .encode = proto::encode_ugrid},
      {.name = "vtu",
       .extensions = {".vtu"},
       .title = "VTK unstructured grid",
       .crs = "EPSG code, as a comment",
       .numbers = "double",
       .meant_for = "ParaView, meshio",
       .media_type = "application/xml",
       .colours = true,
       .normals = true,
       .texcoords = true,
       .encode = vtu,
       .one_unit = true},
      {.name = "gpkg",
       .extensions = {".gpkg"},
       .title = "GeoPackage of PolygonZ",
       .crs = "EPSG code and WKT",
       .numbers = "double",
       .meant_for = "QGIS, ArcGIS, GDAL",
       .media_type = "application/geopackage+sqlite3",
       .encode = gpkg},
      {.name = "fgb",
       .extensions = {".fgb"},
       .title = "FlatGeobuf of PolygonZ",
       .crs = "EPSG code and WKT",
       .numbers = "double",
       .meant_for = "QGIS, GDAL",
       .media_type = "application/flatgeobuf",
       .encode = fgb},
      {.name = "dxf",
       .extensions = {".dxf"},
       .title = "DXF R12 of 3DFACE",
       .crs = "EPSG code, as a comment",
       .numbers = "double",
       .meant_for = "AutoCAD, Civil 3D, QCAD, GDAL",
       .media_type = "image/vnd.dxf",
       .encode = dxf,
       .one_unit = true},
      {.name = "landxml",
       .extensions = {".xml", ".landxml"},
       .title = "LandXML 1.2 TIN surface",
       .crs = "EPSG code and WKT",
       .numbers = "double",
       .meant_for = "Civil 3D, 12d, machine control",
       .media_type = "application/xml",
       .can_say = proto::landxml_can_say,
       .encode = proto::encode_landxml,
       .decode = proto::decode_landxml},
  };
  return kAll;
}

std::string writable_extensions() { return extensions_of(writes); }
std::string readable_extensions() { return extensions_of(reads); }

Result<const MeshFormat*> format_to_write(const std::string& path, const std::string& name) {
  if (name.empty()) {
    if (const MeshFormat* const found = by_extension(path, writes)) return found;
    return fail(Errc::invalid_argument, "cannot tell the format of " + path + ": name it " +
                                            writable_extensions() + ", or give --format");
  }
  std::vector<std::string> names;
  for (const MeshFormat& f : mesh_formats()) {
    if (writes(f) && f.name == name) return &f;
    if (writes(f)) names.push_back(f.name);
  }
  return fail(Errc::invalid_argument,
              "there is no mesh format '" + name + "': choose " + listed(names, " or "));
}

const MeshFormat* format_only_written(const std::string& path) {
  return by_extension(path, [](const MeshFormat& f) { return writes(f) && !reads(f); });
}

const MeshFormat* format_to_read(const std::string& path) { return by_extension(path, reads); }

Result<void> can_say(const MeshFormat& format, const proto::MeshPlace& place) {
  if (format.can_say) return format.can_say(place);
  return {};
}

std::string attributes_of(const MeshFormat& f) {
  std::vector<std::string> all;
  if (f.colours) all.push_back("colours");
  if (f.normals) all.push_back("normals");
  if (f.texcoords) all.push_back("texture coordinates");
  return all.empty() ? "none" : listed(all, ", ");
}

std::string lost_attributes(const MeshFormat& f, const Mesh& m) {
  std::vector<std::string> lost;
  if (!f.colours && !m.colours.empty()) lost.push_back("colours");
  if (!f.normals && !m.normals.empty()) lost.push_back("normals");
  if (!f.texcoords && !m.texcoords.empty()) lost.push_back("texture coordinates");
  return listed(lost, " and ");
}

std::optional<std::array<double, 3>> file_origin(const MeshFormat& format, const Mesh& m) {
  if (!format.origin) return {};
  const auto origin = format.origin(m);
  if (origin == std::array<double, 3>{}) return {};
  return origin;
}

Result<void> write_mesh(const std::string& path, const MeshFormat& format, const Mesh& m) {
  if (format.encode == obj && !m.texture.empty()) {
    const auto library = std::filesystem::path(path).replace_extension(".mtl");
    if (auto done = write_whole_file(library.string(), proto::encode_mtl(m)); !done) return done;
    return write_whole_file(path, proto::encode_obj(m, library.filename().string()));
  }
  const auto bytes = format.encode(m);
  if (!bytes) return std::unexpected(bytes.error());
  return write_whole_file(path, *bytes);
}

Result<void> write_mesh(const std::string& path, const Mesh& m) {
  const auto format = format_to_write(path);
  if (!format) return std::unexpected(format.error());
  return write_mesh(path, **format, m);
}

std::vector<std::string> files_of_mesh(const std::string& path) {
  const MeshFormat* const format = format_to_read(path);
  const bool of_obj = format && format->decode == proto::decode_obj;
  if (!of_obj && !(format && format->decode == proto::decode_ply)) return {};
  const auto bytes = read_whole_file(path);
  if (!bytes) return {};
  if (of_obj) return proto::files_of_obj(path, *bytes);
  const std::string texture = proto::texture_of_ply(*bytes);
  if (texture.empty()) return {};
  return {(std::filesystem::path(path).parent_path() / texture).string()};
}

Result<Mesh> read_mesh(const std::string& path) {
  const MeshFormat* const format = format_to_read(path);
  if (!format)
    return fail(Errc::unsupported,
                "cannot read " + path + ": the extension must be " + readable_extensions());
  const auto bytes = read_whole_file(path);
  if (!bytes) return std::unexpected(bytes.error());
  auto mesh = format->decode(*bytes);
  if (!mesh) return fail(path, mesh.error());
  if (format->decode == proto::decode_obj) mesh->texture = proto::texture_of_obj(path, *mesh);
  return mesh;
}

}  // namespace tind
