#include "server/cli/commands/info/info_vectors.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <nlohmann/json.hpp>

#include "server/log/printable.h"

namespace tind::cli {
namespace {

using Json = nlohmann::ordered_json;

std::string counted(std::size_t n, const char* one, const char* many) {
  return fmt::format("{} {}", n, n == 1 ? one : many);
}

/// "20 polygons, 3 lines"; what there is none of is left out.
std::string shapes_text(std::size_t polygons, std::size_t lines, std::size_t points) {
  std::vector<std::string> parts;
  if (polygons > 0) parts.push_back(counted(polygons, "polygon", "polygons"));
  if (lines > 0) parts.push_back(counted(lines, "line", "lines"));
  if (points > 0) parts.push_back(counted(points, "point", "points") + " (of no use here)");
  return parts.empty() ? "nothing" : fmt::format("{}", fmt::join(parts, ", "));
}

}  // namespace

Json vectors_json(const VectorFacts& facts) {
  Json layers = Json::array();
  for (const VectorLayerFacts& l : facts.layers) {
    Json j = {{"name", l.name},         {"crs", l.crs.empty() ? Json() : Json(l.crs)},
              {"features", l.features}, {"polygons", l.polygons},
              {"lines", l.lines},       {"points", l.points},
              {"vertices", l.vertices}, {"vertices_with_height", l.with_height}};
    j["bounds"] = l.vertices > 0 ? Json{l.west, l.south, l.east, l.north} : Json();
    j["heights"] = l.with_height > 0 ? Json{l.lowest, l.highest} : Json();
    layers.push_back(std::move(j));
  }
  return {{"kind", "lines and polygons"}, {"driver", facts.driver}, {"layers", layers}};
}

std::string vectors_text(const std::string& path, const VectorFacts& facts) {
  std::string out = fmt::format("lines      {} ({})\n", logging::printable(path), facts.driver);
  for (const VectorLayerFacts& l : facts.layers) {
    out += fmt::format("layer      {}: {}, {} vertices\n", logging::printable(l.name),
                       shapes_text(l.polygons, l.lines, l.points), l.vertices);
    out += fmt::format("CRS        {}\n", l.crs.empty() ? "none: the DEM's is taken for it"
                                                        : logging::printable(l.crs));
    if (l.vertices > 0)
      out += fmt::format("bounds     {:.10g} {:.10g} {:.10g} {:.10g} (west south east north)\n",
                         l.west, l.south, l.east, l.north);
    out += l.with_height > 0
               ? fmt::format("heights    {:.8g} .. {:.8g}, at {} of the vertices\n", l.lowest,
                             l.highest, l.with_height == l.vertices ? "all" : "some")
               : std::string("heights    none: levels and heights are the DEM's\n");
  }
  return out;
}

std::string vectors_line(const Json& j) {
  std::size_t polygons = 0, lines = 0, points = 0, vertices = 0, high = 0;
  std::string crs;
  for (const Json& l : j["layers"]) {
    polygons += l["polygons"].get<std::size_t>(), lines += l["lines"].get<std::size_t>();
    points += l["points"].get<std::size_t>(), vertices += l["vertices"].get<std::size_t>();
    high += l["vertices_with_height"].get<std::size_t>();
    if (crs.empty() && !l["crs"].is_null()) crs = l["crs"].get<std::string>();
  }
  return fmt::format("{}, {}, {} vertices, {}, {} heights", j["driver"].get<std::string>(),
                     shapes_text(polygons, lines, points), vertices, crs.empty() ? "no CRS" : crs,
                     high > 0 ? "own" : "no");
}

}  // namespace tind::cli
