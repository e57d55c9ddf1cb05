#include "server/cli/commands/info/info_inventory.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "proto/json_text.h"
#include "server/cli/commands/info/info_dem.h"
#include "server/cli/commands/info/info_layers.h"
#include "server/cli/commands/info/info_vectors.h"
#include "server/cli/program/exit.h"
#include "server/log/printable.h"

namespace tind::cli {
namespace {

using Json = nlohmann::ordered_json;

constexpr std::size_t kWidestName = 40;

std::string dem_line(const Json& j) {
  const std::string crs = j["crs"]["name"].get<std::string>();
  std::string line = fmt::format(
      "{}, {} x {} posts, {:.4g} x {:.4g} m, {}, datum {}", j["driver"].get<std::string>(),
      j["cols"].get<std::int64_t>(), j["rows"].get<std::int64_t>(), j["spacing_m"][0].get<double>(),
      j["spacing_m"][1].get<double>(), crs.empty() ? "no CRS" : crs, j["datum"].get<std::string>());
  const Json& heights = j.contains("sample") ? j["sample"] : j;
  if (heights["min_height_m"].is_null())
    line += ", no heights";
  else
    line += fmt::format(", {:.6g} .. {:.6g} m", heights["min_height_m"].get<double>(),
                        heights["max_height_m"].get<double>());
  if (heights["void_share"].get<double>() > 0)
    line += fmt::format(", {} % void", percent_text(heights["void_share"].get<double>(), 3));
  if (j.contains("sample")) line += " (of a sample)";
  for (const Json& odd : j["undeclared_nodata"])
    line += fmt::format(", {} posts are {} (no data?)", odd["posts"].dump(), odd["value"].dump());
  return line;
}

std::string mesh_line(const Json& j) {
  std::string line =
      fmt::format("mesh, {}, {} vertices, {} triangles", j["format"].get<std::string>(),
                  j["vertices"].dump(), j["triangles"].dump());
  const auto corner = [&](const char* key) {
    const Json& p = j[key];
    return fmt::format("{:.8g} {:.8g} {:.6g}", p[0].get<double>(), p[1].get<double>(),
                       p[2].get<double>());
  };
  if (j.contains("low")) line += fmt::format(", x y z {} .. {}", corner("low"), corner("high"));
  const std::string crs = j.contains("crs") ? j["crs"].get<std::string>() : std::string();
  line += ", " + (crs.empty() ? "no CRS" : crs);
  if (j.contains("origin")) line += " (metres from an origin)";
  return line;
}

std::string line_of(const Json& j) {
  const std::string kind = j["kind"].get<std::string>();
  if (kind == "dem") return dem_line(j);
  if (kind == "mesh") return mesh_line(j);
  if (kind == "lines and polygons") return vectors_line(j);
  if (kind == "3D Tiles")
    return fmt::format("3D Tiles, {} contents, {} bytes", j["contents"].dump(), j["bytes"].dump());
  if (kind == "tile set") {
    std::uint64_t tiles = 0;
    for (const Json& level : j["levels"]) tiles += level["tiles"].get<std::uint64_t>();
    return fmt::format("tile set, {} tiles, levels {} .. {}, {}", tiles, j["minzoom"].dump(),
                       j["maxzoom"].dump(), j["format"].get<std::string>());
  }
  std::string line = fmt::format("{}, {} vertices", kind, j["vertices"].dump());
  if (j.contains("triangles")) line += fmt::format(", {} triangles", j["triangles"].dump());
  return line;
}

}  // namespace

int print_inventory(const std::vector<std::string>& inputs, const DescribeInput& describe,
                    const DescribeTogether& together, bool json) {
  std::size_t width = 0;
  for (const std::string& path : inputs) width = std::max(width, path.size());
  width = std::min(width, kWidestName);
  Json all = Json::array();
  int exit = kOk;
  std::size_t unreadable = 0;
  std::vector<std::string> dems;
  for (const std::string& path : inputs) {
    auto one = describe(path);
    if (!one) {
      if (exit == kOk) exit = exit_code(one.error().code);
      ++unreadable;
    }
    if (one && (*one)["kind"] == "dem") dems.push_back(path);
    if (json) {
      Json entry = {{"input", path}};
      entry.update(one ? *one : Json{{"kind", "unreadable"}, {"error", one.error().what}});
      all.push_back(std::move(entry));
      continue;
    }
    std::string said = one ? line_of(*one) : one.error().what;
    if (!one && said.starts_with(path + ": ")) said.erase(0, path.size() + 2);
    if (!one) said = "cannot be read: " + said;
    std::printf("%s\n", logging::printable(fmt::format("{:<{}}  {}", path, width, said)).c_str());
    std::fflush(stdout);
  }
  if (dems.size() > 1) {
    Json layers = together(dems);
    if (!layers.is_null() && !json) std::printf("\n%s", layers_table(layers["layers"]).c_str());
    if (!layers.is_null() && json) all.push_back(std::move(layers));
  }
  if (json) std::printf("%s\n", json::to_text(all, 2).c_str());
  if (unreadable > 0)
    std::fprintf(stderr, "tind: %zu of %zu inputs cannot be read\n", unreadable, inputs.size());
  return exit;
}

}  // namespace tind::cli
