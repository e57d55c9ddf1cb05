// tind build: DEMs in, a directory of tiles out.

#include "terrain/pyramid/build/build.h"

#include <fmt/format.h>

#include <chrono>
#include <cstdio>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "proto/json_text.h"
#include "server/cli/commands/commands.h"
#include "server/cli/commands/tiles/build_images.h"
#include "server/cli/commands/tiles/build_scenery.h"
#include "server/cli/commands/tiles/build_shard.h"
#include "server/cli/commands/tiles/estimate.h"
#include "server/cli/options/dem_input.h"
#include "server/cli/options/drape_input.h"
#include "server/cli/options/line_input.h"
#include "server/cli/options/memory_limit.h"
#include "server/cli/options/output_options.h"
#include "server/cli/options/output_paths.h"
#include "server/cli/options/surface_input.h"
#include "server/cli/options/tile_options.h"
#include "server/cli/program/interrupt.h"
#include "server/cli/program/peak_memory.h"
#include "server/cli/program/progress_bar.h"
#include "terrain/base/file_io.h"
#include "terrain/raster/remote/objects.h"
#include "terrain/simplify/method_text.h"
#include "terrain/store/open/open_store.h"
#include "terrain/store/open/stored_tiles.h"
#include "terrain/surface/any_height.h"
#include "terrain/surface/stated_accuracy.h"
#include "terrain/tiles3d/tileset_archive.h"
#include "terrain/tiles3d/tileset_folder.h"

namespace tind::cli {

namespace {

constexpr const char* kQuantizedMesh = "quantized-mesh";
constexpr const char* kTiles3d = "3dtiles";
constexpr const char* kFlightGear = "flightgear";
/// What shapes tiles only.
constexpr const char* kOfTiles[] = {"--error-factor", "--deepest",    "--levels",
                                    "--side",         "--method",     "--gzip",
                                    "--dry-run",      "--breaklines", "--exact-posts"};

/// What a plan has decided.
constexpr const char* kPlanned[] = {"--max-error", "--error-factor", "--deepest", "--levels",
                                    "--side",      "--exact-posts",  "--effort",  "--method",
                                    "--gzip",      "--line-heights", "--blend",   "--layer-error",
                                    "--allow-vrt"};
/// What tind build does, and no shard.
constexpr const char* kNotOfShards[] = {"--format",  "--compression", "--image-format",
                                        "--surface", "--archive",     "--drape",
                                        "--force",   "--dry-run"};

/// Where 3D Tiles of one compression lie, beside the tiles.
std::string tiles3d_folder(const std::string& output, GlbCompression compression) {
  return output + "/3dtiles" +
         (compression == GlbCompression::none ? "" : "-" + name_of(compression));
}

struct Arguments {
  DemInput input;
  SurfaceInput layers;
  BuildOptions options;
  MethodLine method;
  ShapeFiles shapes;
  std::uint64_t memory = kDefaultMemory;
  std::string progress = "auto", format = kQuantizedMesh, archive;
  DrapeInput drape;
  GlbCompression compression = GlbCompression::none;
  proto::ImageFormat image_format = proto::ImageFormat::png;
  ImagedSurface imaged = ImagedSurface::source;
  bool json = false, dry_run = false;
  Draped draped;  // of `drape`
  ShardLine shards;
};

nlohmann::ordered_json to_json(const UpdateReport& u) {
  nlohmann::ordered_json j = {{"blocks", u.blocks},
                              {"changed_blocks", u.changed_blocks},
                              {"block_posts", u.block_posts},
                              {"dirty_tiles", u.dirty_tiles},
                              {"levels_of_other_steps", u.levels_of_other_steps},
                              {"new_layers", u.new_layers},
                              {"bent_layers", u.bent_layers},
                              {"gone_layers", u.gone_layers},
                              {"gone_tiles", u.gone_tiles}};
  if (!u.everything.empty()) j["everything"] = u.everything;
  return j;
}

nlohmann::ordered_json to_json(const BuildReport& r, const TileSetOptions& tiles,
                               const Surface& source, double seconds) {
  nlohmann::ordered_json j;
  j["vertical_datum"] = name(source.info().datum);
  if (const auto stated = stated_accuracy(source); !stated.empty())
    j["accuracy"] = proto::accuracy_json(stated);
  j["tiles"] = r.tiles;
  j["built"] = r.built;
  j["reused"] = r.reused;
  j["unsound"] = r.unsound;
  j["bytes"] = r.bytes;
  j["seconds"] = seconds;
  j["threads"] = r.threads;
  j["peak_mb"] = PeakMemory::megabytes();
  if (r.update.updated) j["update"] = to_json(r.update);
  j["over_budget"] = r.over_budget;
  j["worst_over_budget"] = r.worst_over_budget;
  j["worst_over_budget_m"] = r.worst_over_budget_m;
  j["not_one_sided"] = r.not_one_sided;
  j["method"] = method_text(tiles.method);
  j["by_bounded"] = r.by_bounded;
  j["without_lines"] = r.without_lines;
  if (r.without_lines > 0) j["some_without_lines"] = r.some_without_lines;
  if (r.indexed_level >= 0)
    j["index"] = {
        {"deepest_level", r.indexed_level}, {"bytes", r.index_bytes}, {"made", r.index_made}};
  for (const LevelReport& l : r.levels) {
    if (l.tiles == 0) continue;
    j["levels"].push_back({{"level", l.level},
                           {"tiles", l.tiles},
                           {"bytes", l.bytes},
                           {"budget_m", l.budget_m},
                           {"worst_error_m", l.worst_error_m},
                           {"worst_edge_error_m", l.worst_edge_error_m}});
  }
  return j;
}

/// What changed since the tiles that are there were made, and what of them is made again; nothing
/// where there is no update.
std::string update_text(const UpdateReport& u) {
  if (!u.updated) return {};
  const std::string gone =
      u.gone_tiles > 0 ? fmt::format("; {} have nothing to stand on any more", u.gone_tiles) : "";
  if (!u.everything.empty())
    return fmt::format("all {} tiles are made again, for {}{}\n", u.dirty_tiles, u.everything,
                       gone);
  std::string text;
  if (!u.new_layers.empty())
    text += fmt::format(
        "{} (new, or on another grid than before): all tiles that {} a say in are "
        "made again\n",
        fmt::join(u.new_layers, ", "), u.new_layers.size() == 1 ? "it has" : "they have");
  if (!u.bent_layers.empty())
    text +=
        fmt::format("{} {} otherwise than before: all tiles that {} a say in are made again\n",
                    fmt::join(u.bent_layers, ", "), u.bent_layers.size() == 1 ? "blends" : "blend",
                    u.bent_layers.size() == 1 ? "it has" : "they have");
  if (u.gone_layers > 0)
    text += fmt::format("{} of before {} gone, or on another grid\n",
                        u.gone_layers == 1 ? "1 layer" : fmt::format("{} layers", u.gone_layers),
                        u.gone_layers == 1 ? "is" : "are");
  text += fmt::format(
      "heights changed in {} of {} blocks of {} x {} posts: {} tiles depend on what "
      "changed{}{}\n",
      u.changed_blocks, u.blocks, u.block_posts, u.block_posts, u.dirty_tiles,
      u.levels_of_other_steps > 0
          ? fmt::format(", {} whole levels because their range needs other height "
                        "steps",
                        u.levels_of_other_steps)
          : "",
      gone);
  return text;
}

/// What a build would cost, and what an update of the folder would do, where there is one.
int foresee(const Surface& surface, const BuildOptions& o, const std::string& style, bool json) {
  Result<UpdateReport> update;
  if (!o.output.empty()) {
    ProgressBar bar("posts", progress_style(style));
    update = foresee_update(surface, o, bar.progress());
  }
  if (!update) return complain(update.error());
  const auto as_json = to_json(*update);
  const int exit =
      print_estimate(surface, o, style, json, 0, 0, update->updated ? &as_json : nullptr);
  if (exit == kOk && update->updated && !json)
    fmt::print("an update of {}: {}", o.output, update_text(*update));
  return exit;
}

void print(const BuildReport& r, const TileSetOptions& tiles, const VerticalDatum& datum,
           double seconds) {
  fmt::print("{:>5} {:>10} {:>12} {:>12} {:>14}\n", "level", "tiles", "bytes/tile", "budget m",
             "worst error m");
  for (const LevelReport& l : r.levels) {
    if (l.tiles == 0) continue;
    fmt::print("{:>5} {:>10} {:>12} {:>12.2f} {:>14.2f}\n", l.level, l.tiles, l.bytes / l.tiles,
               l.budget_m, l.worst_error_m);
  }
  if (r.over_budget > 0) {
    fmt::print(
        "{} and say{} true error, {} the most: {:.3g} m in place of {:.3g}. "
        "Where posts differ that much over so short a way, the grid of the format or its steps of "
        "height are too coarse for a vertex at each\n",
        r.over_budget == 1
            ? "1 tile cannot keep its level's budget"
            : fmt::format("{} tiles cannot keep their level's budget", r.over_budget),
        r.over_budget == 1 ? "s its" : " their", r.worst_over_budget, r.worst_over_budget_m,
        r.worst_budget_m);
  }
  if (r.by_bounded > 0)
    fmt::print("{} of the tiles are made by bounded: {} cannot keep their level's budget\n",
               r.by_bounded, method_name(tiles.method));
  if (r.without_lines > 0)
    fmt::print(
        "{} leave{} out lines and shores, with which {} more than twice {} level's budget: "
        "{}{}. Breaklines are no edges there, and lakes, where those go too, not level; simpler "
        "lines and smaller polygons help\n",
        r.without_lines == 1 ? "1 tile" : fmt::format("{} tiles", r.without_lines),
        r.without_lines == 1 ? "s" : "", r.without_lines == 1 ? "it is" : "they are",
        r.without_lines == 1 ? "its" : "their", fmt::join(r.some_without_lines, ", "),
        r.without_lines > r.some_without_lines.size() ? ", ..." : "");
  if (r.not_one_sided > 0) {
    fmt::print(
        "{} tiles could not be kept on one side of their posts and say so in their metadata\n",
        r.not_one_sided);
  }
  fmt::print("{}", update_text(r.update));
  if (r.unsound > 0) {
    fmt::print(
        "{} tiles of an earlier run were made again: torn, changed, missing or not known to be "
        "whole\n",
        r.unsound);
  }
  if (r.indexed_level >= 0)
    fmt::print("errors of levels up to {} are bounds by the residual index ({} bytes, {})\n",
               r.indexed_level, r.index_bytes, r.index_made ? "made now" : "kept");
  fmt::print("{} tiles ({} built, {} kept), {} bytes, in {}; vertical datum: {}\n", r.tiles,
             r.built, r.reused, r.bytes, duration_text(seconds), name(datum));
}

/// Of the tiles that lie there now, beside them.
Result<tiles3d::FolderReport> write_tiles3d(const Arguments& a, const TileSet& tiles) {
  ProgressBar bar("3D Tiles", progress_style(a.progress));
  return tiles3d::write_tileset(
      tiles, tiles3d_folder(a.options.output, a.compression),
      {.compression = a.compression, .threads = a.options.threads, .draped = a.draped},
      stoppable(bar));
}

/// Of the 3D Tiles that lie there now.
Result<tiles3d::ArchiveReport> write_archive(const Arguments& a, const TileSet& tiles) {
  ProgressBar bar("archive", progress_style(a.progress));
  return tiles3d::write_archive(tiles, tiles3d_folder(a.options.output, a.compression), a.archive,
                                a.options.threads, stoppable(bar));
}

nlohmann::ordered_json to_json(const tiles3d::FolderReport& r) {
  return {{"contents", r.contents},
          {"subtrees", r.subtrees},
          {"kept_subtrees", r.kept_subtrees},
          {"bytes", r.bytes}};
}

void print(const tiles3d::FolderReport& r) {
  if (r.there)
    fmt::print("3D Tiles: kept\n");
  else
    fmt::print("3D Tiles: {} contents, {} subtrees, {} bytes{}\n", r.contents, r.subtrees, r.bytes,
               r.kept_subtrees > 0
                   ? fmt::format("; {} subtrees kept of an earlier run", r.kept_subtrees)
                   : "");
}

/// Before anything is written; tiles find out by the scan that plans them.
Result<void> check_any_height(const Surface& source) {
  const auto any = any_height(source);
  if (!any) return std::unexpected(any.error());
  if (!*any) return fail(Errc::bad_data, no_valid_height(source.info()));
  return {};
}

/// What was made is whole; who changed the source meanwhile is not to hear that all went well.
int end_with(const Surface& source) {
  if (auto same = source.unchanged(); !same) return complain(same.error());
  warn_of_nodata(source);
  return kOk;
}

int run_images(const Arguments& a, const Surface& source, const ImageContent& content) {
  if (const auto ok = check_any_height(source); !ok) return complain(ok.error());
  const std::string of = a.input.files.empty() ? a.format : a.input.files.front();
  const auto images = image_source(source, {content, a.image_format}, a.imaged, a.options.tiles);
  if (!images) return complain(images.error());
  int exit = kOk;
  {
    ProgressBar bar("images", progress_style(a.progress));
    exit = build_images(*images, source.info().datum, std::filesystem::path(of).stem().string(),
                        {.output = a.options.output,
                         .first_level = a.options.tiles.first_level,
                         .last_level = a.options.tiles.last_level,
                         .threads = a.options.threads,
                         .force = a.options.force},
                        a.json, stoppable(bar));
  }
  return exit == kOk ? end_with(source) : exit;
}

int run_scenery(const Arguments& a, const Surface& source) {
  if (const auto ok = check_any_height(source); !ok) return complain(ok.error());
  finish_on_signals();
  const TileSetOptions& tiles = a.options.tiles;
  const int exit = build_scenery(source, *a.input.environment,
                                 {.options = {tiles.max_error_m, tiles.effort},
                                  .cover = a.draped.cover,
                                  .output = a.options.output,
                                  .progress = a.progress,
                                  .threads = a.options.threads,
                                  .json = a.json,
                                  .force = a.options.force,
                                  .stoppable = stoppable});
  return exit == kOk ? end_with(source) : exit;
}

DrapedOver draped_over(const std::string& format) {
  return format == kTiles3d      ? DrapedOver::tiles3d
         : format == kFlightGear ? DrapedOver::flightgear
                                 : DrapedOver::nothing;
}

Result<void> check_archive(const Arguments& a) {
  if (a.format != kTiles3d)
    return fail(Errc::invalid_argument, "--archive is of 3D Tiles: add --format 3dtiles");
  if (!a.archive.ends_with(".3tz"))
    return fail(Errc::invalid_argument, a.archive + ": readers know archives by .3tz; name it so");
  if (const auto ok = can_write_file(a.archive); !ok) return ok;
  return {};
}

Result<void> check_beside_plan(Command c, const DemInput& input) {
  for (const char* option : kNotOfShards)
    if (c.given(option))
      return fail(
          Errc::invalid_argument,
          std::string(option) + " does not go with --plan: shards are quantized-mesh tiles");
  std::vector<std::string> given = input.given;
  for (const char* option : kPlanned)
    if (c.given(option)) given.push_back(option);
  if (!given.empty())
    return fail(Errc::invalid_argument, given.front() + " is decided by the plan: leave it out");
  if (!c.given("--shard")) refuse_missing("--shard");
  return {};
}

std::vector<std::string> files_of(const Surface& surface) {
  std::vector<std::string> files;
  for (const SurfaceLayer& layer : surface.layers())
    files.insert(files.end(), layer.source->info().files.begin(), layer.source->info().files.end());
  return files;
}

int run(Arguments a) {
  if (names_archive(a.options.output))
    return complain({Errc::invalid_argument,
                     a.options.output + ": tiles are built in a directory; tind copy makes an "
                                        "archive of it"});
  if (remote::is_remote(a.options.output) &&
      (!remote::is_s3(a.options.output) || a.format != kQuantizedMesh))
    return complain({Errc::invalid_argument, a.options.output +
                                                 ": what can be built on another machine are "
                                                 "quantized-mesh tiles in s3://BUCKET/PREFIX"});
  if (a.format != kTiles3d && a.compression != GlbCompression::none)
    return complain({Errc::invalid_argument,
                     "--compression is of the contents of 3D Tiles: add --format 3dtiles, or leave "
                     "it out"});
  if (!a.archive.empty())
    if (const auto ok = check_archive(a); !ok) return complain(ok.error());
  if (!a.archive.empty()) {
    auto inputs = inputs_of(a.input, a.layers, a.shapes);
    for (std::string& file : a.drape.files()) inputs.push_back(std::move(file));
    if (const int code = check_outputs({a.archive}, inputs); code != kOk) return code;
  }
  auto draped = open_drape(a.drape, draped_over(a.format));
  if (!draped) return complain(draped.error());
  a.draped = std::move(*draped);
  a.options.tiles.colours = a.draped.colours;
  if (a.format == kTiles3d && a.options.tiles.first_level > 0)
    return complain({Errc::invalid_argument,
                     "--format 3dtiles needs level 0, from where clients find all others: leave "
                     "out --levels, or begin it with 0"});
  DemOptions dem = dem_options(a.input);
  limit_caches(a.memory, a.input, a.layers, dem);
  auto opened = open_surface(a.input, a.layers, dem);
  if (!opened) return complain(opened.error());
  const auto source = with_shapes(std::move(*opened), a.shapes);
  if (!source) return complain(source.error());
  if (const auto ok = check_drape(a.drape, a.draped, *source); !ok) return complain(ok.error());
  const auto threads = threads_within(a.memory, *source, dem, a.options.threads);
  if (!threads) return complain(threads.error());
  a.options.threads = *threads;
  if (a.dry_run) return foresee(*source, a.options, a.progress, a.json);
  const auto images = image_format(a.format);
  if (!a.json) fmt::print("{}", layers_text(*source));
  if (!remote::is_remote(a.options.output))
    if (const int code = check_output_folder(
            a.options.output,
            a.format == kFlightGear ? std::vector<std::string>{} : files_of(*source),
            images ? "tiles.json" : "layer.json");
        code != kOk)
      return code;
  if (a.format == kFlightGear) return run_scenery(a, *source);
  if (!images) warn_of_plan(*source, a.options.tiles);
  finish_on_signals();
  if (images) return run_images(a, *source, *images);
  const auto begin = std::chrono::steady_clock::now();
  Result<BuildReport> report = fail(Errc::internal, "not run");
  {
    ProgressBar bar("tiles", progress_style(a.progress));
    report = build_tiles(*source, a.options, stoppable(bar));
  }
  if (!report) return complain(report.error());
  warn_of_nodata(*source);
  std::optional<tiles3d::FolderReport> beside;
  std::optional<tiles3d::ArchiveReport> archive;
  if (a.format == kTiles3d) {
    const auto tiles = open_stored_tiles(a.options.output);
    if (!tiles) return complain(tiles.error());
    const auto written = write_tiles3d(a, **tiles);
    if (!written) return complain(written.error());
    beside = *written;
    if (a.options.tiles.side != Side::both)
      warn(
          "--side holds for the quantized-mesh tiles; 3D Tiles draw triangles straight through "
          "space, a little lower on coarse levels: their max_error_m has it");
    if (!a.archive.empty()) {
      const auto packed = write_archive(a, **tiles);
      if (!packed) return complain(packed.error());
      archive = *packed;
    }
  }
  std::error_code none;
  if (report->built > 0 && !remote::is_remote(a.options.output))
    for (const auto compression : {GlbCompression::none, GlbCompression::meshopt})
      if (const std::string folder = tiles3d_folder(a.options.output, compression);
          std::filesystem::exists(folder + "/tileset.json", none) &&
          !(a.format == kTiles3d && compression == a.compression))
        warn(folder + ": 3D Tiles of the tiles before; --format 3dtiles" +
             (compression == GlbCompression::none ? "" : " --compression " + name_of(compression)) +
             " brings them up to date");
  const double seconds =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  if (a.json) {
    auto summary = to_json(*report, a.options.tiles, *source, seconds);
    if (beside) summary["3dtiles"] = to_json(*beside);
    if (archive) summary["archive"] = {{"files", archive->files}, {"bytes", archive->bytes}};
    fmt::print("{}\n", json::to_text(summary, 1));
  } else {
    print(*report, a.options.tiles, source->info().datum, seconds);
    if (beside) print(*beside);
    if (archive) fmt::print("{}: {} files, {} bytes\n", a.archive, archive->files, archive->bytes);
  }
  return kOk;
}

}  // namespace

void add_build(Command program, int& exit) {
  auto a = std::make_shared<Arguments>();
  Command c = program.add_subcommand(
      "build", "Make the tile pyramid of a DEM, or of layers of several, in a directory");
  c.add_option("DEM", a->input.files, "raster files");
  c.add_option("-o,--output", a->options.output, "directory of the tiles, or s3://BUCKET/PREFIX");
  c.add_option("--format", a->format,
               "quantized-mesh; 3dtiles: the same, and 3D Tiles 1.1 made of them in the folder "
               "3dtiles beside them, for any static server. flightgear: in place of tiles the "
               "scenery of FlightGear, also for TerraSync, with heights above the sea and "
               "--max-error in each bucket. Images of web maps, z/x/y.png (or .webp) and "
               "tiles.json: heights "
               "as rgb (terrain-RGB) or terrarium, or hillshade, slope, aspect")
      .one_of({kQuantizedMesh, kTiles3d, kFlightGear, "rgb", "terrarium", "hillshade", "slope",
               "aspect"});
  c.add_choice(
      "--compression", a->compression,
      "of the contents of 3D Tiles: none, or meshopt (EXT_meshopt_compression, about a third "
      "of the bytes, in the folder 3dtiles-meshopt)");
  c.add_choice("--image-format", a->image_format,
               "of images of web maps: png, or webp (without loss, fewer bytes)");
  c.add_choice("--surface", a->imaged,
               "what images of heights show: source, the DEM; mesh, the certified meshes of the "
               "tiles that --max-error and the like make")
      .shown();
  add_drape_options(c, a->drape);
  c.add_option("--archive", a->archive,
               "the 3D Tiles also as one file, X.3tz (3D Tiles Archive Format 1.3), whatever was "
               "there before");
  add_tile_options(c, a->options.tiles);
  add_tile_method(c, a->method);
  a->input.to_datum = "ellipsoid";  // as globe tiles are, and as tind serve makes them
  add_dem_options(c, a->input);
  add_shape_options(c, a->shapes);
  add_layer_options(c, a->layers);
  c.add_option("--threads", a->options.threads, "threads (default: one per core)").range(1, 1024);
  add_memory_option(c, a->memory);
  c.add_flag("--gzip", a->options.gzip,
             "store tiles compressed (a static server must then send Content-Encoding: gzip)");
  c.add_flag(
      "--force", a->options.force,
      "replace tiles that tind build made of a source that has no layer's grid and ground in "
      "common, with other options or by another version, images and scenery of another source, and "
      "update tiles of which most go; nothing else is touched");
  add_progress_option(c, a->progress);
  c.add_flag("--json", a->json, "print the summary as JSON");
  c.footer(
      "Killed and run again, it goes on; where heights, files or layers changed since, it makes "
      "again what depends on them. Tiles are quantized-mesh-1.0, EPSG:4326, TMS.");
  c.add_flag("--dry-run", a->dry_run,
             "only say what it would take, as tind estimate does, and which tiles an update of the "
             "directory would make again");
  add_shard_options(c, a->shards);
  c.on_run([a, c, &exit] {
    if (c.given("--plan")) {
      const auto fits = check_beside_plan(c, a->input);
      exit = fits ? build_shards(a->shards, a->options.output,
                                 {a->input.files, a->layers.layers, a->shapes}, c.environment(),
                                 a->memory, a->options.threads, a->progress, a->json)
                  : complain(fits.error());
      return;
    }
    for (const char* option : {"--shard", "--grace"})
      if (c.given(option)) {
        exit = complain({Errc::invalid_argument, std::string(option) + " is of --plan"});
        return;
      }
    if (!names_any(a->input, a->layers)) refuse_missing("DEM");
    if (!c.given("--output") && !a->dry_run) refuse_missing("--output");
    if (image_format(a->format))
      if (const auto fits = check_image_options(c, a->format, a->imaged); !fits) {
        exit = complain(fits.error());
        return;
      }
    for (const char* option : {"--image-format", "--surface"})
      if (!image_format(a->format) && c.given(option)) {
        exit = complain({Errc::invalid_argument,
                         std::string(option) +
                             " is of images of web maps: add --format rgb, terrarium, hillshade, "
                             "slope or aspect, or leave it out"});
        return;
      }
    for (const char* option : kOfTiles)
      if (a->format == kFlightGear && c.given(option)) {
        exit = complain({Errc::invalid_argument,
                         std::string(option) + " is for tiles, which --format flightgear does not "
                                               "make: leave it out"});
        return;
      }
    const auto method = set_tile_method(c, a->method, a->options.tiles);
    exit = method ? run(*a) : complain(method.error());
  });
}

}  // namespace tind::cli
