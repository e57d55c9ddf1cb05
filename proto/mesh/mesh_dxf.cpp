// DXF of release 12, the oldest that everything reads: pairs of lines, a group code and its value.

#include <algorithm>

#include "proto/mesh/mesh_io.h"
#include "proto/text_put.h"

namespace tind::proto {
namespace {

void put(std::string& out, int code, std::string_view value) {
  text::put_text(out, code);
  out += '\n';
  out += value;
  out += '\n';
}

void put(std::string& out, int code, double value) {
  text::put_text(out, code);
  text::put_text(out += '\n', value);
  out += '\n';
}

void put_extent(std::string& out, const char* name, const std::array<double, 3>& p) {
  put(out, 9, name);
  for (int i = 0; i < 3; ++i) put(out, 10 * (i + 1), p[std::size_t(i)]);
}

void put_header(std::string& out, const Mesh& m) {
  std::array<double, 3> low{}, high{};
  if (!m.positions.empty()) low = high = m.positions.front();
  for (const auto& p : m.positions)
    for (std::size_t i = 0; i < 3; ++i) {
      low[i] = std::min(low[i], p[i]);
      high[i] = std::max(high[i], p[i]);
    }
  put(out, 0, "SECTION");
  put(out, 2, "HEADER");
  put(out, 9, "$ACADVER");
  put(out, 1, "AC1009");
  put_extent(out, "$EXTMIN", low);
  put_extent(out, "$EXTMAX", high);
  put(out, 0, "ENDSEC");
}

}  // namespace

std::string encode_dxf(const Mesh& m) {
  std::string out;
  out.reserve(600 + m.triangles.size() * 260);
  put(out, 999, "tind");
  for (const std::string& line : place_lines(m.place)) put(out, 999, line);
  put_header(out, m);
  put(out, 0, "SECTION");
  put(out, 2, "ENTITIES");
  for (const auto& t : m.triangles) {
    put(out, 0, "3DFACE");
    put(out, 8, "TERRAIN");
    for (int corner = 0; corner < 4; ++corner) {  // a triangle's third corner is its fourth, too
      const auto& p = m.positions[t[std::size_t(std::min(corner, 2))]];
      for (int i = 0; i < 3; ++i) put(out, 10 * (i + 1) + corner, p[std::size_t(i)]);
    }
  }
  put(out, 0, "ENDSEC");
  put(out, 0, "EOF");
  return out;
}

}  // namespace tind::proto
