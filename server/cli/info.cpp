// tind info: what is this file? A DEM, a terrain tile, or a folder of tiles.

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
#include "server/cli/dem_input.h"
#include "terrain/geo/ellipsoid.h"

namespace tind::cli {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

struct Arguments {
  DemInput dem;
  bool json = false;
};

// ---- a DEM ----

struct HeightRange {
  double low = HUGE_VAL, high = -HUGE_VAL;
  std::int64_t posts = 0, voids = 0;
};

/// Reads every post, some rows at a time. A damaged file is found out here.
Result<HeightRange> scan(const DemSource& dem) {
  constexpr std::int64_t kPostsAtOnce = 16 << 20;
  const DemInfo& info = dem.info();
  const auto rows_at_once =
      std::clamp<std::int64_t>(kPostsAtOnce / info.cols / 256 * 256, 256, 65536);
  HeightRange range;
  for (std::int64_t row = 0; row < info.rows; row += rows_at_once) {
    const auto rows = std::min(rows_at_once, info.rows - row);
    const auto grid = dem.read(0, row, int(info.cols), int(rows));
    if (!grid) return std::unexpected(grid.error());
    range.posts += std::int64_t(grid->size());
    for (const float z : grid->values()) {
      if (std::isnan(z)) {
        ++range.voids;
      } else {
        range.low = std::min<double>(range.low, z);
        range.high = std::max<double>(range.high, z);
      }
    }
  }
  return range;
}

const char* text(CrsKind kind) {
  switch (kind) {
    case CrsKind::geographic:
      return "geographic";
    case CrsKind::projected:
      return "projected";
    case CrsKind::none:
      break;
  }
  return "none";
}

Json to_json(const DemSource& dem, const HeightRange& range) {
  const DemInfo& info = dem.info();
  const Affine& m = info.post_to_crs;
  Json j;
  j["kind"] = "dem";
  j["files"] = info.files;
  j["driver"] = info.driver;
  j["cols"] = info.cols;
  j["rows"] = info.rows;
  j["has_geotransform"] = info.has_geotransform;
  j["post_to_crs"] = {m.x0, m.x_col, m.x_row, m.y0, m.y_col, m.y_row};
  j["crs"] = {{"kind", text(info.crs_kind)},
              {"name", info.crs_name},
              {"unit_m", info.crs_unit_m},
              {"wkt", info.crs_wkt}};
  if (info.crs_kind != CrsKind::none) {
    const GeoRect& b = info.bounds;
    j["bounds"] = {b.west, b.south, b.east, b.north};
  }
  j["wraps_longitude"] = info.wraps_longitude;
  j["period_cols"] = info.period_cols;
  j["plain_geographic"] = info.crs_kind != CrsKind::none && dem.is_plain_geographic();
  j["spacing_m"] = {info.spacing_x_m, info.spacing_y_m};
  j["z_unit_m"] = info.z_unit_m;
  j["source_datum"] = name(info.source_datum);
  j["datum"] = name(info.datum);
  j["rounding_m"] = info.rounding_m;
  j["fingerprint"] = info.fingerprint;
  const bool empty = range.voids == range.posts;
  j["min_height_m"] = empty ? Json() : Json(range.low);
  j["max_height_m"] = empty ? Json() : Json(range.high);
  j["voids"] = range.voids;
  j["void_share"] = double(range.voids) / double(range.posts);
  return j;
}

std::string to_text(const DemInfo& info, const HeightRange& range) {
  const Affine& m = info.post_to_crs;
  std::string out = fmt::format("DEM        {} ({})\n", fmt::join(info.files, ", "), info.driver);
  out += fmt::format("posts      {} x {}, {:.4g} x {:.4g} m apart\n", info.cols, info.rows,
                     info.spacing_x_m, info.spacing_y_m);
  if (info.has_geotransform)
    out += fmt::format("first post {:.10g}, {:.10g}; step {:.10g}, {:.10g}\n", m.x0, m.y0, m.x_col,
                       m.y_row);
  out += fmt::format("CRS        {}\n", info.crs_kind == CrsKind::none
                                            ? "none: can be simplified, but not tiled"
                                            : info.crs_name);
  if (info.crs_kind != CrsKind::none)
    out += fmt::format("bounds     {:.6f} {:.6f} {:.6f} {:.6f} (west south east north){}\n",
                       info.bounds.west, info.bounds.south, info.bounds.east, info.bounds.north,
                       info.wraps_longitude ? ", around the globe" : "");
  out += fmt::format(
      "heights    {}, unit {} m, {}\n",
      range.voids == range.posts ? std::string("none")
                                 : fmt::format("{:.8g} .. {:.8g} m", range.low, range.high),
      info.z_unit_m,
      info.rounding_m == 0 ? std::string("stored exactly")
                           : fmt::format("rounded by at most {:.3g} m", info.rounding_m));
  out += fmt::format("voids      {} ({:.4g} %)\n", range.voids,
                     100.0 * double(range.voids) / double(range.posts));
  out += fmt::format(
      "datum      {}{}\n", name(info.datum),
      info.datum == info.source_datum
          ? std::string(info.datum == VerticalDatum::unknown ? " (say what it is with --from-datum)"
                                                             : "")
          : fmt::format(" (file: {})", name(info.source_datum)));
  return out + fmt::format("content    {}\n", info.fingerprint);
}

int run_dem(const Arguments& a) {
  const auto dem = open_dem(a.dem);
  if (!dem) return complain(dem.error());
  const auto range = scan(**dem);
  if (!range) return complain(range.error());
  if (a.json)
    std::printf("%s\n", to_json(**dem, *range).dump(2).c_str());
  else
    std::printf("%s", to_text((*dem)->info(), *range).c_str());
  return kOk;
}

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
  std::printf("%s%s", (a.json ? j.dump(2) : to_text(path, j)).c_str(), a.json ? "\n" : "");
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
  std::printf("%s%s", (a.json ? j.dump(2) : to_text(path, *layer, j)).c_str(), a.json ? "\n" : "");
  return kOk;
}

int run(const Arguments& a) {
  const std::string& first = a.dem.files[0];
  std::error_code error;
  if (a.dem.files.size() == 1 && fs::is_directory(first, error)) return run_folder(a, first);
  if (a.dem.files.size() == 1 && first.ends_with(".terrain")) return run_tile(a, first);
  return run_dem(a);
}

}  // namespace

void add_info(CLI::App& program, int& exit) {
  auto a = std::make_shared<Arguments>();
  CLI::App* app = program.add_subcommand(
      "info", "Say what a DEM, a .terrain tile or a folder of tiles is; reads every post of a DEM");
  app->add_option("input", a->dem.files, "a DEM (or several on one grid), a tile, or a folder")
      ->required();
  add_dem_options(*app, a->dem);
  app->add_flag("--json", a->json, "print it as JSON");
  app->callback([a, &exit] { exit = run(*a); });
}

}  // namespace tind::cli
