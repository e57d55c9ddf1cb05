#include "terrain/raster/gdal/heights/unread_sidecar.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <optional>
#include <string_view>
#include <utility>

namespace tind::gdal {
namespace {

constexpr std::size_t kMostRead = 1 << 16;

/// The text of the first element of that name, without blanks around it.
std::string_view text_in(std::string_view xml, const std::string& element) {
  const std::size_t open = xml.find("<" + element);
  if (open == xml.npos) return {};
  const std::size_t begin = xml.find('>', open), end = xml.find("</" + element, open);
  if (begin == xml.npos || end == xml.npos || end < begin) return {};
  std::string_view text = xml.substr(begin + 1, end - begin - 1);
  const auto blank = [](char c) { return c == ' ' || c == '\n' || c == '\r' || c == '\t'; };
  while (!text.empty() && blank(text.front())) text.remove_prefix(1);
  while (!text.empty() && blank(text.back())) text.remove_suffix(1);
  return text;
}

std::optional<double> number(std::string_view text) {
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size()) return {};
  return value;
}

/// The name in a system's WKT, PROJCRS["name",...
std::string_view name_in(std::string_view wkt) {
  const std::size_t open = wkt.find('"');
  if (open == wkt.npos) return {};
  const std::string_view rest = wkt.substr(open + 1);
  return rest.substr(0, rest.find('"'));
}

bool same(double a, double b) { return a == b || (std::isnan(a) && std::isnan(b)); }

}  // namespace

std::string unread_sidecar(const std::string& path, const RasterContent& read, bool has_crs) {
  std::ifstream file(path + ".aux.xml", std::ios::binary);
  if (!file) return {};
  std::string xml(kMostRead, '\0');
  file.read(xml.data(), std::streamsize(xml.size()));
  xml.resize(std::size_t(file.gcount()));
  std::string said;
  const auto say = [&](const char* what, std::string_view text) {
    said += (said.empty() ? " says " : ", ") + std::string(what) + " " +
            std::string(text.substr(0, 40));
  };
  const std::string_view crs = name_in(text_in(xml, "SRS"));
  if (!has_crs && !crs.empty()) say("CRS", crs);
  const std::string_view unit = text_in(xml, "UnitType");
  const bool metres = unit.empty() || unit == "m" || unit == "metre" || unit == "meter";
  if (!metres && read.unit_m == 1) say("unit", unit);
  const std::string_view scale = text_in(xml, "Scale"), offset = text_in(xml, "Offset");
  if (const auto value = number(scale); value && !same(*value, read.scale)) say("scale", scale);
  if (const auto value = number(offset); value && !same(*value, read.offset)) say("offset", offset);
  const std::string_view nodata = text_in(xml, "NoDataValue");
  const auto value = number(nodata);
  if (value && std::ranges::none_of(read.nodata, [&](double v) { return same(v, *value); }))
    say("nodata", nodata);
  return said.empty() ? said : path + ".aux.xml" + said;
}

std::string prj_without_crs(const std::string& path) {
  for (const char* end : {".prj", ".PRJ"}) {
    const std::filesystem::path prj = std::filesystem::path(path).replace_extension(end);
    std::error_code error;
    if (std::filesystem::is_regular_file(prj, error)) return prj.string();
  }
  return {};
}

}  // namespace tind::gdal
