// What a mesh file says about where it is, in lines of "key: value".

#include "proto/mesh/mesh_io.h"
#include "proto/text_put.h"
#include "proto/text_scan.h"

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

template <std::size_t N>
void read_numbers(std::string_view text, std::array<double, N>& values) {
  std::array<double, N> read{};
  for (double& v : read)
    if (!text::parse_finite(text::take_word(text), v)) return;
  if (text::trim(text).empty()) values = read;
}

/// The rest of a line that begins with `key`; empty where it does not.
std::string_view after(std::string_view line, std::string_view key) {
  return line.starts_with(key) ? text::trim(line.substr(key.size())) : std::string_view();
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

void read_place_line(std::string_view line, MeshPlace& p) {
  line = text::trim(line);
  const std::string_view origin_crs = after(line, "origin crs:");
  if (const auto crs = origin_crs.empty() ? after(line, "crs:") : origin_crs; !crs.empty()) {
    const std::string_view code = after(crs, "EPSG:");
    int epsg = 0;
    if (text::parse(code, epsg) && epsg > 0)
      p.epsg = epsg;
    else
      p.crs_wkt = crs;
  }
  if (const auto numbers = after(line, "metres to crs:"); !numbers.empty())
    read_numbers(numbers, p.to_crs);
  if (const auto numbers = after(line, "origin:"); !numbers.empty()) {
    p.local = true;
    read_numbers(numbers, p.origin);
  }
  if (const auto datum = after(line, "vertical datum:"); !datum.empty()) p.vertical_datum = datum;
  if (const auto unit = after(line, "z unit in metres:"); !unit.empty()) {
    std::array<double, 1> metres{p.z_unit_m};
    read_numbers(unit, metres);
    if (metres[0] > 0) p.z_unit_m = metres[0];
  }
}

}  // namespace tind::proto
