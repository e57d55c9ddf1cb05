// tind info: what is this? DEMs (info_dem.cpp), terrain tiles, tile sets here and
// elsewhere, meshes, lines and polygons.

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <memory>
#include <nlohmann/json.hpp>
#include <span>
#include <vector>

#include "proto/json_text.h"
#include "proto/stream/mesh_stream.h"
#include "proto/tile/layer_json.h"
#include "proto/tile/quantized_mesh.h"
#include "server/cli/commands/commands.h"
#include "server/cli/commands/info/info_dem.h"
#include "server/cli/commands/info/info_inventory.h"
#include "server/cli/commands/info/info_layers.h"
#include "server/cli/commands/info/info_vectors.h"
#include "server/cli/options/mesh_input.h"
#include "server/cli/options/output_options.h"
#include "server/log/printable.h"
#include "terrain/base/file_io.h"
#include "terrain/check/check_tileset.h"
#include "terrain/check/tileset_files.h"
#include "terrain/geo/ellipsoid.h"
#include "terrain/progressive/stream/progressive_stream.h"
#include "terrain/raster/dem_files.h"
#include "terrain/simplify/options.h"
#include "terrain/store/layer_place.h"
#include "terrain/store/open/open_store.h"
#include "terrain/surface/open_surface.h"

namespace tind::cli {
namespace {

using Json = nlohmann::ordered_json;

struct Arguments {
  DemInput dem;
  InfoDemOptions options;
};

// ---- a tile ----

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
    j["metadata"] = json::parse<Json>(tile.metadata);
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
  if (j.contains("metadata")) out += fmt::format("metadata   {}\n", json::to_text(j["metadata"]));
  return out;
}

/// Prints the text, or gives the JSON.
Result<Json> said(const Arguments& a, Json json, const std::string& text) {
  if (!a.options.json) std::printf("%s", text.c_str());
  return json;
}

Result<Json> info_tile(const Arguments& a, const std::string& path) {
  auto bytes = read_one_tile(path);
  if (!bytes) return std::unexpected(bytes.error());
  if (!gunzip(*bytes)) return fail(Errc::bad_data, path + ": damaged gzip data");
  const auto tile = proto::decode(*bytes);
  if (!tile)
    return fail(Errc::bad_data, path + ": not a quantized-mesh tile: " + tile.error().what);
  const Json j = to_json(*tile, bytes->size());
  return said(a, j, to_text(path, j));
}

// ---- a tile set ----

std::vector<double> box_of(const proto::LayerJson& layer) {
  const GeoRect box = layer_box(layer);
  return {box.west, box.south, box.east, box.north};
}

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
          {"box", box_of(layer)},
          {"minzoom", layer.minzoom},
          {"maxzoom", layer.maxzoom},
          {"levels", levels},
          {"extensions", layer.extensions},
          {"attribution", layer.attribution},
          {"datum", layer.datum.empty() ? Json() : Json(layer.datum)}};
}

std::string to_text(const std::string& path, const proto::LayerJson& layer, const Json& j) {
  std::string out = fmt::format("tile set   {} \"{}\" ({}, {}, {})\n", path, layer.name,
                                layer.format, layer.projection, layer.scheme);
  out += fmt::format("bounds     {:.6f} (west south east north)\n", fmt::join(layer.bounds, " "));
  // Across the antimeridian the bounds say nothing; the box goes on beyond 180.
  if (const auto box = box_of(layer); !std::ranges::equal(box, layer.bounds))
    out += fmt::format("box        {:.6f}\n", fmt::join(box, " "));
  out += fmt::format("datum      {}\n", layer.datum.empty() ? "not stated" : layer.datum);
  for (const proto::StatedAccuracy& one : layer.accuracy)
    out += fmt::format("accuracy   {}{:g} m ({}), as stated\n",
                       one.layer.empty() ? "" : logging::printable(one.layer) + ": ", one.metres,
                       logging::printable(one.kind));
  if (j.contains("method"))
    out += fmt::format("method     {}\n", logging::printable(j["method"].get<std::string>()));
  out += fmt::format("levels     {} .. {}\n", layer.minzoom, layer.maxzoom);
  for (const Json& level : j["levels"])
    out += fmt::format("  {:>2}       {} tiles\n", level["level"].get<int>(),
                       level["tiles"].get<std::uint64_t>());
  return out + fmt::format("extensions {}\n", j["extensions"].dump());
}

Result<Json> info_tile_set(const Arguments& a, const std::string& path) {
  const auto store = open_store(path);
  const auto json = store->layer_json();
  if (!json && json.error().code == Errc::not_found && !store->remote() && !names_archive(path))
    return fail(Errc::not_found, path +
                                     ": a folder without layer.json is no tile set; name the files "
                                     "in it that you mean");
  if (!json) return std::unexpected(json.error());
  const auto layer =
      proto::decode_layer_json({reinterpret_cast<const char*>(json->data()), json->size()});
  if (!layer) return fail(store->layer_name(), layer.error());
  Json j = to_json(*layer);
  if (!layer->accuracy.empty()) j["accuracy"] = proto::accuracy_json(layer->accuracy);
  const auto record = store->record();
  if (!record) return std::unexpected(record.error());
  if (*record) j["method"] = (*record)->method.empty() ? BoundedOptions::kName : (*record)->method;
  return said(a, j, to_text(path, *layer, j));
}

// ---- 3D Tiles ----

Result<Json> info_tileset(const Arguments& a, const std::string& path) {
  const auto files = TilesetFiles::open(path);
  if (!files) return std::unexpected(files.error());
  const auto facts = tileset_facts(**files);
  if (!facts) return fail(path, facts.error());
  Json j = {{"kind", "3D Tiles"},
            {"version", facts->version},
            {"archive", (*files)->archive()},
            {"implicit", facts->implicit},
            {"name", facts->name},
            {"generator", facts->generator},
            {"tileset_version", facts->tileset_version},
            {"attribution", facts->attribution},
            {"contents", facts->contents},
            {"subtrees", facts->subtrees},
            {"compression", facts->compression},
            {"bytes", (*files)->bytes()},
            {"levels", Json::array()}};
  std::string text =
      fmt::format("3D Tiles   {} \"{}\" (version {}{}{})\n", path, logging::printable(facts->name),
                  logging::printable(facts->version), facts->implicit ? ", implicit tiling" : "",
                  (*files)->archive() ? ", an archive" : "");
  if (!facts->generator.empty())
    text += fmt::format("made by    {}, of tiles {}\n", logging::printable(facts->generator),
                        logging::printable(facts->tileset_version));
  if (!facts->attribution.empty())
    text += fmt::format("source     {}\n", logging::printable(facts->attribution));
  text += fmt::format("files      {} contents, {} subtrees, {} bytes; compression: {}\n",
                      facts->contents, facts->subtrees, (*files)->bytes(), facts->compression);
  if (!facts->levels.empty())
    text += fmt::format("levels     {} .. {}\n", facts->levels.front().level,
                        facts->levels.back().level);
  for (const TilesetLevel& level : facts->levels) {
    j["levels"].push_back(
        {{"level", level.level}, {"contents", level.contents}, {"bytes", level.bytes}});
    text += fmt::format("  {:>2}       {} contents, {} bytes\n", level.level, level.contents,
                        level.bytes);
  }
  return said(a, std::move(j), text);
}

// ---- a mesh ----

Result<Json> info_mesh(const Arguments& a, const std::string& path) {
  const auto read = read_placed_tin(path);
  if (!read) return std::unexpected(read.error());
  const Tin* const tin = &read->tin;
  Vec3 low{HUGE_VAL, HUGE_VAL, HUGE_VAL}, high{-HUGE_VAL, -HUGE_VAL, -HUGE_VAL};
  for (const Vec3& v : tin->vertices) {
    low = {std::min(low.x, v.x), std::min(low.y, v.y), std::min(low.z, v.z)};
    high = {std::max(high.x, v.x), std::max(high.y, v.y), std::max(high.z, v.z)};
  }
  const MeshFormat& format = *format_to_read(path);
  Json j = {{"kind", "mesh"},
            {"format", format.name},
            {"vertices", tin->vertices.size()},
            {"triangles", tin->triangles.size()},
            {"attributes", Json::array()}};
  if (!tin->normals.empty()) j["attributes"].push_back("normals");
  if (!tin->colours.empty()) j["attributes"].push_back("colours");
  if (!tin->texcoords.empty()) j["attributes"].push_back("texture coordinates");
  const std::string_view title = format.title;
  std::string text =
      fmt::format("mesh       {} ({})\nshape      {} vertices, {} triangles; attributes {}\n", path,
                  title.substr(0, title.find(", binary")),  // the file may be text
                  tin->vertices.size(), tin->triangles.size(), j["attributes"].dump());
  if (!tin->vertices.empty()) {
    j["low"] = {low.x, low.y, low.z};
    j["high"] = {high.x, high.y, high.z};
    text += fmt::format("x y z      {:.10g} {:.10g} {:.10g} .. {:.10g} {:.10g} {:.10g}\n", low.x,
                        low.y, low.z, high.x, high.y, high.z);
  }
  if (is_known(read->place)) {
    j.update(place_json(read->place));
    j["z_unit_m"] = read->place.z_unit_m;
    for (const std::string& line : proto::place_lines(read->place))
      text += fmt::format("says       {}\n", logging::printable(line));
  }
  return said(a, std::move(j), text);
}

Result<Json> info_progressive(const Arguments& a, const std::string& path) {
  const auto file = read_whole_file(path);
  if (!file) return std::unexpected(file.error());
  const auto stream = proto::decode_mesh_stream(
      {reinterpret_cast<const std::uint8_t*>(file->data()), file->size()});
  if (!stream) return fail(path, stream.error());
  const bool terrain = stream->frame == proto::StreamFrame::terrain;
  const std::size_t here = stream->splits.size(), all = stream->total_splits;
  const double error = here == all              ? stream->fine_error_m
                       : stream->blocks.empty() ? HUGE_VAL
                                                : double(stream->blocks.back().error_m);
  Json j = {{"kind", "progressive mesh"},
            {"of", terrain ? "terrain" : "a surface in space"},
            {"bytes", file->size()},
            {"base_vertices", stream->base_vertices.size()},
            {"base_triangles", stream->base_triangles.size()},
            {"vertices", stream->base_vertices.size() + here},
            {"splits", here},
            {"complete", here == all},
            {terrain ? "max_error_m" : "max_error", std::isinf(error) ? Json() : Json(error)}};
  std::string text = fmt::format(
      "mesh       {} (progressive, of {}, {} bytes)\n"
      "levels     {} vertices and {} triangles to {} vertices\n"
      "error      {:.6g}{} at its finest\n",
      path, terrain ? "terrain" : "a surface in space", file->size(), stream->base_vertices.size(),
      stream->base_triangles.size(), stream->base_vertices.size() + here, error,
      terrain ? " m" : "");
  if (here < all) text += fmt::format("cut off    {} of {} splits are there\n", here, all);
  if (terrain) {
    const DemInfo info = info_of(*stream);
    j["crs"] = info.crs_name;
    j["vertical_datum"] = name(info.datum);
    text += fmt::format("CRS        {}\ndatum      {}\n",
                        info.crs_name.empty() ? "none" : logging::printable(info.crs_name),
                        name(info.datum));
  }
  return said(a, std::move(j), text);
}

// ---- whatever it is ----

Result<Json> info_files(const Arguments& a, const std::vector<std::string>& files) {
  DemInput one = a.dem;
  one.files = files;
  const auto dem = DemSource::open(files, dem_options(one));
  if (!dem) return std::unexpected(dem.error());
  return info_dem(**dem, dem_options(one), a.options);
}

Result<Json> info_of_one(const Arguments& a, const std::string& path) {
  const auto ends = [&](const char* suffix) { return path.ends_with(suffix); };
  if (ends(".terrain")) return info_tile(a, path);
  if (names_tileset(path)) return info_tileset(a, path);
  if (names_store(path)) return info_tile_set(a, path);
  if (ends(".tpm")) return info_progressive(a, path);
  if (is_mesh(path)) return info_mesh(a, path);
  auto dem = info_files(a, {path});
  // GeoPackages may hold either; what is neither is said to be no DEM.
  if (!dem && dem.error().code == Errc::bad_data) {
    const auto vectors = vector_facts(path);
    if (vectors && !vectors->layers.empty())
      return said(a, vectors_json(*vectors), vectors_text(path, *vectors));
    if (!vectors && vectors.error().code == Errc::unsupported)  // one that is not read
      return std::unexpected(vectors.error());
  }
  if (!dem) return std::unexpected(not_a_dem(dem.error(), {path}));
  return dem;
}

/// The layers that tind build makes of these, where it makes any.
Json info_together(const Arguments& a, const std::vector<std::string>& dems) {
  DemInput input = a.dem;
  input.files = dems;
  const DemOptions options = dem_options(input);
  const auto surface = tind::open_surface(dems, {.dem = options});
  if (!surface) return {};
  const auto layers = layers_json(*surface, options);
  if (!layers) return {};
  return {{"kind", "layers"}, {"layers", *layers}};
}

/// Each by itself, also where some cannot be read.
int run_inventory(const Arguments& a, const std::vector<std::string>& inputs) {
  Arguments quiet = a;
  quiet.options.quiet = true;
  quiet.options.json = true;
  return print_inventory(
      inputs, [&](const std::string& path) { return info_of_one(quiet, path); },
      [&](const std::vector<std::string>& dems) { return info_together(quiet, dems); },
      a.options.json);
}

/// The rasters of a folder or a list that are no one DEM.
std::vector<std::string> parts_of(const Arguments& a, const std::string& input) {
  if (!input.starts_with('@') && !is_dem_folder(input)) return {};
  auto files = dem_files({&input, 1}, dem_options(a.dem));
  return files && files->files.size() > 1 ? std::move(files->files) : std::vector<std::string>();
}

int run(const Arguments& a) {
  const std::string& input = a.dem.files[0];
  if (a.dem.files.size() > 1) return run_inventory(a, a.dem.files);
  auto said = info_of_one(a, input);
  if (!said) {
    if (const auto parts = parts_of(a, input); !parts.empty()) {
      std::fprintf(stderr, "tind: no one DEM, so each by itself: %s\n",
                   logging::printable(said.error().what).c_str());
      return run_inventory(a, parts);
    }
    return complain(said.error());
  }
  if (a.options.json)
    std::printf("%s\n", said->dump(2, ' ', false, Json::error_handler_t::replace).c_str());
  return kOk;
}

}  // namespace

void add_info(Command program, int& exit) {
  auto a = std::make_shared<Arguments>();
  Command app = program.add_subcommand(
      "info", "Say what a DEM, a mesh, a tile, a tile set or a file of lines is");
  app.add_option("input", a->dem.files,
                 "a DEM, a folder or @list of DEMs, a .terrain tile, a folder or URL of tiles, "
                 "3D Tiles (a folder or a .3tz), a .tpm, a mesh, or lines and polygons (GeoJSON, "
                 "GeoPackage, Shapefile ...); of several "
                 "inputs an inventory, a line each, and the layers that DEMs make")
      .required();
  add_dem_options(app, a->dem);
  app.add_flag("--stats", a->options.stats,
               "read every post of a DEM of more than 33 million, too: the exact range of its "
               "heights and its voids, and whether all can be read");
  add_progress_option(app, a->options.progress);
  app.add_flag("--json", a->options.json, "print it as JSON");
  app.footer(
      "Every post of a DEM is read where there are 33 million or fewer. Of a larger one a sample "
      "of blocks is read, unless --stats is given, and what it shows is called a sample. A folder "
      "or @list of DEMs that share a grid is one DEM, any other an inventory. The exit code is "
      "that "
      "of the first input that cannot be read, 0 where all can.");
  app.on_run([a, &exit] { exit = run(*a); });
}

}  // namespace tind::cli
