// tind info: what is this file? A DEM (info_dem.cpp), a terrain tile, or a folder of tiles.

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <libdeflate.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <span>

#include "proto/file_io.h"
#include "proto/layer_json.h"
#include "proto/quantized_mesh.h"
#include "server/cli/commands.h"
#include "server/cli/info_dem.h"
#include "server/cli/output_options.h"
#include "terrain/geo/ellipsoid.h"

namespace tind::cli {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

struct Arguments {
  DemInput dem;
  InfoDemOptions options;
};

// ---- a tile ----

/// The bytes of a gzip file; others as they are.
Result<std::string> unpacked(const std::string& path, std::string bytes) {
  constexpr std::size_t kMost = 64 << 20;
  if (!bytes.starts_with("\x1f\x8b")) return bytes;
  const std::unique_ptr<libdeflate_decompressor, decltype(&libdeflate_free_decompressor)> inflate(
      libdeflate_alloc_decompressor(), libdeflate_free_decompressor);
  std::string out(std::min(kMost, 1040 * bytes.size()), '\0');  // DEFLATE's highest ratio is 1032
  std::size_t size = 0;
  if (libdeflate_gzip_decompress(inflate.get(), bytes.data(), bytes.size(), out.data(), out.size(),
                                 &size) != LIBDEFLATE_SUCCESS)
    return fail(Errc::bad_data, path + ": damaged gzip data");
  out.resize(size);
  return out;
}

Json to_json(const proto::QuantizedMesh& tile, std::size_t bytes) {
  const auto place = wgs84::from_ecef({tile.center[0], tile.center[1], tile.center[2]});
  Json j;
  j["kind"] = "quantized-mesh tile";
  j["bytes"] = bytes;
  j["vertices"] = tile.u.size();
  j["triangles"] = tile.triangles.size();
  j["edge_vertices"] = {{"west", tile.west.size()},
                        {"south", tile.south.size()},
                        {"east", tile.east.size()},
                        {"north", tile.north.size()}};
  j["min_height_m"] = tile.min_height;
  j["max_height_m"] = tile.max_height;
  j["center"] = tile.center;
  j["center_lon_lat_height"] = {place.p.lon, place.p.lat, place.height_m};
  j["bounding_sphere"] = tile.bounding_sphere;
  j["horizon_occlusion"] = tile.horizon_occlusion;
  Json extensions = Json::array();
  if (!tile.oct_normals.empty()) extensions.push_back("octvertexnormals");
  if (!tile.water_mask.empty()) extensions.push_back("watermask");
  if (!tile.metadata.empty()) extensions.push_back("metadata");
  j["extensions"] = extensions;
  if (!tile.metadata.empty()) {
    j["metadata"] = Json::parse(tile.metadata, nullptr, false);
    if (j["metadata"].is_discarded()) j["metadata"] = tile.metadata;
  }
  return j;
}

std::string to_text(const std::string& path, const Json& j) {
  const Json& c = j["center_lon_lat_height"];
  const Json& e = j["edge_vertices"];
  std::string out = fmt::format("tile       {} (quantized-mesh, {} bytes unpacked)\n", path,
                                j["bytes"].get<std::size_t>());
  out += fmt::format("mesh       {} vertices, {} triangles; on the edges W {} S {} E {} N {}\n",
                     j["vertices"].dump(), j["triangles"].dump(), e["west"].dump(),
                     e["south"].dump(), e["east"].dump(), e["north"].dump());
  out += fmt::format("heights    {:.8g} .. {:.8g} m\n", j["min_height_m"].get<double>(),
                     j["max_height_m"].get<double>());
  out += fmt::format("centre     lon {:.6f}, lat {:.6f}, {:.1f} m above the ellipsoid\n",
                     c[0].get<double>(), c[1].get<double>(), c[2].get<double>());
  out += fmt::format("sphere     radius {:.1f} m\n", j["bounding_sphere"][3].get<double>());
  out += fmt::format("extensions {}\n", j["extensions"].dump());
  if (j.contains("metadata")) out += fmt::format("metadata   {}\n", j["metadata"].dump());
  return out;
}

int run_tile(const Arguments& a, const std::string& path) {
  auto file = proto::read_whole_file(path);
  if (!file) return complain({Errc::not_found, file.error()});
  const auto bytes = unpacked(path, std::move(*file));
  if (!bytes) return complain(bytes.error());
  std::string reason;
  const auto tile =
      proto::decode({reinterpret_cast<const std::uint8_t*>(bytes->data()), bytes->size()}, reason);
  if (!tile) return complain({Errc::bad_data, path + ": not a quantized-mesh tile: " + reason});
  const Json j = to_json(*tile, bytes->size());
  std::printf("%s%s", (a.options.json ? j.dump(2) : to_text(path, j)).c_str(),
              a.options.json ? "\n" : "");
  return kOk;
}

// ---- a folder of tiles ----

Json to_json(const proto::LayerJson& layer) {
  Json levels = Json::array();
  for (std::size_t z = 0; z < layer.available.size(); ++z) {
    std::uint64_t tiles = 0;
    for (const proto::TileRange& r : layer.available[z])
      tiles += (std::uint64_t(r.end_x) - r.start_x + 1) * (std::uint64_t(r.end_y) - r.start_y + 1);
    if (tiles > 0) levels.push_back({{"level", z}, {"tiles", tiles}});
  }
  return {{"kind", "tile set"},
          {"name", layer.name},
          {"format", layer.format},
          {"projection", layer.projection},
          {"scheme", layer.scheme},
          {"version", layer.version},
          {"bounds", layer.bounds},
          {"minzoom", layer.minzoom},
          {"maxzoom", layer.maxzoom},
          {"levels", levels},
          {"extensions", layer.extensions},
          {"attribution", layer.attribution}};
}

std::string to_text(const std::string& path, const proto::LayerJson& layer, const Json& j) {
  std::string out = fmt::format("tile set   {} \"{}\" ({}, {}, {})\n", path, layer.name,
                                layer.format, layer.projection, layer.scheme);
  out += fmt::format("bounds     {:.6f} (west south east north)\n", fmt::join(layer.bounds, " "));
  out += fmt::format("levels     {} .. {}\n", layer.minzoom, layer.maxzoom);
  for (const Json& level : j["levels"])
    out += fmt::format("  {:>2}       {} tiles\n", level["level"].get<int>(),
                       level["tiles"].get<std::uint64_t>());
  return out + fmt::format("extensions {}\n", j["extensions"].dump());
}

int run_folder(const Arguments& a, const std::string& path) {
  const std::string file = (fs::path(path) / "layer.json").string();
  const auto json = proto::read_whole_file(file);
  if (!json)
    return complain({Errc::not_found, path + ": a folder without layer.json is no tile set"});
  std::string reason;
  const auto layer = proto::decode_layer_json(*json, reason);
  if (!layer) return complain({Errc::bad_data, file + ": " + reason});
  const Json j = to_json(*layer);
  std::printf("%s%s", (a.options.json ? j.dump(2) : to_text(path, *layer, j)).c_str(),
              a.options.json ? "\n" : "");
  return kOk;
}

int run(const Arguments& a) {
  const std::string& first = a.dem.files[0];
  std::error_code error;
  if (a.dem.files.size() == 1 && fs::is_directory(first, error)) return run_folder(a, first);
  if (a.dem.files.size() == 1 && first.ends_with(".terrain")) return run_tile(a, first);
  return run_info_dem(a.dem, a.options);
}

}  // namespace

void add_info(CLI::App& program, int& exit) {
  auto a = std::make_shared<Arguments>();
  CLI::App* app =
      program.add_subcommand("info", "Say what a DEM, a .terrain tile or a folder of tiles is");
  app->add_option("input", a->dem.files, "a DEM (or several on one grid), a tile, or a folder")
      ->required();
  add_dem_options(*app, a->dem);
  app->add_flag("--stats", a->options.stats,
                "read every post of a DEM of more than 33 million, too: the exact range of its "
                "heights and its voids, and whether all can be read");
  add_progress_option(*app, a->options.progress);
  app->add_flag("--json", a->options.json, "print it as JSON");
  app->footer(
      "Every post of a DEM is read where there are 33 million or fewer. Of a larger one a sample "
      "of blocks is read, unless --stats is given, and what it shows is called a sample.");
  app->callback([a, &exit] { exit = run(*a); });
}

}  // namespace tind::cli
