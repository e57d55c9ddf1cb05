#include "server/api/ogc/collection_json.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "server/api/crs_name.h"
#include "server/api/ogc/asked_crs.h"
#include "server/api/ogc/post_grid.h"
#include "terrain/geo/web_mercator.h"
#include "terrain/images/height_image.h"
#include "terrain/raster/crs_code.h"
#include "terrain/raster/datums.h"

namespace tind::api::ogc {
namespace {

using services::ServedDataset;

const std::string kCrs84 = crs_uri("CRS84");

/// Of the DEM's own system; empty: none of EPSG's list.
Result<std::string> storage_crs(const ServedDataset& dataset) {
  if (!dataset.source || !dataset.source->only()) return std::string();
  const auto code = crs_code(dataset.source->info().crs_wkt);
  if (!code) return std::unexpected(code.error());
  return code->epsg > 0 ? crs_uri(fmt::format("EPSG:{}", code->epsg)) : std::string();
}

/// What heights in answers are above, without another wish: the DEM's own, whatever tiles have.
std::string datum_of(const ServedDataset& dataset, const DatasetFacts& facts) {
  return dataset.source ? name(dataset.source->info().source_datum) : facts.datum;
}

std::string above(const std::string& datum) {
  return datum.empty() || datum == "unknown" ? std::string() : " above " + datum;
}

std::string description_of(const ServedDataset& dataset, const std::string& datum) {
  std::string text = "Heights of terrain, metres" + above(datum);
  if (!dataset.source) return text + "; tiles of meshes, whose heights these are";
  const Surface& surface = *dataset.source;
  const DemInfo& info = surface.info();
  if (surface.only())
    return text + fmt::format("; {} x {} posts, {:.4g} m apart", info.cols, info.rows,
                              std::max(info.spacing_x_m, info.spacing_y_m));
  return text + fmt::format("; {} layers", surface.layers().size());
}

Ordered extent_of(const DatasetFacts& facts) {
  return {{"spatial", {{"bbox", Ordered::array({bbox_of(facts.box)})}, {"crs", kCrs84}}}};
}

/// Where an EDR query is asked, and what it takes.
Ordered query_json(const Asked& asked, const std::string& base, const char* type) {
  Ordered variables = {{"title", std::string(type) + " query"},
                       {"query_type", type},
                       {"output_formats", {kCoverageJson, kGeoJson}},
                       {"default_output_format", kCoverageJson}};
  if (std::string_view(type) == "corridor") {
    variables["width_units"] = {"m", "km", "ft", "mi", "nmi"};
    variables["height_units"] = {"m", "km", "ft", "mi", "nmi"};
  }
  const std::string place = std::string_view(type) == "cube" ? "bbox" : "coords";
  Ordered to = template_link(asked, base + "/" + type + "?" + place + "={" + place + "}", "data",
                             "application/prs.coverage+json", variables["title"]);
  to["variables"] = std::move(variables);
  return {{"link", std::move(to)}};
}

/// As the draft of Coverages has it that GDAL 3.6 knows: pixels whose middles are the posts of a
/// DEM in longitudes and latitudes, and about as many of another.
void add_grid(Ordered& json, const ServedDataset& dataset, const DatasetFacts& facts) {
  const auto crs = AskedCrs::make("CRS84", facts);
  const PostGrid grid(*crs, *dataset.source);
  const CrsBox box =
      grid.around(*crs, {facts.box.west, facts.box.south, facts.box.east, facts.box.north});
  const Vec2 pixels = grid.pixels(box, ground_m(*crs, box));  // as the coverage itself counts them
  const auto axis = [](const char* label, double low, double high, double steps) {
    return Ordered{
        {"type", "RegularAxis"}, {"axisLabel", label},
        {"lowerBound", low},     {"upperBound", high},
        {"uomLabel", "deg"},     {"resolution", (high - low) / std::max(1., std::round(steps))}};
  };
  json["domainSet"] = {{"type", "DomainSet"},
                       {"generalGrid",
                        {{"type", "GeneralGridCoverage"},
                         {"srsName", kCrs84},
                         {"axisLabels", {"Lon", "Lat"}},
                         {"axis",
                          {axis("Lon", box.west, box.east, pixels.x),
                           axis("Lat", box.south, box.north, pixels.y)}}}}};
  json["rangeType"] = {{"type", "DataRecord"},
                       {"field",
                        {{{"type", "Quantity"},
                          {"name", "height"},
                          {"definition", "FLOAT32"},
                          {"uom", {{"type", "UnitReference"}, {"code", "m"}}}}}}};
}

Ordered links_of(const Asked& asked, const ServedDataset& dataset, const std::string& base) {
  Ordered links = Ordered::array();
  const auto add = [&](const std::string& to, const char* rel, const char* type,
                       const char* title) { links.push_back(link(asked, to, rel, type, title)); };
  if (dataset.tiles) add(base + "/tiles", kRelTilesetsCoverage, kJson, "tiles of meshes");
  if (dataset.source) {
    if (has_images(*dataset.source))
      add(base + "/tiles", kRelTilesetsMap, kJson, "tiles of maps: hillshade, slope, heights");
    add(base + "/coverage?f=tif", kRelCoverage, "image/tiff; application=geotiff",
        "the heights as GeoTIFF");
    add(base + "/coverage?f=png", kRelCoverage, "image/png", "the heights as PNG of 16 bits");
    add(base + "/coverage?f=covjson", kRelCoverage, "application/prs.coverage+json",
        "the heights as CoverageJSON");
  }
  if (dataset.tiles)
    add("/terrain/" + dataset.name + "/layer.json", "related", kJson, "for globe clients");
  return links;
}

}  // namespace

std::array<double, 4> bbox_of(const GeoRect& box) {
  if (box.width() >= 360) return {-180, box.south, 180, box.north};
  return {box.west, box.south, box.east > 180 ? box.east - 360 : box.east, box.north};
}

proto::CoverageParameter height_parameter(const std::string& datum) {
  proto::CoverageParameter p;
  p.name = "height";
  p.description = "Height of the terrain, metres" + above(datum);
  p.property = "http://vocab.nerc.ac.uk/standard_name/surface_altitude/";
  p.property_name = "Height of the terrain";
  return p;
}

Result<Ordered> collection_json(const Asked& asked, const ServedDataset& dataset, bool whole) {
  const DatasetFacts facts = dataset.facts();
  const std::string datum = datum_of(dataset, facts);
  const std::string base = "/collections/" + dataset.name;
  const auto storage = storage_crs(dataset);
  if (!storage) return std::unexpected(storage.error());
  Ordered json = {{"id", dataset.name},
                  {"title", dataset.name},
                  {"description", description_of(dataset, datum)}};
  if (!facts.attribution.empty()) json["attribution"] = facts.attribution;
  json["keywords"] = {"terrain", "elevation"};
  json["extent"] = extent_of(facts);
  std::vector<std::string> crs = {kCrs84, crs_uri("EPSG:4326")};
  if (facts.box.overlaps(web_mercator::rect({0, 0, 0}))) crs.push_back(crs_uri("EPSG:3857"));
  if (!storage->empty() && std::ranges::find(crs, *storage) == crs.end()) crs.push_back(*storage);
  json["crs"] = crs;
  if (!storage->empty()) json["storageCrs"] = *storage;
  json["dataType"] = "coverage";
  json["output_formats"] = {kCoverageJson, kGeoJson};
  json["parameter_names"]["height"] =
      Ordered::parse(proto::encode_parameter(height_parameter(datum)));
  for (const char* type : {"position", "trajectory", "corridor", "area", "cube"})
    json["data_queries"][type] = query_json(asked, base, type);
  if (whole && dataset.source) add_grid(json, dataset, facts);
  json["links"] = links_of(asked, dataset, base);
  return json;
}

}  // namespace tind::api::ogc
