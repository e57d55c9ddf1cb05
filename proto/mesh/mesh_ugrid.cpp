// UGRID in a NetCDF classic file. The classic format is a short public specification (NetCDF
// "CDF-2": big-endian, a header that lists dimensions, attributes and variables with their offsets,
// then the arrays): written here, it is the same bytes with any version of the library.

#include <functional>

#include "proto/mesh/mesh_io.h"
#include "proto/text_put.h"
#include "terrain/base/bytes.h"

namespace tind::proto {
namespace {

enum NcType : std::uint32_t { kChar = 2, kInt = 4, kDouble = 6 };
constexpr std::uint32_t kDimensions = 10, kVariables = 11, kAttributes = 12;

void put_int(std::string& out, std::uint32_t v) {
  out.resize(out.size() + 4);
  store<std::endian::big>(v, out.data() + out.size() - 4);
}
void put_long(std::string& out, std::uint64_t v) {
  out.resize(out.size() + 8);
  store<std::endian::big>(v, out.data() + out.size() - 8);
}
void put_double(std::string& out, double v) {
  out.resize(out.size() + 8);
  store<std::endian::big>(v, out.data() + out.size() - 8);
}
void pad(std::string& out) { out.resize((out.size() + 3) / 4 * 4); }
void put_name(std::string& out, std::string_view name) {
  put_int(out, std::uint32_t(name.size()));
  out += name;
  pad(out);
}
void put_list(std::string& out, std::uint32_t tag, std::size_t count) {
  put_int(out, count == 0 ? 0 : tag);
  put_int(out, std::uint32_t(count));
}

struct Attribute {
  const char* name;
  std::string text;
  int number = 0;  // where there is no text
};

struct Variable {
  const char* name;
  NcType type;
  std::vector<std::uint32_t> dimensions;
  std::vector<Attribute> attributes;
  std::uint64_t bytes;
  std::function<void(std::string&)> put;
};

void put_attributes(std::string& out, const std::vector<Attribute>& attributes) {
  put_list(out, kAttributes, attributes.size());
  for (const Attribute& a : attributes) {
    put_name(out, a.name);
    put_int(out, a.text.empty() ? kInt : kChar);
    put_int(out, a.text.empty() ? 1 : std::uint32_t(a.text.size()));
    if (a.text.empty())
      put_int(out, std::uint32_t(a.number));
    else
      out += a.text;
    pad(out);
  }
}

/// Everything before the arrays, the first of which begins at `begin`.
std::string header(const std::vector<std::pair<const char*, std::size_t>>& dimensions,
                   const std::vector<Attribute>& global, const std::vector<Variable>& variables,
                   std::uint64_t begin) {
  std::string out("CDF\2", 4);
  put_int(out, 0);  // no records
  put_list(out, kDimensions, dimensions.size());
  for (const auto& [name, size] : dimensions) {
    put_name(out, name);
    put_int(out, std::uint32_t(size));
  }
  put_attributes(out, global);
  put_list(out, kVariables, variables.size());
  for (const Variable& v : variables) {
    put_name(out, v.name);
    put_int(out, std::uint32_t(v.dimensions.size()));
    for (const std::uint32_t d : v.dimensions) put_int(out, d);
    put_attributes(out, v.attributes);
    put_int(out, v.type);
    put_int(out, std::uint32_t(v.bytes));
    put_long(out, begin);
    begin += v.bytes;
  }
  return out;
}

/// As UDUNITS has a unit of that length.
std::string metres(double unit_m) {
  if (unit_m == 1) return "m";
  std::string unit;
  text::put_text(unit, unit_m);
  return unit + " m";
}

bool has_crs(const MeshPlace& place) { return !place.local && !place.crs_wkt.empty(); }

std::vector<Attribute> coordinate(const MeshPlace& place, bool x) {
  std::vector<Attribute> a;
  if (place.geographic && !place.local) {
    a = {{"long_name", x ? "longitude of nodes" : "latitude of nodes"},
         {"standard_name", x ? "longitude" : "latitude"},
         {"units", x ? "degrees_east" : "degrees_north"}};
  } else {
    a = {{"long_name", x ? "x of nodes" : "y of nodes"},
         {"standard_name", x ? "projection_x_coordinate" : "projection_y_coordinate"},
         {"units", metres(place.local ? 1 : place.unit_m)}};
  }
  if (has_crs(place)) a.push_back({"grid_mapping", "crs"});  // for MDAL; CF has it on the data
  return a;
}

/// MDAL takes an altitude of the nodes for z, whatever that is above.
std::vector<Attribute> height(const MeshPlace& place) {
  std::vector<Attribute> a = {{"long_name", "height of nodes"},
                              {"standard_name", "altitude"},
                              {"units", metres(place.z_unit_m)},
                              {"positive", "up"},
                              {"mesh", "mesh2d"},
                              {"location", "node"},
                              {"coordinates", "mesh2d_node_x mesh2d_node_y"}};
  if (has_crs(place)) a.push_back({"grid_mapping", "crs"});
  if (!place.vertical_datum.empty()) a.push_back({"vertical_datum", place.vertical_datum});
  return a;
}

/// MDAL takes `wkt` before a code, and knows codes better.
std::vector<Attribute> reference(const MeshPlace& place) {
  std::vector<Attribute> a = {{"crs_wkt", place.crs_wkt}};
  if (place.geographic) a.push_back({"grid_mapping_name", "latitude_longitude"});
  if (place.epsg > 0) {
    a.push_back({"EPSG_code", "EPSG:" + std::to_string(place.epsg)});
    a.push_back({"epsg", "", place.epsg});
  } else {
    a.push_back({"wkt", place.crs_wkt});
  }
  return a;
}

Variable column(const Mesh& m, const char* name, std::vector<Attribute> attributes,
                std::size_t axis) {
  return {name,
          kDouble,
          {0},
          std::move(attributes),
          8 * m.positions.size(),
          [&m, axis](std::string& out) {
            for (const auto& p : m.positions) put_double(out, p[axis]);
          }};
}

Variable scalar(const char* name, std::vector<Attribute> attributes) {
  return {name, kInt, {}, std::move(attributes), 4, [](std::string& out) { put_int(out, 0); }};
}

std::vector<Variable> variables_of(const Mesh& m) {
  std::vector<Variable> v;
  v.push_back(scalar("mesh2d", {{"cf_role", "mesh_topology"},
                                {"long_name", "triangles of the terrain"},
                                {"topology_dimension", "", 2},
                                {"node_coordinates", "mesh2d_node_x mesh2d_node_y"},
                                {"face_node_connectivity", "mesh2d_face_nodes"},
                                {"face_dimension", "mesh2d_face"}}));
  v.push_back(column(m, "mesh2d_node_x", coordinate(m.place, true), 0));
  v.push_back(column(m, "mesh2d_node_y", coordinate(m.place, false), 1));
  v.push_back(column(m, "mesh2d_node_z", height(m.place), 2));
  v.push_back({"mesh2d_face_nodes",
               kInt,
               {1, 2},
               {{"cf_role", "face_node_connectivity"},
                {"long_name", "nodes of each triangle, counter-clockwise"},
                {"start_index", "", 0}},
               12 * m.triangles.size(),
               [&m](std::string& out) {
                 for (const auto& t : m.triangles)
                   for (const std::uint32_t index : t) put_int(out, index);
               }});
  if (has_crs(m.place)) v.push_back(scalar("crs", reference(m.place)));
  return v;
}

}  // namespace

Result<std::string> encode_ugrid(const Mesh& m) {
  constexpr std::size_t kMost = 357'000'000;  // arrays of less than 4 GB, indices below 2^31
  if (m.positions.size() > kMost || m.triangles.size() > kMost)
    return fail(Errc::out_of_range,
                "the mesh is too large for UGRID in a classic NetCDF file: "
                "at most 357 million triangles");
  if (m.triangles.empty())
    return fail(Errc::invalid_argument, "a mesh without triangles cannot be UGRID");
  std::vector<Attribute> global = {{"Conventions", "CF-1.8 UGRID-1.0"}, {"source", "tind"}};
  std::string place;
  for (const std::string& line : place_lines(m.place)) place += (place.empty() ? "" : "; ") + line;
  if (!place.empty()) global.push_back({"comment", place});
  const std::vector<Variable> variables = variables_of(m);
  const std::vector<std::pair<const char*, std::size_t>> dimensions = {
      {"mesh2d_node", m.positions.size()}, {"mesh2d_face", m.triangles.size()}, {"three", 3}};
  const std::size_t begin = header(dimensions, global, variables, 0).size();
  std::string out = header(dimensions, global, variables, begin);
  out.reserve(begin + 24 * m.positions.size() + 12 * m.triangles.size() + 8);
  for (const Variable& v : variables) v.put(out);
  return out;
}

}  // namespace tind::proto
