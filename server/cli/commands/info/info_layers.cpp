#include "server/cli/commands/info/info_layers.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <nlohmann/json.hpp>
#include <vector>

#include "server/api/accuracy_json.h"
#include "server/log/printable.h"
#include "terrain/base/enum_names.h"
#include "terrain/raster/raster_content.h"

namespace tind::cli {
namespace {

using Json = nlohmann::ordered_json;

Result<Json> to_json(const SurfaceLayer& layer, const DemOptions& options) {
  const DemInfo& info = layer.source->info();
  auto content = content_json(info.files.front(), options);
  if (!content) return content;
  const GeoRect& b = info.bounds;
  Json j = {{"name", layer.name},
            {"files", info.files},
            {"crs", info.crs_name},
            {"cols", info.cols},
            {"rows", info.rows},
            {"spacing_m", {info.spacing_x_m, info.spacing_y_m}},
            {"bounds", {b.west, b.south, b.east, b.north}},
            {"datum", name(info.datum)},
            {"source_datum", name(info.source_datum)},
            {"z_unit_m", info.z_unit_m},
            {"blend_m", layer.blend_m}};
  if (info.accuracy) j["accuracy"] = api::accuracy_json(*info.accuracy);
  j["content"] = std::move(*content);
  return j;
}

using Row = std::array<std::string, 7>;

Row row_of(const Json& j) {
  const auto number = [](const Json& n) { return n.get<double>(); };
  const Json& b = j["bounds"];
  std::string datum = j["datum"].get<std::string>();
  if (j["source_datum"] != j["datum"]) datum += " from " + j["source_datum"].get<std::string>();
  if (j.contains("accuracy"))
    datum += fmt::format(", {} {:g} m", j["accuracy"]["kind"].get<std::string>(),
                         number(j["accuracy"]["m"]));
  return {j["name"].get<std::string>(),
          std::to_string(j["files"].size()),
          fmt::format("{:.4g} x {:.4g}", number(j["spacing_m"][0]), number(j["spacing_m"][1])),
          j["crs"].get<std::string>(),
          fmt::format("{:.3f} {:.3f} {:.3f} {:.3f}", number(b[0]), number(b[1]), number(b[2]),
                      number(b[3])),
          datum,
          content_text(j["content"])};
}

}  // namespace

Result<Json> content_json(const std::string& path, const DemOptions& options) {
  const auto content = raster_content(path, options);
  if (!content) return std::unexpected(content.error());
  return Json{{"type", content->type},     {"band", content->band},
              {"bands", content->bands},   {"encoding", name_of(content->encoding)},
              {"scale", content->scale},   {"offset", content->offset},
              {"unit_m", content->unit_m}, {"nodata", content->nodata},
              {"mask", content->mask}};
}

std::string content_text(const Json& j) {
  std::string out = j["type"].get<std::string>();
  if (j["bands"].get<int>() > 1)
    out += fmt::format(", band {} of {}", j["band"].dump(), j["bands"].dump());
  if (const auto encoding = j["encoding"].get<std::string>(); encoding != "number")
    out += ", colours as " + encoding;
  if (j["scale"].get<double>() != 1 || j["offset"].get<double>() != 0)
    out += fmt::format(", x {:g} + {:g}", j["scale"].get<double>(), j["offset"].get<double>());
  if (const double unit = j["unit_m"].get<double>(); unit != 1)
    out += fmt::format(", in units of {:.7g} m", unit);
  std::string nodata;
  for (const Json& value : j["nodata"])
    nodata += (nodata.empty() ? "" : ", ") + (value.is_null() ? "NaN" : value.dump());
  if (j["mask"].get<bool>()) nodata += nodata.empty() ? "a mask" : " and a mask";
  return out + (nodata.empty() ? ", no nodata" : ", nodata " + nodata);
}

Result<Json> layers_json(const Surface& surface, const DemOptions& options) {
  Json all = Json::array();
  for (const SurfaceLayer& layer : surface.layers()) {
    auto one = to_json(layer, options);
    if (!one) return one;
    all.push_back(std::move(*one));
  }
  return all;
}

std::string layers_table(const Json& layers) {
  std::vector<Row> rows = {
      {"layer", "files", "spacing m", "CRS", "west south east north", "heights above", "numbers"}};
  for (auto it = layers.rbegin(); it != layers.rend(); ++it) rows.push_back(row_of(*it));
  std::string out;
  for (const Row& row : rows) {
    std::string line;
    for (std::size_t i = 0; i < row.size(); ++i) {
      std::size_t width = 0;
      for (const Row& other : rows) width = std::max(width, other[i].size());
      line += i + 1 < row.size() ? fmt::format("{:<{}}  ", row[i], width) : row[i];
    }
    out += logging::printable(line) + "\n";
  }
  return out;
}

}  // namespace tind::cli
