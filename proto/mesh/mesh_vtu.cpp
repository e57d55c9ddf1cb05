// VTK's XML for unstructured grids: each array in base64 behind its length (UInt64). Text would be
// longer, and raw bytes behind the XML are read by fewer programs.

#include <span>

#include "proto/base64.h"
#include "proto/mesh/mesh_io.h"
#include "proto/text_put.h"
#include "terrain/base/bytes.h"

namespace tind::proto {
namespace {

/// `rows`: a range of arrays or of numbers.
template <class Rows>
void put_array(std::string& out, const char* type, const char* name, int components,
               const Rows& rows) {
  std::string bytes(8, '\0');
  ByteWriter<std::string> numbers(bytes);
  for (const auto& row : rows) {
    if constexpr (requires { row.size(); })
      for (const auto x : row) numbers.put(x);
    else
      numbers.put(row);
  }
  store(std::uint64_t(bytes.size() - 8), bytes.data());
  out += std::string("<DataArray type=\"") + type + "\" Name=\"" + name +
         "\" NumberOfComponents=\"" + std::to_string(components) + "\" format=\"binary\">";
  put_base64(out, bytes);
  out += "</DataArray>\n";
}

void put_attributes(std::string& out, const Mesh& m) {
  if (m.colours.empty() && m.normals.empty() && m.texcoords.empty()) return;
  out += "<PointData>\n";
  if (!m.colours.empty()) put_array(out, "Float32", "colour", 3, m.colours);
  if (!m.normals.empty()) put_array(out, "Float32", "normal", 3, m.normals);
  if (!m.texcoords.empty()) put_array(out, "Float32", "texcoord", 2, m.texcoords);
  out += "</PointData>\n";
}

void put_cells(std::string& out, const Mesh& m) {
  constexpr std::uint8_t kTriangle = 5;
  std::vector<std::array<std::int64_t, 3>> corners;
  std::vector<std::int64_t> ends;
  corners.reserve(m.triangles.size());
  ends.reserve(m.triangles.size());
  for (const auto& [a, b, c] : m.triangles) {
    corners.push_back({a, b, c});
    ends.push_back(3 * std::int64_t(corners.size()));
  }
  out += "<Cells>\n";
  put_array(out, "Int64", "connectivity", 1, corners);
  put_array(out, "Int64", "offsets", 1, ends);
  put_array(out, "UInt8", "types", 1, std::vector<std::uint8_t>(m.triangles.size(), kTriangle));
  out += "</Cells>\n";
}

/// Two hyphens would end a comment.
std::string comment(std::string_view line) {
  std::string out = text::xml_text(line);
  for (std::size_t at; (at = out.find("--")) != out.npos;) out.replace(at, 2, "- -");
  return "<!-- " + out + " -->\n";
}

}  // namespace

std::string encode_vtu(const Mesh& m) {
  std::string out = "<?xml version=\"1.0\"?>\n";
  for (const std::string& line : place_lines(m.place)) out += comment(line);
  out +=
      "<VTKFile type=\"UnstructuredGrid\" version=\"1.0\" byte_order=\"LittleEndian\" "
      "header_type=\"UInt64\">\n<UnstructuredGrid>\n<Piece NumberOfPoints=\"" +
      std::to_string(m.positions.size()) + "\" NumberOfCells=\"" +
      std::to_string(m.triangles.size()) + "\">\n";
  put_attributes(out, m);
  out += "<Points>\n";
  put_array(out, "Float64", "Points", 3, m.positions);
  out += "</Points>\n";
  put_cells(out, m);
  out += "</Piece>\n</UnstructuredGrid>\n</VTKFile>\n";
  return out;
}

}  // namespace tind::proto
