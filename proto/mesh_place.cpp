// What a mesh file says about where it is, in lines of "key: value".

#include "proto/mesh_io.h"
#include "proto/text_put.h"

namespace tind::proto {
namespace {

template <std::size_t N>
std::string numbers(const std::array<double, N>& values) {
  std::string out;
  for (const double v : values) {
    if (!out.empty()) out += ' ';
    text::put_text(out, v);
  }
  return out;
}

}  // namespace

std::vector<std::string> place_lines(const MeshPlace& p) {
  std::vector<std::string> lines;
  const std::string code = p.epsg > 0 ? "EPSG:" + std::to_string(p.epsg) : p.crs_wkt;
  if (!code.empty()) lines.push_back((p.local ? "origin crs: " : "crs: ") + code);
  if (p.local) {
    lines.push_back("origin: " + numbers(p.origin));
    lines.push_back("metres to crs: " + numbers(p.to_crs));
  }
  if (!p.vertical_datum.empty()) lines.push_back("vertical datum: " + p.vertical_datum);
  if (p.z_unit_m != 1) lines.push_back("z unit in metres: " + numbers(std::array{p.z_unit_m}));
  for (std::string& line : lines) line = text::one_line(line);
  return lines;
}

}  // namespace tind::proto
