#include "server/api/crs_name.h"

#include "terrain/raster/crs_points.h"

namespace tind::api {
namespace {

/// What follows "EPSG/" or "OGC/", its version dropped: "0/4326" is 4326.
std::string_view last_part(std::string_view text, char separator) {
  return text.substr(text.rfind(separator) + 1);
}

/// Of "EPSG/0/2056" or "OGC:1.3:CRS84"; empty: neither.
std::string of_authority(std::string_view text, char separator) {
  if (text.starts_with("EPSG") && text.substr(4).starts_with(separator))
    return "EPSG:" + std::string(last_part(text, separator));
  if (text.starts_with("OGC") && text.substr(3).starts_with(separator))
    return std::string(last_part(text, separator));
  return {};
}

}  // namespace

std::optional<std::string> crs_named(std::string_view text) {
  if (text.starts_with('[') && text.ends_with(']')) text = text.substr(1, text.size() - 2);
  std::string name(text);
  for (const std::string_view prefix :
       {"http://www.opengis.net/def/crs/", "https://www.opengis.net/def/crs/"})
    if (text.starts_with(prefix)) name = of_authority(text.substr(prefix.size()), '/');
  for (const std::string_view prefix : {"urn:ogc:def:crs:", "urn:x-ogc:def:crs:"})
    if (text.starts_with(prefix)) name = of_authority(text.substr(prefix.size()), ':');
  if (name == "CRS84" || name == "OGC:CRS84") return "CRS84";
  if (!is_epsg_code(name)) return {};
  return "EPSG:" + name.substr(5);
}

std::string crs_uri(const std::string& name) {
  const std::string base = "http://www.opengis.net/def/crs/";
  return name == "CRS84" ? base + "OGC/1.3/CRS84" : base + "EPSG/0/" + name.substr(5);
}

bool is_crs_name(std::string_view text) { return crs_named(text).has_value(); }

}  // namespace tind::api
